/* A mechanism without contacts, stops and dry friction. */
#include "contact_events.h"

bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)values;
    return true;
}

bool contacts_catch(const State *before, const State *after) {
    (void)before;
    (void)after;
    return false;
}

void contacts_foresee(Instance *instance) {
    (void)instance;
}

void contacts_turn(Instance *instance) {
    (void)instance;
}

int contacts_overdue(Instance *instance, const double values[]) {
    (void)instance;
    (void)values;
    return -1;
}

int contacts_slipping(Instance *instance) {
    (void)instance;
    return -1;
}

bool contacts_undo_drift(Instance *instance, bool *jumped) {
    (void)instance;
    (void)jumped;
    return true;
}

void contacts_gaps(Instance *instance, double gaps[]) {
    (void)instance;
    (void)gaps;
}

bool contacts_jump(Instance *instance, const double before[]) {
    (void)instance;
    (void)before;
    return true;
}

bool contacts_settle(Instance *instance, const bool due[], bool *jumped, bool *again) {
    (void)instance;
    (void)due;
    (void)jumped;
    (void)again;
    return true;
}

bool contacts_oppose(Instance *instance, double time, const double states[], const double unknowns[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)unknowns;
    return true;
}

void contacts_share(Instance *instance, const System *system, double unknowns[]) {
    (void)instance;
    (void)system;
    (void)unknowns;
}
