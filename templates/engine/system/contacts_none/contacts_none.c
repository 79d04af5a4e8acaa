/* A mechanism without contacts, stops and dry friction. */
#include "contacts.h"

bool contacts_hold(const Instance *instance) {
    (void)instance;
    return false;
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

double contacts_slowness(Instance *instance) {
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
