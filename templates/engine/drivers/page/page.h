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

/* A communication step to the time end (s). Where an event comes before, it ends there, and returns 2: page_pass then
   takes the instance over the event. */
int page_advance(double end);
int page_pass(void);

/* The time that the instance is at, s. */
double page_time(void);

/* Brings the point and the values of all variables up to date with the instance. What has no value is not a number. */
void page_observe(void);

/* Two numbers at the values that page_observe found. The first is the power of what changes the energy h of the
   mechanism, W; where there is a variable dissipated_energy, what this one tells of is left out. The second is not 0
   where a support moves that a constraint or contact speaks of: in an impact it does work. */
const double *page_power(void);

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
