/* Repetition until what follows from the forces of rows are these forces. */
#ifndef REPETITION_H
#define REPETITION_H

#include "instance.h"

/* The last repetition: what it began with, and by how much its answer differed. */
typedef struct {
    double x[N_CONSTRAINTS], rest[N_CONSTRAINTS];
} Repetition;

/* Sets x[N_CONSTRAINTS], of which answer[N_CONSTRAINTS] followed, to what the next repetition begins with. That is the
   answer, or, where repetitions converge slowly or not at all, what the last two of them lead to along a line. *last
   begins with zeros. D. G. Anderson, Iterative procedures for nonlinear integral equations, Journal of the ACM 12,
   1965. */
void repetition_proceed(Repetition *last, const double answer[], bool slow, double x[]);

#endif
