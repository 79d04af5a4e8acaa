/* The gate of the live page: what its script calls in place of the functions of a standard. There is one instance. All
   values are in SI units. Functions that return int return 0 where something failed; page_sentence then tells what. */
#ifndef PAGE_H
#define PAGE_H

/* How many numbers there are of x, u, p, the coordinates among x, the variables and the picture, and the bytes of the
   state. */
const int *page_sizes(void);

/* Begins an experiment from start to stop (s) with this relative tolerance: every variable has its start value. */
void page_begin(double start, double stop, double tolerance);

/* Gives a variable, by value reference, a value. */
void page_set(int variable, double value);

/* Solves for the start values that constraints determine, and decides the modes. */
int page_settle(void);

/* A communication step to the time end (s). */
int page_advance(double end);

/* Brings the point and the values of all variables up to date with the instance. What has no value is not a number. */
void page_observe(void);

/* The point: x, u and p, one behind the other. */
double *page_point(void);

/* The values of the variables by value reference, as page_observe found them. */
const double *page_values(void);

/* The spots of the picture, three coordinates (m) each, and behind them the residuals of holonomic constraints: at a
   time (s) and the present point. */
const double *page_draw(double time);

/* What page_advance goes on from: a copy of these bytes restores it, if page_restored is called after. */
void *page_state(void);
void page_restored(void);

const char *page_sentence(void);

#endif
