/* Steps of Newton's method for laws. */
#ifndef NEWTON_STEP_H
#define NEWTON_STEP_H

#include "laws.h"
#include "step_matrix.h"

/* Bound of the steps. */
enum { MOST_NEWTON_STEPS = 40 };

/* The steps differ in where they lead to from afar; the long ones serve where friction wedges. */
typedef struct {
    const Laws *laws;
    double step;    /* the proximal step of friction, in units of 1 / curvature */
    double damping; /* of rows that are held */
    StepMatrix equations;
    double *right;  /* [size] of the equations; the next ones [size] */
    double *change; /* of x */
    double *x, *w;
} Newton;

/* A step of the method. False: its equations are singular. */
bool newton_step(const Newton *newton);

/* Steps where each row acts on few of many (laws->first). False: they do not lead to a solution. */
bool newton_many(Newton *newton);

#endif
