#include "step_points.h"

#include <string.h>

#include "accelerations.h"
#include "collocation.h"
#include "contacts.h"
#include "inputs.h"
#include "jacobian.h"
#include "lu.h"
#include "rubbing.h"
#include "step_failure.h"
#include "system.h"
#include "variational.h"

int step_point_count(void) {
    return 2 + S + (K > 0 ? NODES.count : 0);
}

/* ----------------------------------------------------------------------------------------------------- the points */

/* Where the velocities at its end are among the unknowns, and its balance of momenta among the rows. */
static int end_place(void) {
    return S * R + NODES.count * K;
}

static int momentum_row(int i) {
    return i < S ? i * R : end_place();
}

static int constraint_row(int node) {
    return S * R + (node - 1) * K;
}

/* By how much R at a node adds to the momenta at stage i, or at the end for i = S; at the last node an impulse. */
static double reaction_weight(double h, int i, int node) {
    const bool last = node == NODES.count - 1;
    if (i < S) {
        return last ? 0.0 : h * NODES.hat[i * NODES.count + node];
    }
    return last ? 1.0 : h * NODES.b[node];
}

static void place_point(const Instance *instance, Step step, StepPoint *point, const double weights[]) {
    const Stages *stages = &instance->scratch.solver;
    memcpy(point->states, instance->state.states, sizeof point->states);
    memset(point->states + N, 0, N * sizeof(double));
    for (int j = 0; j < S; j++) {
        point->weights[j] = step.length * weights[j];
        for (int k = 0; k < N; k++) {
            point->states[k] += point->weights[j] * stages->velocities[j][k];
        }
        for (int k = 0; k < N_FURTHER; k++) {
            point->states[2 * N + k] += point->weights[j] * stages->rates[j][k];
        }
    }
}

StepPoint step_point(const Instance *instance, Step step, int i) {
    const Stages *stages = &instance->scratch.solver;
    const int stage = i - 1, node = i - 1 - S;
    StepPoint point = {.kind = POINT_START, .place = 0, .time = instance->state.time, .length = step.length};
    if (i == 0) {
        memcpy(point.states, instance->state.states, sizeof point.states);
    } else if (stage < S) {
        point.kind = POINT_STAGE;
        point.place = stage;
        point.time = time_within(instance, step, COLLOCATION.c[stage]);
        place_point(instance, step, &point, COLLOCATION.a + stage * S);
        stage_states(stages, stage, point.states);
    } else if (i < step_point_count() - 1) {
        point.kind = POINT_NODE;
        point.place = node;
        point.time = time_within(instance, step, NODES.c[node]);
        place_point(instance, step, &point, NODES.a + node * S);
        memcpy(point.multipliers, stages->multipliers[node], K * sizeof(double));
    } else {
        point.kind = POINT_END;
        point.time = step.end;
        place_point(instance, step, &point, COLLOCATION.b);
        memcpy(point.states, instance->scratch.new_states, sizeof point.states);
    }
    return point;
}

/* -------------------------------------------------------------------------------------------------- their couplings */

/* rows[k] += factor own[k] from first to end, or that backwards. */
static void couple(bool back, double rows[], double own[], double factor, int first, int end) {
    for (int k = first; k < end; k++) {
        if (back) {
            own[k] += factor * rows[k];
        } else {
            rows[k] += factor * own[k];
        }
    }
}

static void couple_stage(const StepPoint *point, Balance *balance, double rows[], bool back) {
    const int stage = point->place;
    couple(back, rows + momentum_row(stage), balance->momenta, 1.0, 0, N);
    for (int i = 0; i <= S; i++) {
        const double weight = i < S ? COLLOCATION.hat[i * S + stage] : COLLOCATION.b[stage];
        couple(back, rows + momentum_row(i), balance->forces, -point->length * weight, 0, N);
    }
    couple(back, rows + stage * R + N, balance->rates, -1.0, 0, N_FURTHER);
    for (int l = 1; l < NODES.count && K > N_HOLONOMIC; l++) { /* integrals of nonholonomic constraints */
        const double weight = point->length * NODES.a[l * S + stage];
        couple(back, rows + constraint_row(l), balance->velocities, weight, N_HOLONOMIC, K);
    }
}

void step_couple(const StepPoint *point, Balance *balance, double rows[], bool back) {
    switch (point->kind) {
    case POINT_START:
        for (int i = 0; i <= S; i++) {
            couple(back, rows + momentum_row(i), balance->momenta, -1.0, 0, N);
        }
        break;
    case POINT_STAGE: couple_stage(point, balance, rows, back); break;
    case POINT_NODE:
        for (int i = 0; i <= S; i++) {
            const double weight = reaction_weight(point->length, i, point->place);
            couple(back, rows + momentum_row(i), balance->reactions, -weight, 0, N);
        }
        if (point->place > 0) {
            couple(back, rows + constraint_row(point->place), balance->positions, 1.0, 0, N_HOLONOMIC);
        }
        break;
    case POINT_END:
        couple(back, rows + momentum_row(S), balance->momenta, 1.0, 0, N);
        couple(back, rows + constraint_row(NODES.count), balance->velocities, 1.0, 0, K);
        break;
    }
}

void step_tangent(Instance *instance, const StepPoint *point, const Seed *seed, Balance *balance) {
    mechanism_balance_tangent(point->time, point->states, inputs_at(instance, point->time), instance->state.parameters,
                              point->multipliers, seed->time, seed->states, seed->inputs, seed->parameters,
                              balance->momenta, balance->forces, balance->reactions, balance->positions,
                              balance->velocities);
}

bool step_unknowns(Instance *instance, const StepPoint *stage, double unknowns[]) {
    const double *inputs = inputs_at(instance, stage->time);
    return accelerations_at(instance, stage->time, stage->states, inputs, unknowns) &&
           system_factorize(instance, stage->time, stage->states, inputs, N_CONSTRAINTS, 0.0,
                            &instance->scratch.system);
}

void step_rub(Instance *instance, const StepPoint *stage, const double unknowns[], const Seed *seed, double change[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, residuals, N_RESIDUALS);
    WORK(mark, double, answer, N_UNKNOWNS);
    const System *system = &instance->scratch.system;
    const double *inputs = inputs_at(instance, stage->time);
    mechanism_residual_tangent(stage->time, stage->states, inputs, instance->state.parameters, unknowns, seed->time,
                               seed->states, seed->inputs, seed->parameters, residuals);
    system_answer(system, residuals, answer);
    contacts_answer(instance, system, stage->time, stage->states, inputs, unknowns, seed, answer);
    rubbing_tangent(instance, stage->time, stage->states, inputs, unknowns, seed, answer, change);
    arena_release(mark);
}

void step_seed(const StepPoint *point, const double before[], double states[]) {
    memcpy(states, before, N_STATES * sizeof(double));
    if (point->kind != POINT_START) {
        memset(states + N, 0, N * sizeof(double));
    }
}

/* ------------------------------------------------------------------------------------------------------- the matrix */

static void add_to_matrix(DirectedMemory *method, bool transposed, int row, int column, double value) {
    method->matrix[transposed ? column * SIZE_OF_STEP + row : row * SIZE_OF_STEP + column] += value;
}

/* The derivatives of G by the multipliers at a node, along a coordinate: R = G^T mu, where G is v by velocities. */
static void add_multipliers(DirectedMemory *method, const StepPoint *node, int coordinate, const double jacobian[],
                            bool transposed) {
    for (int i = 0; i <= S; i++) {
        const double weight = reaction_weight(node->length, i, node->place);
        for (int k = 0; k < K; k++) {
            const int column = S * R + node->place * K + k;
            add_to_matrix(method, transposed, momentum_row(i) + coordinate, column, -weight * jacobian[k]);
        }
    }
}

/* The derivatives of G by the unknowns that move a state at a point are those by that state, in method->right. */
static void add_state_column(DirectedMemory *method, const StepPoint *point, int state, bool transposed) {
    const bool velocity = state >= N && state < 2 * N;
    const int own = point->kind == POINT_STAGE ? point->place * R : end_place();
    for (int row = 0; row < SIZE_OF_STEP; row++) {
        const double value = method->right[row];
        if (value != 0.0 && velocity) {
            add_to_matrix(method, transposed, row, own + state - N, value);
        }
        for (int j = 0; j < S && value != 0.0 && !velocity; j++) {
            add_to_matrix(method, transposed, row, j * R + (state < N ? state : state - N), point->weights[j] * value);
        }
    }
}

static bool add_point(Variations *variations, const StepPoint *point, bool transposed) {
    Instance *instance = &variations->study.instance;
    DirectedMemory *method = &variations->method;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Seed, seed);
    WORK_OF(mark, Balance, balance);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    const bool stage = point->kind == POINT_STAGE;
    const bool rubs = stage && contacts_sliding(instance);
    memset(seed, 0, sizeof *seed);
    memset(balance, 0, sizeof *balance);
    if (stage && N_FURTHER > 0 && !equations_jacobian(instance, point->time, point->states, method->jacobian)) {
        return arena_leave(mark, false);
    }
    if (rubs && !step_unknowns(instance, point, unknowns)) {
        return arena_leave(mark, false);
    }
    for (int state = 0; state < N_STATES; state++) {
        seed->states[state] = 1.0;
        step_tangent(instance, point, seed, balance);
        if (rubs) {
            step_rub(instance, point, unknowns, seed, balance->forces);
        }
        seed->states[state] = 0.0;
        if (stage) {
            memcpy(balance->rates, method->jacobian + state * R + N, N_FURTHER * sizeof(double));
        }
        if (point->kind == POINT_NODE && state >= N && state < 2 * N) {
            add_multipliers(method, point, state - N, balance->velocities, transposed);
            continue;
        }
        memset(method->right, 0, sizeof method->right);
        step_couple(point, balance, method->right, false);
        add_state_column(method, point, state, transposed);
    }
    return arena_leave(mark, true);
}

/* Redundant constraints are left out with their multipliers, as the step itself leaves them out: their rows and
   columns, which have the same places, become those of the unit matrix. */
static bool leave_redundant_out(Variations *variations, double time) {
    Instance *instance = &variations->study.instance;
    System *system = &instance->scratch.system;
    double *matrix = variations->method.matrix;
    if (K == 0) {
        return true;
    }
    if (!system_factorize(instance, time, instance->state.states, inputs_at(instance, time), K, 0.0, system)) {
        return false;
    }
    for (int l = system->constraints.rank; l < K; l++) {
        for (int node = 0; node < NODES.count; node++) {
            const int place = S * R + node * K + system->constraints.order[l];
            for (int i = 0; i < SIZE_OF_STEP; i++) {
                matrix[place * SIZE_OF_STEP + i] = matrix[i * SIZE_OF_STEP + place] = i == place ? 1.0 : 0.0;
            }
        }
    }
    return true;
}

bool step_linearize(Variations *variations, Step step, bool transposed) {
    Instance *instance = &variations->study.instance;
    DirectedMemory *method = &variations->method;
    memset(method->matrix, 0, sizeof method->matrix);
    for (int i = 0; i < S; i++) {
        for (int k = N; k < R; k++) {
            add_to_matrix(method, transposed, i * R + k, i * R + k, 1.0);
        }
    }
    for (int i = 1; i < step_point_count(); i++) { /* the start depends on no unknown */
        const StepPoint point = step_point(instance, step, i);
        if (!add_point(variations, &point, transposed)) {
            return false;
        }
    }
    for (int i = end_place() + N; i < SIZE_OF_STEP; i++) { /* where nodes are stages there are fewer unknowns */
        add_to_matrix(method, transposed, i, i, 1.0);
    }
    return leave_redundant_out(variations, instance->state.time) &&
           (lu_factorize(method->matrix, method->rows, SIZE_OF_STEP) || report_iteration(instance, step));
}
