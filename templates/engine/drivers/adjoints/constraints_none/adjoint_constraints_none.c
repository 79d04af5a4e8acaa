/* A mechanism without constraints: M is symmetric. */
#include "adjoint_parts.h"
#include "system.h"

void system_answer_adjoint(const System *system, const double unknowns[], double change[]) {
    system_solve(system, unknowns, NULL, NULL, change);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        change[i] = -change[i];
    }
}

void accelerations_stabilise_adjoint(const Instance *instance, double change[]) {
    (void)instance;
    (void)change;
}

void multipliers_spread_adjoint(const Instance *instance, double unknowns[], Spread *spread) {
    (void)instance;
    (void)unknowns;
    spread->unique = true;
}

void multipliers_spread_knowns(const Instance *instance, const Spread *spread, const double change[],
                               Seed *sensitivity) {
    (void)instance;
    (void)spread;
    (void)change;
    (void)sensitivity;
}

void constraints_settle_adjoint(Instance *instance, Seed *sensitivity) {
    (void)instance;
    (void)sensitivity;
}
