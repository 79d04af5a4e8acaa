/* Moving states onto the constraints after solver steps. Source: Hairer, Wanner, Solving Ordinary Differential
   Equations II, 2nd edition, section VII.2 (projection methods, simplified Newton iteration). */
#include <math.h>

#include "constraint_factorization.h"
#include "constraint_residuals.h"
#include "constraints.h"
#include "scale.h"
#include "system.h"

/* Bound of the Newton steps of a projection; what is left after the last one may be acceptable. */
enum { MOST_PROJECTIONS = 12 };

double constraints_drift(const Instance *instance, double time, const double states[], const double inputs[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    residuals_evaluate(instance, time, states, inputs, values);
    const double drift = residual_size(values, POSITIONS, 1.0, NULL);
    arena_release(mark);
    return drift;
}

double constraints_firmness(const Instance *instance, const System *system) {
    const IndependentRows *known = &instance->state.rows;
    const ConstraintFactorization *f = &system->constraints;
    double least = 1.0;
    if (!instance->state.rows_known || f->holding) {
        return 1.0;
    }
    for (int k = 0; k < f->rank; k++) {
        const double usual = known->distance[f->order[k]];
        const double part = usual > 0.0 ? constraints_distance(f, k) / usual : 1.0;
        least = fmin(least, part * part);
    }
    return fmax(least, CLEARLY_INDEPENDENT);
}

double constraints_velocity_drift(const Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    const State *state = &instance->state;
    residuals_evaluate(instance, state->time, state->states, state->inputs, values);
    const double drift = residual_size(values, VELOCITIES, residual_unit(VELOCITIES, state->states), NULL);
    arena_release(mark);
    return drift;
}

/* states[of the level] += the shortest change, in the metric M, that takes the residuals away to first order. */
static void correct_states(const Values *values, Level level, const System *system, double states[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK(mark, double, right, N_CONSTRAINTS);
    WORK(mark, double, change, N_UNKNOWNS);
    static const double ZERO[N_COORDINATES] = {0.0};
    for (int k = 0; k < rows_of(level); k++) {
        right[k] = level == POSITIONS ? -values->positions[k] : -values->velocities[k];
    }
    system_solve(system, ZERO, right, NULL, change);
    for (int i = 0; i < N; i++) {
        states[(level == POSITIONS ? 0 : N) + i] += change[i];
    }
    arena_release(mark);
}

/* Simplified Newton iteration: the system is factorised again only where that is needed to go on. *factorized is the
   number of rows that the factorisation in scratch stands for. The values are those at the states, before and after. */
static bool project_to(Instance *instance, Level level, double time, const double inputs[], double states[],
                    Values *values, int *factorized, bool *moved) {
    System *system = &instance->scratch.system;
    const double unit = residual_unit(level, states);
    double previous = HUGE_VAL;
    bool fresh = false;
    for (int i = 0; i < MOST_PROJECTIONS; i++) {
        const bool known = *factorized == rows_of(level);
        const double size = residual_size(values, level, unit, known ? system->constraints.held : NULL);
        const bool stands = fresh && i > 0 && size > 0.5 * previous;
        if (size <= SOLVED ||
            (stands && residuals_accepted(values, level, unit, &system->constraints, states, false))) {
            return true;
        }
        fresh = !known || size > 0.1 * previous;
        if (fresh && !system_factorize(instance, time, states, inputs, rows_of(level), damping_of(size),
                                       system)) {
            return false;
        }
        *factorized = rows_of(level);
        correct_states(values, level, system, states);
        residuals_evaluate(instance, time, states, inputs, values);
        *moved = true;
        previous = size;
    }
    if (residuals_accepted(values, level, unit, &system->constraints, states, true)) {
        return true;
    }
    report_constraints(instance, time, values, level);
    instance->failure.imported = !instance->policy->integrate;
    return false;
}

/* Moves states[2n] onto the constraints, their positions only where that is wanted. */
static bool move_onto(Instance *instance, bool positions, double time, const double inputs[], double states[],
                    bool *moved) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Values, values);
    int factorized = 0;
    *moved = false;
    if (instance->state.rows_known && instance->state.rows.rank == 0) {
        return arena_leave(mark, true); /* in the present modes nothing holds */
    }
    residuals_evaluate(instance, time, states, inputs, values);
    return arena_leave(
        mark,
        (!positions || project_to(instance, POSITIONS, time, inputs, states, values, &factorized, moved)) &&
            project_to(instance, VELOCITIES, time, inputs, states, values, &factorized, moved));
}

bool constraints_project(Instance *instance, double time, const double inputs[], double states[], bool *moved) {
    return move_onto(instance, N_HOLONOMIC > 0, time, inputs, states, moved);
}

bool constraints_project_velocities(Instance *instance, double states[], bool *moved) {
    return move_onto(instance, false, instance->state.time, instance->state.inputs, states, moved);
}
