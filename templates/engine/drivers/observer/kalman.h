/* Kalman's filters in square-root form: what stands side by side is brought to triangular form, so that covariances
   stay positive whatever rounding does. T. Kailath, A. H. Sayed, B. Hassibi, Linear Estimation, 2000, chapter 12; S.
   Sarkka, Bayesian Filtering and Smoothing, 2013, sections 5.2 (extended) and 6.6 (cubature points: UNSCENTED). P.
   Moireau, D. Chapelle, ESAIM: Control, Optimisation and Calculus of Variations 17 (2011), section 2 (SIMPLEX).

   They work on the estimate of the scratch, and on the basis and the root of the memory. */
#ifndef KALMAN_H
#define KALMAN_H

#include "instance.h"

/* What was measured at a time: counts[i] are the samples[i] that count. Behind the first ones of these, the places
   taken[old], stand `fresh` ones, whose innovations are shown. */
typedef struct {
    int old, fresh;
    int taken[N_MEASURED];
    double measured[N_MEASURED]; /* by place */
} Sample;

/* The root follows from the standard deviations of the start, in the basis of the estimate. Returns false, with
   instance->failure, if no state near it meets the constraints. */
bool kalman_start(Instance *instance, double time);

/* The motion from start to end (s). */
bool kalman_predict(Instance *instance, double start, double end);

/* The correction by a sample at a time (s). */
bool kalman_correct(Instance *instance, double time, const Sample *sample);

/* Standard deviations of the estimate, to be shown. */
void kalman_show(Instance *instance);

#endif
