/* Rows that slide bear forces that depend on what other rows bear: z = s(unknowns), where the unknowns answer z by
   the system of the rows that are constraints. Newton's method; for Coulomb's law s is linear, and one step is exact.
   Pfeiffer, Glocker, Multibody Dynamics with Unilateral Contacts, 1996, section 5.3 (sliding contacts). */
#include <math.h>
#include <string.h>

#include "contacts.h"
#include "lu.h"
#include "scale.h"
#include "sliding_rows.h"

/* Bound of the Newton steps; one is exact where friction is linear in the loads. */
enum { MOST_CORRECTIONS_OF_SLIDING = 40 };

bool contacts_sliding(const Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, rows, SIZE_FRICTIONAL);
    return arena_leave(mark, N_FRICTIONAL > 0 && sliding_find(&instance->state, rows) > 0);
}

/* The slope of z - s, factorised. */
typedef struct {
    double matrix[SIZE_FRICTIONAL * SIZE_FRICTIONAL];
    int order[SIZE_FRICTIONAL];
} Slope;

static bool factorize_sliding(const Instance *instance, double time, const double states[], const double inputs[],
                      const double unknowns[], const Sliding *sliding, Slope *slope) {
    sliding_slope(instance, time, states, inputs, unknowns, sliding, slope->matrix);
    return lu_factorize(slope->matrix, slope->order, sliding->count);
}

/* Adds the forces z[count] to the unknowns. */
static void add_forces(const Sliding *sliding, const double z[], double unknowns[]) {
    for (int k = 0; k < sliding->count; k++) {
        for (int i = 0; i < N_UNKNOWNS; i++) {
            unknowns[i] += z[k] * sliding->answer[k][i];
        }
    }
}

/* rest[count] = z - s(unknowns); returns the largest entry relative to the forces, of which z may be 0 at first. */
static double residual(const Instance *instance, double time, const double states[], const double inputs[],
                       const double unknowns[], const Sliding *sliding, double rest[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, s, SIZE_FRICTIONAL);
    WORK(mark, double, force, SIZE_FRICTIONS);
    WORK(mark, double, holding, SIZE_FRICTIONS);
    double largest = 0.0, scale = 0.0;
    mechanism_friction(time, states, inputs, instance->state.parameters, unknowns, s, force, holding);
    for (int k = 0; k < sliding->count; k++) {
        const double z = unknowns[N + ROW_PLACES[sliding->row[k]]];
        rest[k] = z - s[sliding->row[k] - FIRST_SLIP];
        largest = fmax(largest, fabs(rest[k]));
        scale = fmax(scale, fmax(fabs(z), fabs(z - rest[k])));
    }
    arena_release(mark);
    return scale > 0.0 ? largest / scale : largest;
}

static bool report_sliding(Instance *instance, double time) {
    instance->failure.kind = FAILURE_SLIDING;
    instance->failure.time = time;
    return false;
}

/* Accelerations that are rounding errors of forces in equilibrium become 0, so that a body at rest does not creep. Each
   row bears a rounding error of the greatest load of all, in units of the scaled rows: also where it bears nothing. */
static void remove_dust(const System *system, const Sliding *sliding, double unknowns[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK_ZEROS(mark, double, greatest, N);
    const ConstraintFactorization *constraints = &system->constraints;
    double load = 0.0;
    for (int k = 0; k < constraints->rows; k++) {
        load = constraints->scale[k] > 0.0 ? fmax(load, fabs(unknowns[N + k]) / constraints->scale[k]) : load;
    }
    for (int k = 0; k < constraints->rows; k++) {
        for (int i = row_begin(constraints, k); i < row_end(constraints, k); i++) {
            greatest[i] = fmax(greatest[i], load * constraints->scale[k] * fabs(constraints->response[k * N + i]));
        }
    }
    for (int k = 0; k < sliding->count; k++) {
        const double force = unknowns[N + ROW_PLACES[sliding->row[k]]];
        for (int i = 0; i < N; i++) {
            greatest[i] = fmax(greatest[i], fabs(force * sliding->answer[k][i]));
        }
    }
    for (int i = 0; i < N; i++) {
        unknowns[i] = fabs(unknowns[i]) <= NOISE * greatest[i] ? 0.0 : unknowns[i];
    }
    arena_release(mark);
}

/* Begins with friction against the slips. Where friction looks ahead, z = s has other solutions, in which the slip that
   is left goes along with the friction; they are far from these forces. */
static void begin_forces(const Instance *instance, double time, const double states[], const double inputs[],
                         const Sliding *sliding, double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, parameters, SIZE_PARAMETERS);
    WORK_ZEROS(mark, double, s, SIZE_FRICTIONAL);
    WORK(mark, double, z, SIZE_FRICTIONAL);
    WORK(mark, double, force, SIZE_FRICTIONS);
    WORK(mark, double, holding, SIZE_FRICTIONS);
    bool looks_ahead = false;
    for (int i = FIRST_OUTLOOK; i < N_MASKS; i++) {
        looks_ahead = looks_ahead || instance->state.parameters[i] > 0.0;
    }
    if (looks_ahead) {
        memcpy(parameters, instance->state.parameters, sizeof instance->state.parameters);
        memset(parameters + FIRST_OUTLOOK, 0, (N_MASKS - FIRST_OUTLOOK) * sizeof *parameters);
        mechanism_friction(time, states, inputs, parameters, unknowns, s, force, holding);
        for (int k = 0; k < sliding->count; k++) {
            z[k] = s[sliding->row[k] - FIRST_SLIP] - unknowns[N + ROW_PLACES[sliding->row[k]]];
        }
        add_forces(sliding, z, unknowns);
    }
    arena_release(mark);
}

/* Solves z = s for the forces of the rows that slide. */
static bool find_forces(Instance *instance, double time, const double states[], const double inputs[],
                        const Sliding *sliding, double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Slope, slope);
    WORK(mark, double, rest, SIZE_FRICTIONAL);
    WORK(mark, double, step, SIZE_FRICTIONAL);
    double previous = HUGE_VAL;
    begin_forces(instance, time, states, inputs, sliding, unknowns);
    for (int i = 0; i < MOST_CORRECTIONS_OF_SLIDING; i++) {
        const double size = residual(instance, time, states, inputs, unknowns, sliding, rest);
        if (size <= NOISE || (i > 2 && size <= MET && size > 0.5 * previous)) {
            return arena_leave(mark, true);
        }
        if (!factorize_sliding(instance, time, states, inputs, unknowns, sliding, slope)) {
            return arena_leave(mark, report_sliding(instance, time));
        }
        previous = size;
        lu_solve(slope->matrix, slope->order, sliding->count, rest, step);
        for (int k = 0; k < sliding->count; k++) {
            step[k] = -step[k];
        }
        add_forces(sliding, step, unknowns);
    }
    return arena_leave(mark, report_sliding(instance, time));
}

bool contacts_slide(Instance *instance, const System *system, double time, const double states[],
                    const double inputs[], double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Sliding, sliding);
    sliding_evaluate(instance, system, time, states, inputs, sliding);
    if (sliding->count > 0) {
        sliding_share(instance, system, unknowns);
    }
    if (sliding->count > 0 && !find_forces(instance, time, states, inputs, sliding, unknowns)) {
        return arena_leave(mark, false);
    }
    remove_dust(system, sliding, unknowns);
    return arena_leave(mark, true);
}

/* Adds to the answer the forces z of z = s whose part with constant z is the change[N_FRICTIONAL] of s. */
static void add_answers(Arena *arena, const Sliding *sliding, const Slope *slope, const double change[],
                        double answer[]) {
    const ArenaMark mark = arena_mark(arena);
    WORK_ZEROS(mark, double, rest, SIZE_FRICTIONAL);
    WORK(mark, double, z, SIZE_FRICTIONAL);
    for (int k = 0; k < sliding->count; k++) {
        rest[k] = change[sliding->row[k] - FIRST_SLIP];
    }
    lu_solve(slope->matrix, slope->order, sliding->count, rest, z);
    add_forces(sliding, z, answer);
    arena_release(mark);
}

void contacts_answer(Instance *instance, const System *system, double time, const double states[],
                     const double inputs[], const double unknowns[], const Seed *seed, double answer[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Sliding, sliding);
    WORK_OF(mark, Slope, slope);
    WORK_ZEROS(mark, double, change, SIZE_FRICTIONAL);
    sliding_evaluate(instance, system, time, states, inputs, sliding);
    if (sliding->count > 0 && factorize_sliding(instance, time, states, inputs, unknowns, sliding, slope)) {
        sliding_share(instance, system, answer);
        sliding_change(instance, time, states, inputs, unknowns, seed, answer, change);
        add_answers(instance->arena, sliding, slope, change, answer);
    }
    arena_release(mark);
}

void contacts_answer_twice(Instance *instance, const System *system, const double du[], const double d2u[],
                           const double rates[], double answer[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Sliding, sliding);
    WORK_OF(mark, Slope, slope);
    WORK_ZEROS(mark, double, change, SIZE_FRICTIONAL);
    const State *state = &instance->state;
    const double *unknowns = instance->cache.reported;
    sliding_evaluate(instance, system, state->time, state->states, state->inputs, sliding);
    if (sliding->count > 0 &&
        factorize_sliding(instance, state->time, state->states, state->inputs, unknowns, sliding, slope)) {
        mechanism_friction_second(state->time, state->states, state->inputs, state->parameters, unknowns, du, d2u,
                                  rates, answer, change);
        add_answers(instance->arena, sliding, slope, change, answer);
    }
    arena_release(mark);
}
