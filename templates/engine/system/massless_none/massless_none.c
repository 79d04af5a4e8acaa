/* A mechanism in which every coordinate has mass. */
#include "massless.h"

bool massless_settle(Instance *instance) {
    (void)instance;
    return true;
}

void massless_keep(State *state) {
    (void)state;
}

bool massless_return(Instance *instance) {
    (void)instance;
    return false;
}

void massless_explain_failure(Instance *instance) {
    (void)instance;
}

bool massless_settle_seed(Instance *instance, Seed *seed) {
    (void)instance;
    (void)seed;
    return true;
}
