#include "settling.h"

#include <math.h>
#include <string.h>

#include "constraints.h"
#include "contact_events.h"
#include "failure.h"
#include "inputs.h"
#include "mass_matrix.h"
#include "scale.h"
#include "settings.h"
#include "system.h"

bool settling_fail(Instance *instance) {
    const size_t refused = instance->arena->refused;
    const FailureKind kind = refused > 0 ? FAILURE_MEMORY : FAILURE_MODES;
    return report_amount(instance, kind, instance->state.time, (double)refused);
}

double settling_least_speed(const Settling *settling, int row) {
    return row_least_speed(&settling->instance->state, &settling->rows, row);
}

double settling_least_rebound(const Settling *settling, int contact) {
    const Instance *instance = settling->instance;
    const double located = instance->policy->integrate ? 0.0 : 100.0 * HYSTERESIS;
    return fmax(solver_tolerance(&instance->state), located) * row_size(&settling->rows, contact);
}

/* A force is more than rounding if it gives its contact a speed that is not as good as 0, in this fraction of the
   experiment (1 / SOON) or in a default solver step if that is shorter. */
static const double SOON = 1000.0;

bool settling_bears(const Settling *settling, int contact, double force) {
    const int k = ROW_PLACES[contact];
    const State *state = &settling->instance->state;
    const double usual = DEFAULT_SOLVER_STEP / states_least_pace(state);
    const double soon = fmin(usual, experiment_duration(state) / SOON);
    return force * settling->delassus[k * K + k] * soon > settling_least_speed(settling, contact);
}

/* Gathers Jacobian, gamma and velocities of all constraints. Rows that modes switch count as active ones. */
static void gather_rows(Settling *settling, const System *system, double gamma[]) {
    memcpy(settling->jacobian, system->constraints.jacobian, sizeof settling->jacobian);
    memcpy(gamma, system->gamma, K * sizeof(double));
    memset(settling->velocity, 0, sizeof settling->velocity);
    for (int k = 0; k < K; k++) {
        settling->permanent[k] = true;
    }
    for (int row = 0; row < N_ROWS; row++) {
        const int k = ROW_PLACES[row];
        memcpy(settling->jacobian + k * N, settling->rows.jacobian + row * N, N * sizeof(double));
        gamma[k] = settling->rows.gamma[row];
        settling->velocity[k] = settling->rows.velocities[row];
        settling->permanent[k] = false;
    }
}

/* The sum of a[i] b[i] for begin <= i < end. */
static double dot(const double a[], const double b[], int begin, int end) {
    double sum = 0.0;
    for (int i = begin; i < end; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* G M^-1 G^T. Each row concerns few coordinates where many bodies touch. */
static void fill_delassus(Settling *settling) {
    for (int k = 0; k < K; k++) {
        const double *row = settling->jacobian + k * N;
        int begin = 0, end = N;
        while (begin < end && row[begin] == 0.0) {
            begin++;
        }
        while (end > begin && row[end - 1] == 0.0) {
            end--;
        }
        for (int j = 0; j <= k; j++) {
            const double entry = dot(row, settling->response + j * N, begin, end);
            settling->delassus[k * K + j] = entry;
            settling->delassus[j * K + k] = entry;
        }
    }
}

bool settling_meets(const Settling *settling, int contact) {
    return settling->due[2 * contact] ||
           settling->rows.positions[contact] <= AT_REST * row_size(&settling->rows, contact);
}

/* The coefficients of the contacts at this point, if the laws of contact have a meaning for them. Those that change
   have none far from their contact, and one of restitution none where nothing approaches: "1 + y_dot/v" is more than 1
   behind an impact. */
static bool find_coefficients(Settling *settling) {
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    const double *inputs = inputs_at(instance, state->time);
    mechanism_contacts(state->time, state->states, inputs, state->parameters, settling->friction, settling->holding);
    mechanism_restitution(state->time, state->states, inputs, state->parameters, settling->restitution);
    for (int i = 0; i < N_UNILATERALS; i++) {
        const double restitution = settling->restitution[i], friction = settling->friction[i];
        settling->friction[i] = fmax(friction, 0.0);
        if ((CHANGING_FRICTION || CHANGING_RESTITUTION) && !contact_closed(state, i) && !settling_meets(settling, i)) {
            continue;
        }
        const bool acts = !CHANGING_RESTITUTION || settling->rows.velocities[i] < -settling_least_speed(settling, i);
        settling->restitution[i] = fmax(fmin(restitution, 1.0), 0.0);
        if (acts && !coefficient_returns(restitution)) {
            return report_constraint(instance, FAILURE_RESTITUTION, state->time, ROW_PLACES[i], restitution);
        }
        if (!coefficient_rubs(friction)) {
            return report_constraint(instance, FAILURE_FRICTION, state->time, ROW_PLACES[i], friction);
        }
    }
    return true;
}

bool settling_measure(Settling *settling) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, gamma, K);
    WORK(mark, double, acceleration, N);
    Instance *instance = settling->instance;
    const State *state = &instance->state;
    System *system = &instance->scratch.system;
    const double *inputs = inputs_at(instance, state->time);
    if (!system_factorize(instance, state->time, state->states, inputs, 0, 0.0, system)) {
        return arena_leave(mark, false);
    }
    rows_evaluate(instance, state->time, state->states, inputs, &settling->rows);
    if (!find_coefficients(settling)) {
        return arena_leave(mark, false);
    }
    gather_rows(settling, system, gamma);
    mass_divide(system, system->forcing, acceleration);
    for (int k = 0; k < K; k++) {
        mass_divide(system, settling->jacobian + k * N, settling->response + k * N);
        settling->free[k] = gamma[k] + dot(settling->jacobian + k * N, acceleration, 0, N);
    }
    fill_delassus(settling);
    return arena_leave(mark, true);
}

bool settling_find_states(Settling *settling, double states[]) {
    Instance *instance = settling->instance;
    State *state = &instance->state;
    bool moved;
    state->usual_known = 0;
    memcpy(states, state->states, sizeof state->states);
    if (!constraints_regroup(instance) ||
        !constraints_project(instance, state->time, inputs_at(instance, state->time), states, &moved)) {
        return false;
    }
    const double dust = SOLVED * states_pace(state);
    for (int i = 0; i < N; i++) {
        if (fabs(states[N + i]) <= dust * NOMINAL_STATES[i]) {
            states[N + i] = 0.0;
        }
    }
    return true;
}

void settling_take(Settling *settling, const double states[], bool *jumped) {
    State *state = &settling->instance->state;
    *jumped = *jumped || memcmp(states, state->states, sizeof state->states) != 0;
    memcpy(state->states, states, sizeof state->states);
}

bool settling_move(Settling *settling, bool *jumped) {
    const ArenaMark mark = arena_mark(settling->instance->arena);
    WORK(mark, double, states, N_STATES);
    if (!settling_find_states(settling, states)) {
        return arena_leave(mark, false);
    }
    settling_take(settling, states, jumped);
    return arena_leave(mark, true);
}

double settling_slip_located(const Settling *settling, int row, int function) {
    const State *state = &settling->instance->state;
    const double velocity = settling->velocity[ROW_PLACES[row]], direction = row_direction(state, row);
    return fabs(velocity) <= state->event_rests[N_SWITCHES + function] && direction != 0.0
               ? direction * fabs(velocity)
               : velocity;
}

double settling_last_step(const Instance *instance) {
    const State *state = &instance->state;
    const double *ends = state->step_ends;
    return instance->policy->integrate ? 0.0 : state->time > ends[0] ? state->time - ends[0] : ends[0] - ends[1];
}

double settling_slip_speed(const Settling *settling, int contact) {
    double speed = 0.0;
    for (int row = SLIP_ROWS[contact]; row < SLIP_ROWS[contact + 1]; row++) {
        speed = hypot(speed, settling->velocity[ROW_PLACES[row]]);
    }
    return speed;
}

double settling_slip_velocity(const Settling *settling, int contact, int row) {
    return contact_slips(contact) == 2 ? settling->velocity[ROW_PLACES[row]]
                                       : settling_slip_located(settling, row, 2 * contact + 1);
}
