/* Sums of seeds. */
#ifndef SEEDS_H
#define SEEDS_H

#include "instance.h"

/* Adds one to the other. */
void seed_add(Seed *sum, const Seed *term);

#endif
