/* The numbers of contacts, stops and dry frictions, which mechanism.h has. */
#ifndef ELEMENT_SIZES_H
#define ELEMENT_SIZES_H

#include "mechanism.h"

enum { N_ELEMENTS = N_UNILATERALS + N_FRICTIONS };

#endif
