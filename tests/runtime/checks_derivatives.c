/* Model exchange and directional derivatives, against differences. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "mechanism.h"

static const fmi2ValueReference KNOWNS[] = {
    TIME, THETA1, THETA2, THETA1_DOT, THETA2_DOT, Q_THETA1, Q_THETA2, M1, M2, L1, L2, G};
static const fmi2ValueReference UNKNOWNS[] = {
    THETA1, THETA2, THETA1_DOT, THETA2_DOT, THETA1_DDOT, THETA2_DDOT, REACH, KINETIC_ENERGY, POTENTIAL_ENERGY,
    TOTAL_ENERGY, P_THETA1, P_THETA2, EXTERNAL_POWER, X_TIP_DDOT};
enum { N_KNOWNS = sizeof KNOWNS / sizeof KNOWNS[0], N_UNKNOWNS = sizeof UNKNOWNS / sizeof UNKNOWNS[0] };

void check_model_exchange(void) {
    double x[N_STATES] = {0.3, -0.7, 1.1, 2.2}, dx[N_STATES], nominal[N_STATES], back[N_STATES];
    fmi2EventInfo info;
    fmi2Boolean event = fmi2True, terminate = fmi2True;
    Log log;
    fmi2Component c = start(fmi2ModelExchange, &log);
    memset(&info, 0xff, sizeof info);
    CHECK(fmi2EnterEventMode(c) == fmi2OK && fmi2NewDiscreteStates(c, &info) == fmi2OK);
    CHECK(!info.newDiscreteStatesNeeded && !info.terminateSimulation && !info.nominalsOfContinuousStatesChanged);
    CHECK(!info.valuesOfContinuousStatesChanged && !info.nextEventTimeDefined);
    CHECK(fmi2EnterContinuousTimeMode(c) == fmi2OK);

    CHECK(fmi2SetTime(c, 0.5) == fmi2OK && get(c, TIME) == 0.5);
    CHECK(fmi2SetContinuousStates(c, x, N_STATES) == fmi2OK);
    CHECK(fmi2GetContinuousStates(c, back, N_STATES) == fmi2OK && memcmp(x, back, sizeof x) == 0);
    CHECK(fmi2GetDerivatives(c, dx, N_STATES) == fmi2OK && dx[0] == 1.1 && dx[1] == 2.2);
    CHECK(dx[2] == get(c, THETA1_DDOT) && dx[3] == get(c, THETA2_DDOT));
    CHECK(fmi2CompletedIntegratorStep(c, fmi2True, &event, &terminate) == fmi2OK && !event && !terminate);
    CHECK(fmi2GetContinuousStates(c, back, N_STATES) == fmi2OK && memcmp(x, back, sizeof x) == 0);
    CHECK(fmi2GetNominalsOfContinuousStates(c, nominal, N_STATES) == fmi2OK && nominal[0] == 1.0);

    /* momentum: along the motion d/dt p = dL/dtheta + Q, so energy changes by the power of the torques */
    const double h = 1e-5;
    double energy[2];
    CHECK(set(c, Q_THETA1, 4.0) == fmi2OK && set(c, Q_THETA2, -3.0) == fmi2OK);
    CHECK(fmi2GetDerivatives(c, dx, N_STATES) == fmi2OK);
    const double power = get(c, EXTERNAL_POWER);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < N_STATES; i++) {
            back[i] = x[i] + (2 * k - 1) * h * dx[i];
        }
        CHECK(fmi2SetContinuousStates(c, back, N_STATES) == fmi2OK);
        energy[k] = get(c, TOTAL_ENERGY);
    }
    CHECK(fabs((energy[1] - energy[0]) / (2.0 * h) - power) < 1e-7);

    back[1] = NAN;
    CHECK(fmi2SetContinuousStates(c, back, N_STATES) == fmi2Discard && said(&log, "theta2"));
    CHECK(fmi2SetTime(c, NAN) == fmi2Error);
    fmi2FreeInstance(c);
}

/* Central difference of an unknown along one known; runs in continuous-time mode, where time can be set. */
static double difference(fmi2Component c, fmi2ValueReference unknown, fmi2ValueReference known) {
    const double centre = get(c, known), h = 1e-5;
    double values[2];
    for (int k = 0; k < 2; k++) {
        const double value = centre + (2 * k - 1) * h;
        CHECK((known == TIME ? fmi2SetTime(c, value) : set(c, known, value)) == fmi2OK);
        values[k] = get(c, unknown);
    }
    CHECK((known == TIME ? fmi2SetTime(c, centre) : set(c, known, centre)) == fmi2OK);
    return (values[1] - values[0]) / (2.0 * h);
}

void check_directional_derivatives(void) {
    double derivative[N_UNKNOWNS], seed[N_KNOWNS], combined[N_UNKNOWNS], sum[N_UNKNOWNS] = {0.0};
    Log log;
    fmi2Component c = start(fmi2ModelExchange, &log);
    const double x[N_STATES] = {0.9, -0.4, 1.3, -2.1};
    CHECK(fmi2SetContinuousStates(c, x, N_STATES) == fmi2OK && set(c, Q_THETA1, 1.5) == fmi2OK);
    for (int k = 0; k < N_KNOWNS; k++) {
        const double one = 1.0;
        CHECK(fmi2GetDirectionalDerivative(c, UNKNOWNS, N_UNKNOWNS, &KNOWNS[k], 1, &one, derivative) == fmi2OK);
        seed[k] = 0.25 * (k - 4);
        for (int i = 0; i < N_UNKNOWNS; i++) {
            const double expected = difference(c, UNKNOWNS[i], KNOWNS[k]);
            CHECK(fabs(derivative[i] - expected) < 1e-7 * (1.0 + fabs(expected)));
            CHECK(UNKNOWNS[i] > THETA2_DOT || derivative[i] == (UNKNOWNS[i] == KNOWNS[k] ? 1.0 : 0.0));
            sum[i] += seed[k] * derivative[i];
        }
    }
    CHECK(fmi2GetDirectionalDerivative(c, UNKNOWNS, N_UNKNOWNS, KNOWNS, N_KNOWNS, seed, combined) == fmi2OK);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        CHECK(fabs(combined[i] - sum[i]) < 1e-11 * (1.0 + fabs(sum[i])));
    }
    CHECK(fmi2GetDirectionalDerivative(c, NULL, 0, NULL, 0, NULL, NULL) == fmi2OK);
    fmi2FreeInstance(c);
}

/* Settings of the solver are parameters, on which nothing depends that is an unknown. */
void check_directional_settings(void) {
    const fmi2ValueReference unknown = THETA1_DDOT, known = SOLVER_STEP;
    const double seed = 1.0;
    double value = 1.0;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    CHECK(fmi2GetDirectionalDerivative(c, &unknown, 1, &known, 1, &seed, &value) == fmi2OK);
    CHECK(value == 0.0);
    fmi2FreeInstance(c);
}

void check_directional_refusals(void) {
    static const struct {
        fmi2ValueReference unknown, known;
        double seed;
        const char *words;
    } REFUSED[] = {
        {THETA1_DDOT, THETA2_DDOT, 1.0, "theta2_ddot is not a known"}, {M1, THETA1, 1.0, "m1 is not an unknown"},
        {TIME, THETA1, 1.0, "time is not an unknown"},                 {N_REFERENCES, THETA1, 1.0, "reference 25"},
        {THETA1, N_REFERENCES, 1.0, "reference 25"},                   {THETA1_DDOT, THETA1, NAN, "seed of theta1"},
    };
    for (size_t i = 0; i < sizeof REFUSED / sizeof REFUSED[0]; i++) {
        double value = 0.0;
        Log log;
        fmi2Component c = start(fmi2CoSimulation, &log);
        CHECK(fmi2GetDirectionalDerivative(c, &REFUSED[i].unknown, 1, &REFUSED[i].known, 1, &REFUSED[i].seed, &value) ==
              fmi2Error);
        CHECK(said(&log, REFUSED[i].words));
        fmi2FreeInstance(c);
    }
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    CHECK(fmi2GetDirectionalDerivative(c, NULL, 1, NULL, 0, NULL, NULL) == fmi2Error && said(&log, "NULL"));
    fmi2FreeInstance(c);
}

/* A singular mass matrix is discarded in model exchange, and the importer can go back. */
void check_singular_model_exchange(void) {
    double dx[N_STATES];
    Log log;
    fmi2Component c = start(fmi2ModelExchange, &log);
    CHECK(set(c, M2, 0.0) == fmi2OK && fmi2GetDerivatives(c, dx, N_STATES) == fmi2Discard);
    CHECK(said(&log, "theta2") && strcmp(log.category, "logSingularLinearSystems") == 0);
    CHECK(isnan(get(c, TOTAL_ENERGY)) && log.status == fmi2Discard);
    CHECK(get(c, THETA1) == START_STATES[0] && get(c, REACH) == 1.6);
    CHECK(set(c, M2, 0.75) == fmi2OK && fmi2GetDerivatives(c, dx, N_STATES) == fmi2OK);

    /* without the upper mass the matrix is singular only while the links are aligned */
    CHECK(fmi2EnterEventMode(c) == fmi2OK && set(c, M1, 0.0) == fmi2OK && set(c, THETA1, 0.5) == fmi2OK);
    CHECK(set(c, THETA2, 0.5) == fmi2OK && fmi2GetDerivatives(c, dx, N_STATES) == fmi2Discard);
    CHECK(set(c, THETA2, 0.6) == fmi2OK && fmi2GetDerivatives(c, dx, N_STATES) == fmi2OK);
    fmi2FreeInstance(c);
}
