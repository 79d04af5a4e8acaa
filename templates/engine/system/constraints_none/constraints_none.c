/* A mechanism without constraints: the unknowns are the accelerations alone, and all states are fine.

   The generated code solves M qdd = f without pivoting, in an order that suits the mechanism, and reports its pivots.
   Where one of them is no better than rounding error, the dense solver of linear_solve.h takes over. */
#include "accelerations.h"
#include "constraints.h"
#include "failure.h"
#include "finite.h"
#include "mass_matrix.h"
#include "system.h"

static bool factorize_densely(Instance *instance, double time, const double states[], const double inputs[],
                              System *system) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, concerned, N_COORDINATES);
    const MassOutcome outcome = mass_evaluate(instance, time, states, inputs, system, concerned);
    return arena_leave(mark, mass_accept(instance, outcome, time, concerned));
}

bool accelerations_at(Instance *instance, double time, const double states[], const double inputs[],
                      double accelerations[]) {
    const ArenaMark mark = arena_mark_of(instance->arena, N_COORDINATES * sizeof(double));
    WORK(mark, double, pivots, N_COORDINATES);
    System *system = &instance->scratch.system;
    mechanism_accelerations(time, states, inputs, instance->state.parameters, accelerations, pivots);
    if (!pivots_sound(instance, pivots)) {
        system->dense = true;
        if (!factorize_densely(instance, time, states, inputs, system)) {
            return arena_leave(mark, false);
        }
        system_solve(system, instance->scratch.forcing, NULL, NULL, accelerations);
    }
    return arena_leave(mark, all_finite(accelerations, N_COORDINATES) ||
                                 report_accelerations(instance, time, accelerations));
}

void accelerations_stabilise(const Instance *instance, double change[]) {
    (void)instance;
    (void)change;
}

bool multipliers_unique(const Instance *instance) {
    (void)instance;
    return true;
}

void multipliers_spread(const System *system, double unknowns[]) {
    (void)system;
    (void)unknowns;
}

void multipliers_spread_rates(const Instance *instance, const Seed *seed, double unknowns[]) {
    (void)instance;
    (void)seed;
    (void)unknowns;
}

bool system_factorize(Instance *instance, double time, const double states[], const double inputs[], int rows,
                      double damping, System *system) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pivots, N_COORDINATES);
    (void)rows; /* 0 */
    (void)damping;
    mechanism_factor(time, states, inputs, instance->state.parameters, system->factor, pivots);
    system->dense = !pivots_sound(instance, pivots);
    return arena_leave(mark, !system->dense || factorize_densely(instance, time, states, inputs, system));
}

void system_solve(const System *system, const double right[], const double *below, const double *usual,
                  double unknowns[]) {
    (void)below; /* empty */
    (void)usual;
    mass_divide(system, right, unknowns);
}

double constraints_firmness(const Instance *instance, const System *system) {
    (void)instance;
    (void)system;
    return 1.0;
}

double constraints_drift(const Instance *instance, double time, const double states[], const double inputs[]) {
    (void)instance;
    (void)time;
    (void)states;
    (void)inputs;
    return 0.0;
}

double constraints_velocity_drift(const Instance *instance) {
    (void)instance;
    return 0.0;
}

bool constraints_jump(const Instance *instance, double time, const double inputs[], const double from[],
                      const double to[], double bar) {
    (void)instance;
    (void)time;
    (void)inputs;
    (void)from;
    (void)to;
    (void)bar;
    return false;
}

bool constraints_project(Instance *instance, double time, const double inputs[], double states[], bool *moved) {
    (void)instance;
    (void)time;
    (void)inputs;
    (void)states;
    *moved = false;
    return true;
}

bool constraints_project_velocities(Instance *instance, double states[], bool *moved) {
    (void)instance;
    (void)states;
    *moved = false;
    return true;
}

bool constraints_settle(Instance *instance) {
    (void)instance;
    return true;
}

void constraints_settle_seed(Instance *instance, Seed *seed) {
    (void)instance;
    (void)seed;
}

void constraints_remember(Instance *instance, const Motion *motion) {
    (void)instance;
    (void)motion;
}
