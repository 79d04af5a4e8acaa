/* What is looked for along a run and gives notice (notices.h). */
#ifndef WATCHING_H
#define WATCHING_H

#include "solver.h"

/* Notices a motion that keeps accepted steps at the limit of stability, or fixed steps beyond it. Fixed steps are
   looked at from the first one on. */
void watch_stiffness(Instance *instance, Step step);

/* Notices steps (s) of a variational method that are of another length than those before: its energy is bounded over
   long times because a neighbouring system, which belongs to one length, is solved exactly. */
void watch_length(Instance *instance, double length);

/* Notices steps (s) that do not resolve a vibration, which the method then damps or gets wrong; nothing is known of
   vibrations where parameters differ from those of the export. */
void watch_vibrations(Instance *instance, double length);

/* Notices a motion input that is moved from step to step with a velocity and an acceleration of 0, where the equations
   contain these. */
void watch_motions(Instance *instance);

/* At the end of a step of the importer: remembers where the motions are. */
void keep_motions(State *state);

/* Notices coordinates that are out of their ranges at the present point. */
void watch_ranges(Instance *instance);

/* The longest step (s) that resolves a vibration (rad/s): an eighth of its period, by which ros2 takes 1 % from it in a
   period and radau5 0.03 %. */
double resolving_step(double frequency);

/* The rounding error (s) of the difference of two times up to this one. */
double rounding_of_length(double time);

#endif
