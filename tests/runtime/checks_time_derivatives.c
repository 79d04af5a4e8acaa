/* Inputs that are polynomials in a communication step, and time derivatives of outputs. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "mechanism.h"

enum { ORDERS = 3 };

/* Two cubic torques, N.m, and their derivatives: u(t) = sum c_k t^k / k!. */
static const double TORQUES[2][ORDERS + 1] = {{0.5, -3.0, 8.0, -20.0}, {-0.2, 1.0, 2.0, 9.0}};

/* The derivative of this order of a torque at time t. */
static double torque(int which, int order, double t) {
    double sum = 0.0, term = 1.0;
    for (int k = order; k <= ORDERS; k++) {
        sum += TORQUES[which][k] * term;
        term *= t / (k - order + 1);
    }
    return sum;
}

/* Sets both torques as they are from time t on. */
static void set_torques(fmi2Component c, double t) {
    for (int which = 0; which < 2; which++) {
        const fmi2ValueReference input = which == 0 ? Q_THETA1 : Q_THETA2;
        const fmi2ValueReference references[] = {input, input, input};
        const double rates[] = {torque(which, 1, t), torque(which, 2, t), torque(which, 3, t)};
        CHECK(set(c, input, torque(which, 0, t)) == fmi2OK);
        CHECK(fmi2SetRealInputDerivatives(c, references, ORDERS, (const fmi2Integer[]){1, 2, 3}, rates) == fmi2OK);
    }
}

static fmi2Component start_exactly(Log *log) {
    fmi2Component c = instantiate(fmi2CoSimulation, log);
    CHECK(set(c, SOLVER_TOLERANCE, 1e-12) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    return c;
}

static fmi2Status set_rate(fmi2Component c, fmi2ValueReference reference, int order, double value) {
    return fmi2SetRealInputDerivatives(c, &reference, 1, &order, &value);
}

static double rate(fmi2Component c, fmi2ValueReference reference, int order) {
    double value;
    return fmi2GetRealOutputDerivatives(c, &reference, 1, &order, &value) == fmi2OK ? value : (double)NAN;
}

/* The power of the torques after a step to 1 s, P = sum u w, has the derivatives that the torques have there. */
static void check_power_at_1(fmi2Component c) {
    double first = 0.0, second = 0.0;
    for (int i = 0; i < 2; i++) {
        const double w = get(c, THETA1_DOT + (fmi2ValueReference)i), a = get(c, THETA1_DDOT + (fmi2ValueReference)i);
        const double jerk = rate(c, THETA1_DOT + (fmi2ValueReference)i, 2);
        first += torque(i, 1, 1.0) * w + torque(i, 0, 1.0) * a;
        second += torque(i, 2, 1.0) * w + 2.0 * torque(i, 1, 1.0) * a + torque(i, 0, 1.0) * jerk;
    }
    CHECK(fabs(rate(c, EXTERNAL_POWER, 1) - first) < 1e-12 * (1.0 + fabs(first)));
    CHECK(fabs(rate(c, EXTERNAL_POWER, 2) - second) < 1e-12 * (1.0 + fabs(second)));
}

/* One long step with the polynomial equals many short ones with its expansion at each of them. */
void check_polynomials(void) {
    Log log;
    fmi2Component once = start_exactly(&log), often = start_exactly(&log), held = start_exactly(&log);
    set_torques(once, 0.0);
    CHECK(fmi2DoStep(once, 0.0, 1.0, fmi2True) == fmi2OK);
    for (int i = 0; i < 100; i++) {
        set_torques(often, i / 100.0);
        CHECK(fmi2DoStep(often, i / 100.0, 0.01, fmi2True) == fmi2OK);
    }
    CHECK(set(held, Q_THETA1, TORQUES[0][0]) == fmi2OK && fmi2DoStep(held, 0.0, 1.0, fmi2True) == fmi2OK);
    for (fmi2ValueReference i = THETA1; i <= THETA2_DOT; i++) {
        CHECK(fabs(get(once, i) - get(often, i)) < 1e-9 && fabs(get(once, i) - get(held, i)) > 1e-2);
    }
    CHECK(fabs(get(once, Q_THETA1) - torque(0, 0, 1.0)) < 1e-14 && get(held, Q_THETA1) == TORQUES[0][0]);
    check_power_at_1(once);
    fmi2FreeInstance(once);
    fmi2FreeInstance(often);
    fmi2FreeInstance(held);
}

/* After the step the inputs stay where they are, whatever was set before; reset forgets derivatives that are set. */
void check_polynomials_hold_for_one_step(void) {
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log), fresh = start(fmi2CoSimulation, &log);
    CHECK(set_rate(c, Q_THETA1, 1, 4.0) == fmi2OK && set_rate(c, Q_THETA2, 2, 4.0) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.0, 0.5, fmi2True) == fmi2OK && get(c, Q_THETA1) == 2.0 && get(c, Q_THETA2) == 0.5);
    CHECK(rate(c, EXTERNAL_POWER, 1) == rate(c, EXTERNAL_POWER, 1)); /* reading changes nothing */
    const double moving = rate(c, EXTERNAL_POWER, 1);
    CHECK(set_rate(c, Q_THETA2, 1, 0.0) == fmi2OK); /* the next step is described: the others do not move in it */
    CHECK(fabs(moving - rate(c, EXTERNAL_POWER, 1) - 4.0 * get(c, THETA1_DOT) - 2.0 * get(c, THETA2_DOT)) < 1e-12);
    CHECK(fmi2DoStep(c, 0.5, 0.5, fmi2True) == fmi2OK && get(c, Q_THETA1) == 2.0 && get(c, Q_THETA2) == 0.5);

    CHECK(set_rate(c, Q_THETA1, 1, 4.0) == fmi2OK && fmi2Reset(c) == fmi2OK);
    CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK && same_state(c, fresh));
    fmi2FreeInstance(c);
    fmi2FreeInstance(fresh);
}

/* Derivatives that are set belong to the saved state, and so do those of the end of a step. */
void check_polynomials_in_states(void) {
    fmi2Byte bytes[SNAPSHOT_SIZE];
    fmi2FMUstate saved = NULL;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log), other = start(fmi2CoSimulation, &log);
    set_torques(c, 0.0);
    CHECK(fmi2DoStep(c, 0.0, 0.125, fmi2True) == fmi2OK);
    const double second = rate(c, X_TIP_DDOT, 2);
    for (int set_anew = 0; set_anew < 2; set_anew++) {
        if (set_anew) {
            set_torques(c, 0.125);
        }
        const size_t size = snapshot(c, bytes);
        CHECK(fmi2DeSerializeFMUstate(other, bytes, size, &saved) == fmi2OK && fmi2SetFMUstate(other, saved) == fmi2OK);
        CHECK(set_anew || rate(other, X_TIP_DDOT, 2) == second);
        CHECK(fmi2DoStep(other, 0.125, 0.125, fmi2True) == fmi2OK);
        CHECK(fmi2DoStep(c, 0.125, 0.125, fmi2True) == fmi2OK && same_state(c, other));
        CHECK((fabs(get(c, Q_THETA1) - torque(0, 0, set_anew ? 0.25 : 0.125)) < 1e-14));
        CHECK(fmi2SetFMUstate(c, saved) == fmi2OK && fmi2FreeFMUstate(c, &saved) == fmi2OK);
    }
    fmi2FreeInstance(c);
    fmi2FreeInstance(other);
}

/* Against differences of values at times t - h, t, t + h; both error terms are of order h^2. */
void check_output_derivatives(void) {
    static const fmi2ValueReference OUTPUTS[] = {THETA1, THETA2, THETA1_DOT, THETA2_DOT, THETA1_DDOT,
                                                 P_THETA2, TOTAL_ENERGY, EXTERNAL_POWER, X_TIP_DDOT};
    enum { COUNT = sizeof OUTPUTS / sizeof OUTPUTS[0] };
    const double h = 1.0 / 4096.0;
    double values[3][COUNT], first[COUNT], second[COUNT];
    Log log;
    fmi2Component c = start_exactly(&log);
    for (int i = 0; i < 3; i++) {
        set_torques(c, i == 0 ? 0.0 : 0.25 + (i - 2) * h);
        CHECK(fmi2DoStep(c, get(c, TIME), i == 0 ? 0.25 - h : h, fmi2True) == fmi2OK);
        for (int k = 0; k < COUNT; k++) {
            values[i][k] = get(c, OUTPUTS[k]);
            first[k] = i == 1 ? rate(c, OUTPUTS[k], 1) : first[k];
            second[k] = i == 1 ? rate(c, OUTPUTS[k], 2) : second[k];
        }
    }
    for (int k = 0; k < COUNT; k++) {
        const double slope = (values[2][k] - values[0][k]) / (2.0 * h);
        const double curvature = (values[2][k] - 2.0 * values[1][k] + values[0][k]) / (h * h);
        CHECK(fabs(first[k] - slope) < 1e-4 * (1.0 + fabs(slope)));
        CHECK(fabs(second[k] - curvature) < 1e-4 * (1.0 + fabs(curvature)));
    }
    fmi2FreeInstance(c);
}

void check_time_derivative_refusals(void) {
    static const struct {
        fmi2ValueReference reference;
        int order;
        double value;
        const char *words;
    } INPUTS[] = {
        {Q_THETA1, 0, 1.0, "expected 1 to 3"}, {Q_THETA1, 4, 1.0, "expected 1 to 3"}, {Q_THETA1, -1, 1.0, "is -1"},
        {THETA1, 1, 1.0, "theta1 is not an input"}, {M1, 1, 1.0, "not an input"}, {N_REFERENCES, 1, 1.0, "reference"},
        {Q_THETA2, 2, NAN, "finite"}, {Q_THETA2, 1, HUGE_VAL, "finite"},
    }, OUTPUTS[] = {
        {THETA1, 0, 0.0, "expected 1 to 2"}, {THETA1, 3, 0.0, "expected 1 to 2"}, {Q_THETA1, 1, 0.0, "not an output"},
        {THETA2_DDOT, 1, 0.0, "theta2_ddot is not an output"}, {N_REFERENCES, 1, 0.0, "reference"},
    };
    Log log;
    for (size_t i = 0; i < sizeof INPUTS / sizeof INPUTS[0]; i++) {
        const fmi2ValueReference references[] = {Q_THETA1, INPUTS[i].reference};
        const double values[] = {7.0, INPUTS[i].value};
        fmi2Component c = start(fmi2CoSimulation, &log), fresh = start(fmi2CoSimulation, &log);
        fmi2FMUstate saved = NULL;
        CHECK(fmi2SetRealInputDerivatives(c, references, 2, (const fmi2Integer[]){1, INPUTS[i].order}, values) ==
              fmi2Error);
        CHECK(said(&log, INPUTS[i].words));
        CHECK(fmi2GetFMUstate(fresh, &saved) == fmi2OK && fmi2SetFMUstate(c, saved) == fmi2OK && same_state(c, fresh));
        CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK);
        fmi2FreeInstance(c);
        fmi2FreeInstance(fresh);
    }
    for (size_t i = 0; i < sizeof OUTPUTS / sizeof OUTPUTS[0]; i++) {
        fmi2Component c = start(fmi2CoSimulation, &log);
        CHECK(isnan(rate(c, OUTPUTS[i].reference, OUTPUTS[i].order)) && said(&log, OUTPUTS[i].words));
        fmi2FreeInstance(c);
    }
    fmi2Component c = start(fmi2CoSimulation, &log);
    CHECK(fmi2SetRealInputDerivatives(c, NULL, 0, NULL, NULL) == fmi2OK);
    CHECK(fmi2GetRealOutputDerivatives(c, NULL, 0, NULL, NULL) == fmi2OK);
    CHECK(fmi2GetRealOutputDerivatives(c, NULL, 1, NULL, NULL) == fmi2Error && said(&log, "NULL"));
    fmi2FreeInstance(c);
    c = start(fmi2CoSimulation, &log); /* no mass: no accelerations, and a sentence */
    CHECK(set(c, M2, 0.0) == fmi2OK && isnan(rate(c, THETA1_DOT, 2)) && said(&log, "singular"));
    fmi2FreeInstance(c);
}
