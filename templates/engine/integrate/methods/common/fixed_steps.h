/* What solver.h asks of a method is nothing for steps of fixed length: solver_error and solver_dense. */
#ifndef FIXED_STEPS_H
#define FIXED_STEPS_H

#include "solver.h"

#endif
