/* A mechanism without contacts, stops and dry friction. */
#include "contacts.h"

bool contacts_evaluate(Instance *instance, double time, const double states[], double values[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)values;
    return true;
}

bool contacts_settle(Instance *instance, const bool due[], bool *jumped) {
    (void)instance;
    (void)due;
    (void)jumped;
    return true;
}
