/* The part that contacts, stops and dry friction have in the events of a mechanism, see events.h; contacts_none.c is
   for mechanisms whose events are those of switches alone. */
#ifndef CONTACTS_H
#define CONTACTS_H

#include "instance.h"

/* values[N_EVENTS - N_SWITCHES] of their event functions, as events_evaluate says. */
bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]);

/* As events_settle; due[N_EVENTS - N_SWITCHES] or NULL. *jumped is set if states changed, and is left alone if not. */
bool contacts_settle(Instance *instance, const bool due[], bool *jumped);

#endif
