/* A mechanism without contacts, stops and dry friction. */
#include "contacts.h"

bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)values;
    return true;
}

int contacts_sinking(Instance *instance, const double values[]) {
    (void)instance;
    (void)values;
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

bool contacts_hold(const Instance *instance) {
    (void)instance;
    return false;
}

bool contacts_oppose(Instance *instance, double time, const double states[], const double unknowns[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)unknowns;
    return true;
}

int contacts_idle(const Instance *instance) {
    (void)instance;
    return 0;
}

bool contacts_sliding(const Instance *instance) {
    (void)instance;
    return false;
}

bool contacts_slide_in_space(const Instance *instance) {
    (void)instance;
    return false;
}

double contacts_decay(Instance *instance) {
    (void)instance;
    return 0.0;
}

bool contacts_slide(Instance *instance, const System *system, double time, const double states[],
                    const double inputs[], double unknowns[]) {
    (void)instance;
    (void)system;
    (void)time;
    (void)states;
    (void)inputs;
    (void)unknowns;
    return true;
}

void contacts_share(Instance *instance, const System *system, double unknowns[]) {
    (void)instance;
    (void)system;
    (void)unknowns;
}

bool contacts_rub(Instance *instance, double time, const double states[], double forces[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)forces;
    return true;
}

void contacts_answer(Instance *instance, const System *system, double time, const double states[],
                     const double inputs[], const double unknowns[], const Seed *seed, double answer[]) {
    (void)instance;
    (void)system;
    (void)time;
    (void)states;
    (void)inputs;
    (void)unknowns;
    (void)seed;
    (void)answer;
}

void contacts_answer_twice(Instance *instance, const System *system, const double du[], const double d2u[],
                           const double rates[], double answer[]) {
    (void)instance;
    (void)system;
    (void)du;
    (void)d2u;
    (void)rates;
    (void)answer;
}
