/* Tables of measured data on intervals. */
#ifndef INTERVAL_LOOKUP_H
#define INTERVAL_LOOKUP_H

#include "intervals.h"
#include "lookup.h"

/* What lookup and lookup_2 return for arguments in these intervals, without the places where there is no value. */
Interval interval_lookup(const Table *table, int order, Interval x);
Interval interval_lookup_2(const Table *table, int order_x, int order_y, Interval x, Interval y);

#endif
