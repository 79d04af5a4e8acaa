/* Rows that slide bear forces that depend on what other rows bear: z = s(unknowns), where the unknowns answer z by
   the system of the rows that are constraints. Newton's method; for Coulomb's law s is linear, and one step is exact.
   Pfeiffer, Glocker, Multibody Dynamics with Unilateral Contacts, 1996, section 5.3 (sliding contacts). */
#include <math.h>
#include <string.h>

#include "element_rows.h"
#include "contacts.h"
#include "lu.h"
#include "system.h"

enum { N = N_COORDINATES, MOST_CORRECTIONS = 40 };

/* Relative to the largest force, as good as nothing. */
static const double ROUNDING = 4e-16;

/* An acceleration below this part of what the forces of rows make is rounding error. */
static const double DUST = 4e-15;

/* The rows that slide, and how the unknowns answer a unit force along each. */
typedef struct {
    int count;
    int row[SIZE_FRICTIONAL];
    double answer[SIZE_FRICTIONAL][N_UNKNOWNS];
    double slope[SIZE_FRICTIONAL * SIZE_FRICTIONAL]; /* of z - s(unknowns), factorised */
    int order[SIZE_FRICTIONAL];
} Sliding;

/* Both rows of a contact in space slide if one of them has a direction. */
static bool slides(const State *state, int row) {
    bool found = row_direction(state, row) != 0.0;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (row >= SLIP_ROWS[i] && row < SLIP_ROWS[i + 1]) {
            for (int k = SLIP_ROWS[i]; k < SLIP_ROWS[i + 1]; k++) {
                found = found || row_direction(state, k) != 0.0;
            }
        }
    }
    return found;
}

static int find_sliding(const State *state, int rows[]) {
    int count = 0;
    for (int row = FIRST_SLIP; row < FIRST_LATCH; row++) {
        if (slides(state, row)) {
            rows[count++] = row;
        }
    }
    return count;
}

bool contacts_sliding(const Instance *instance) {
    int rows[SIZE_FRICTIONAL];
    return N_FRICTIONAL > 0 && find_sliding(&instance->state, rows) > 0;
}

static void find_answers(Instance *instance, const System *system, double time, const double states[],
                         const double inputs[], Sliding *sliding) {
    static const double NOTHING[N_CONSTRAINTS];
    ElementRows rows;
    rows_evaluate(instance, time, states, inputs, &rows);
    sliding->count = find_sliding(&instance->state, sliding->row);
    for (int k = 0; k < sliding->count; k++) {
        const int row = sliding->row[k];
        system_solve(system, rows.jacobian + row * N, NOTHING, NULL, sliding->answer[k]);
        sliding->answer[k][N + ROW_PLACES[row]] = 1.0;
    }
}

/* ds/dunknowns along a direction of the unknowns, and along a seed. */
static void change_of_forces(const Instance *instance, double time, const double states[], const double inputs[],
                             const double unknowns[], const Seed *seed, const double along[], double change[]) {
    mechanism_friction_tangent(time, states, inputs, instance->state.parameters, unknowns, seed->time, seed->states,
                               seed->inputs, seed->parameters, along, change);
}

/* Factorises the slope of z - s. */
static bool factorize(const Instance *instance, double time, const double states[], const double inputs[],
                      const double unknowns[], Sliding *sliding) {
    const Seed still = {0};
    double change[SIZE_FRICTIONAL];
    const int count = sliding->count;
    for (int k = 0; k < count; k++) {
        change_of_forces(instance, time, states, inputs, unknowns, &still, sliding->answer[k], change);
        for (int i = 0; i < count; i++) {
            sliding->slope[i * count + k] = (i == k ? 1.0 : 0.0) - change[sliding->row[i] - FIRST_SLIP];
        }
    }
    return lu_factorize(sliding->slope, sliding->order, count);
}

/* Adds the forces z[count] to the unknowns. */
static void add_forces(const Sliding *sliding, const double z[], double unknowns[]) {
    for (int k = 0; k < sliding->count; k++) {
        for (int i = 0; i < N_UNKNOWNS; i++) {
            unknowns[i] += z[k] * sliding->answer[k][i];
        }
    }
}

/* rest[count] = z - s(unknowns); returns the largest entry relative to the forces. */
static double residual(const Instance *instance, double time, const double states[], const double inputs[],
                       const double unknowns[], const Sliding *sliding, double rest[]) {
    double s[SIZE_FRICTIONAL], force[SIZE_FRICTIONS], holding[SIZE_FRICTIONS];
    double largest = 0.0, scale = 0.0;
    mechanism_friction(time, states, inputs, instance->state.parameters, unknowns, s, force, holding);
    for (int k = 0; k < sliding->count; k++) {
        const double z = unknowns[N + ROW_PLACES[sliding->row[k]]];
        rest[k] = z - s[sliding->row[k] - FIRST_SLIP];
        largest = fmax(largest, fabs(rest[k]));
        scale = fmax(scale, fabs(z));
    }
    return scale > 0.0 ? largest / scale : largest;
}

static bool report(Instance *instance, double time) {
    instance->failure.kind = FAILURE_SLIDING;
    instance->failure.time = time;
    return false;
}

/* Accelerations that are the rounding error of forces in equilibrium are 0: what rests does not begin to creep. */
static void remove_dust(const System *system, const Sliding *sliding, double unknowns[]) {
    const ConstraintFactorization *constraints = &system->constraints;
    for (int i = 0; i < N; i++) {
        double greatest = 0.0;
        for (int k = 0; k < constraints->rows; k++) {
            greatest = fmax(greatest, fabs(unknowns[N + k] * constraints->response[k * N + i]));
        }
        for (int k = 0; k < sliding->count; k++) {
            const double force = unknowns[N + ROW_PLACES[sliding->row[k]]];
            greatest = fmax(greatest, fabs(force * sliding->answer[k][i]));
        }
        unknowns[i] = fabs(unknowns[i]) <= DUST * greatest ? 0.0 : unknowns[i];
    }
}

/* Solves z = s for the forces of the rows that slide. */
static bool find_forces(Instance *instance, double time, const double states[], const double inputs[],
                        Sliding *sliding, double unknowns[]) {
    double rest[SIZE_FRICTIONAL], step[SIZE_FRICTIONAL];
    double previous = HUGE_VAL;
    for (int i = 0; i < MOST_CORRECTIONS; i++) {
        const double size = residual(instance, time, states, inputs, unknowns, sliding, rest);
        if (size <= ROUNDING || (i > 2 && size <= 1e-12 && size > 0.5 * previous)) {
            return true;
        }
        if (!factorize(instance, time, states, inputs, unknowns, sliding)) {
            return report(instance, time);
        }
        previous = size;
        lu_solve(sliding->slope, sliding->order, sliding->count, rest, step);
        for (int k = 0; k < sliding->count; k++) {
            step[k] = -step[k];
        }
        add_forces(sliding, step, unknowns);
    }
    return report(instance, time);
}

bool contacts_slide(Instance *instance, const System *system, double time, const double states[],
                    const double inputs[], double unknowns[]) {
    Sliding sliding;
    find_answers(instance, system, time, states, inputs, &sliding);
    if (sliding.count > 0 && !find_forces(instance, time, states, inputs, &sliding, unknowns)) {
        return false;
    }
    remove_dust(system, &sliding, unknowns);
    return true;
}

void contacts_answer(Instance *instance, const System *system, double time, const double states[],
                     const double inputs[], const double unknowns[], const Seed *seed, double answer[]) {
    Sliding sliding;
    double change[SIZE_FRICTIONAL], rest[SIZE_FRICTIONAL], z[SIZE_FRICTIONAL];
    find_answers(instance, system, time, states, inputs, &sliding);
    if (sliding.count == 0 || !factorize(instance, time, states, inputs, unknowns, &sliding)) {
        return;
    }
    change_of_forces(instance, time, states, inputs, unknowns, seed, answer, change);
    for (int k = 0; k < sliding.count; k++) {
        rest[k] = change[sliding.row[k] - FIRST_SLIP];
    }
    lu_solve(sliding.slope, sliding.order, sliding.count, rest, z);
    add_forces(&sliding, z, answer);
}
