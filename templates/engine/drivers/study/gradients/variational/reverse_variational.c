/* Steps of a variational method backwards. For x+ = X(x, w) with G(x, w, p) = 0 (step_points.h), and a dash for the
   derivative by what is in front of it,

       G_w^T y = -X_w^T x+',   x' = X_x^T x+' + G_x^T y,   p' += G_p^T y. */
#include <string.h>

#include "collocation.h"
#include "contacts.h"
#include "derivative.h"
#include "inputs.h"
#include "lu.h"
#include "seeds.h"
#include "step_points.h"
#include "tape.h"

void tape_begin_method(Tape *tape) {
    tape->method.none = 0;
}

/* Adds the derivatives by the states at a point to those before the step. */
static void add_states(const StepPoint *point, const double found[], double before[]) {
    for (int k = 0; k < N_STATES; k++) {
        const bool velocity = k >= N && k < 2 * N;
        before[k] += velocity && point->kind != POINT_START ? 0.0 : found[k];
    }
}

/* Further rates and what slides at a stage backwards. */
static bool rates_back(Tape *tape, const StepPoint *point, const Balance *weights, double before[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, slope, N_STATES);
    WORK_ZEROS(mark, double, of_slope, N_STATES);
    WORK_ZEROS(mark, double, found, N_STATES);
    memcpy(of_slope + 2 * N, weights->rates, N_FURTHER * sizeof(double));
    if (!derivative_at(instance, point->time, point->states, slope) ||
        !tape_slope_back(tape, point->time, point->states, slope, of_slope,
                         contacts_sliding(instance) ? weights->forces : NULL, found)) {
        return arena_leave(mark, false);
    }
    add_states(point, found, before);
    return arena_leave(mark, true);
}

static bool point_back(Tape *tape, const StepPoint *point, double before[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Balance, weights);
    WORK_OF(mark, Seed, found);
    memset(weights, 0, sizeof *weights);
    memset(found, 0, sizeof *found);
    step_couple(point, weights, tape->variations->method.change, true);
    mechanism_balance_adjoint(point->time, point->states, inputs_at(instance, point->time), instance->state.parameters,
                              point->multipliers, weights->momenta, weights->forces, weights->reactions,
                              weights->positions, weights->velocities, &found->time, found->states, found->inputs,
                              found->parameters);
    add_states(point, found->states, before);
    memset(found->states, 0, sizeof found->states);
    seed_add(&tape->total, found);
    return arena_leave(mark, N_FURTHER == 0 || point->kind != POINT_STAGE || rates_back(tape, point, weights, before));
}

/* right = -X_w^T x+', and then x+' = X_x^T x+'. */
static void end_back(DirectedMemory *method, double h, double total[]) {
    memset(method->right, 0, sizeof method->right);
    for (int k = 0; k < N_STATES; k++) {
        const bool velocity = k >= N && k < 2 * N;
        for (int j = 0; j < S && !velocity; j++) {
            method->right[j * R + (k < N ? k : k - N)] = -h * COLLOCATION.b[j] * total[k];
        }
        if (velocity) {
            method->right[S * R + NODES.count * K + k - N] = -total[k];
            total[k] = 0.0;
        }
    }
}

bool tape_step_back(Tape *tape, const Entry *entry, const Checkpoint *checkpoint) {
    Variations *variations = tape->variations;
    Instance *instance = &variations->study.instance;
    DirectedMemory *method = &variations->method;
    double *total = tape->total.states;
    instance->state.time = entry->time;
    memcpy(instance->state.states, checkpoint->states, sizeof checkpoint->states);
    memcpy(instance->scratch.new_states, checkpoint->end_states, sizeof checkpoint->end_states);
    instance->scratch.solver = checkpoint->record.stages;
    if (!tape_project_back(tape, entry->step.end, checkpoint->unprojected, checkpoint->end_states, total) ||
        !step_linearize(variations, entry->step, true)) {
        return false;
    }
    end_back(method, entry->step.length, total);
    lu_solve(method->matrix, method->rows, SIZE_OF_STEP, method->right, method->change);
    for (int i = 0; i < step_point_count(); i++) {
        const StepPoint point = step_point(instance, entry->step, i);
        if (!point_back(tape, &point, total)) {
            return false;
        }
    }
    return true;
}
