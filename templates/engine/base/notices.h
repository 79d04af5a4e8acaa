/* Notices: what the importer should know about a run, as data. Each kind is told once, at the end of a step of the
   importer: of a communication step, or of a step of its own solver. */
#ifndef NOTICES_H
#define NOTICES_H

#include "instance.h"

/* A step of the importer begins, and nothing was noticed in it yet. */
void begin_notices(Instance *instance);

/* Keeps a notice on the present point, of a solver step of this length (s) and with the index that its kind asks for.
   Of a kind that was noticed before, nothing is kept. */
void give_notice(Instance *instance, NoticeKind kind, double step, int index);

/* Keeps a notice whatever was noticed before, as long as there is room. */
void add_notice(Instance *instance, NoticeKind kind, double step, int index);

#endif
