/* A mechanism whose equations of motion are smooth throughout. */
#include "events.h"

bool events_evaluate(Instance *instance, double time, const double states[], double values[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)values;
    return true;
}

bool events_settle(Instance *instance, const bool due[], bool *jumped) {
    (void)instance;
    (void)due;
    *jumped = false;
    return true;
}

bool events_take_sides(Instance *instance) {
    (void)instance;
    return false;
}

bool events_refresh(Instance *instance, bool *jumped) {
    (void)instance;
    *jumped = false;
    return true;
}

bool events_go_on(Instance *instance) {
    (void)instance;
    return true;
}

bool events_indicate(Instance *instance, double indicators[]) {
    (void)instance;
    (void)indicators;
    return true;
}
