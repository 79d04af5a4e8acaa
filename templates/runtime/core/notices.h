/* What is noticed along a run. Each kind is told once, at the end of a step of the importer: of a communication step,
   or of a step of its own solver. */
#ifndef NOTICES_H
#define NOTICES_H

#include "instance.h"
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

/* Writes one sentence to text[size] on a notice that is not NOTICE_NONE: what was noticed, when, and what to do. */
void notice_sentence(const Notice *notice, char text[], size_t size);

/* A step of the importer begins, and nothing was noticed in it yet. */
void begin_notices(Instance *instance);

/* Notices a motion input that is moved from step to step with a velocity and an acceleration of 0, where the equations
   contain these. */
void watch_motions(Instance *instance);

/* At the end of a step of the importer: remembers where the motions are. */
void keep_motions(State *state);

/* Notices coordinates that are out of their ranges at the present point. */
void watch_ranges(Instance *instance);

/* Gives notice of what the laws of contact say: NO_FORCES, TWO_SOLUTIONS, POISSON, CLOSED or REDUCED; event is an event
   function of the contact. */
void note_impact(Instance *instance, NoticeKind kind, int event);

/* The rounding error (s) of the difference of two times up to this one. */
double rounding_of_length(double time);

#endif
