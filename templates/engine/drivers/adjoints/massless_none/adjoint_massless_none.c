/* A mechanism in which every coordinate has mass. */
#include "adjoint_parts.h"

bool massless_settle_adjoint(Instance *instance, Seed *sensitivity) {
    (void)instance;
    (void)sensitivity;
    return true;
}
