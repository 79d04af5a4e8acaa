/* Getting and setting values. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"

void check_refused_values(void) {
    static const struct {
        fmi2ValueReference reference;
        double value;
        fmi2Status status;
        const char *words;
    } VALUES[] = {
        {N_REFERENCES, 0.0, fmi2Error, "value reference 25"},  {4000000000u, 0.0, fmi2Error, "4000000000"},
        {Q_THETA1, NAN, fmi2Error, "Q_theta1 cannot be set to"}, {THETA1, HUGE_VAL, fmi2Error, "inf"},
        {Q_THETA2, 50.5, fmi2Discard, "-50 to 50"},            {M1, -1.0, fmi2Discard, "m1 cannot be set to -1"},
        {Q_THETA2, 50.0, fmi2OK, ""},                          {THETA2, -101.0, fmi2Discard, "theta2"},
    };
    for (size_t i = 0; i < sizeof VALUES / sizeof VALUES[0]; i++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(set(c, VALUES[i].reference, VALUES[i].value) == VALUES[i].status);
        CHECK(said(&log, VALUES[i].words));
        CHECK(VALUES[i].status != fmi2Discard || get(c, VALUES[i].reference) != VALUES[i].value);
        CHECK(VALUES[i].status == fmi2Error || fmi2EnterInitializationMode(c) == fmi2OK);
        fmi2FreeInstance(c);
    }

    /* a refused list changes nothing, wherever the refused value stands */
    static const fmi2ValueReference LIST[] = {M1, M2, L1};
    static const double PARTLY_WRONG[] = {9.0, 8.0, -7.0};
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetReal(c, LIST, 3, PARTLY_WRONG) == fmi2Discard);
    CHECK(get(c, M1) == 1.5 && get(c, M2) == 0.75 && get(c, L1) == 1.0);
    CHECK(isnan(get(c, N_REFERENCES)) && said(&log, "expected 0 to 24"));
    fmi2FreeInstance(c);
}

void check_calculated_values(void) {
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(get(c, REACH) == 1.6);
    CHECK(set(c, L1, 2.0) == fmi2OK && get(c, REACH) == 2.6);
    CHECK(get(c, TOTAL_ENERGY) == get(c, KINETIC_ENERGY) + get(c, POTENTIAL_ENERGY));

    /* accelerations satisfy M qdd = f, here at rest with theta1 = theta2 = 0: (m1+m2) l1^2 a1 + m2 l1 l2 a2 = Q1 */
    for (fmi2ValueReference i = THETA1; i <= THETA2_DOT; i++) {
        CHECK(set(c, i, 0.0) == fmi2OK);
    }
    CHECK(get(c, THETA1_DDOT) == 0.0);
    CHECK(set(c, Q_THETA1, 1.0) == fmi2OK);
    const double a1 = get(c, THETA1_DDOT), a2 = get(c, THETA2_DDOT);
    CHECK(fabs(2.25 * 4.0 * a1 + 0.75 * 2.0 * 0.6 * a2 - 1.0) < 1e-14);
    CHECK(fabs(0.75 * 2.0 * 0.6 * a1 + 0.75 * 0.36 * a2) < 1e-14);
    CHECK(set(c, THETA1_DOT, 3.0) == fmi2OK && get(c, EXTERNAL_POWER) == 3.0);
    fmi2FreeInstance(c);
}

void check_null_arguments(void) {
    static const fmi2ValueReference REFERENCE = THETA1;
    double value = 0.0;
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2GetReal(c, NULL, 0, NULL) == fmi2OK && fmi2SetReal(c, NULL, 0, NULL) == fmi2OK);
    CHECK(fmi2GetReal(c, NULL, 1, &value) == fmi2Error && said(&log, "value references is NULL"));
    CHECK(fmi2Reset(c) == fmi2OK && fmi2GetReal(c, &REFERENCE, 1, NULL) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2SetReal(c, &REFERENCE, 1, NULL) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2GetFMUstate(c, NULL) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2SetFMUstate(c, NULL) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2FreeFMUstate(c, NULL) == fmi2OK);
    fmi2FreeInstance(c);

    c = start(fmi2CoSimulation, &log);
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, NULL) == fmi2Error && said(&log, "NULL"));
    fmi2FreeInstance(c);

    c = start(fmi2ModelExchange, &log);
    CHECK(fmi2GetContinuousStates(c, NULL, 4) == fmi2Error);
    fmi2FreeInstance(c);
    c = start(fmi2ModelExchange, &log);
    CHECK(fmi2GetContinuousStates(c, &value, 1) == fmi2Error && said(&log, "1 elements"));
    fmi2FreeInstance(c);
    c = start(fmi2ModelExchange, &log);
    CHECK(fmi2GetEventIndicators(c, &value, 1) == fmi2Error);
    fmi2FreeInstance(c);
    c = start(fmi2ModelExchange, &log);
    CHECK(fmi2CompletedIntegratorStep(c, fmi2True, NULL, NULL) == fmi2Error);
    fmi2FreeInstance(c);
}

void check_other_types(void) {
    static const fmi2ValueReference REFERENCE = 0;
    fmi2Integer integer = 0;
    fmi2String string = "";
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetInteger(c, &REFERENCE, 1, &integer) == fmi2Error && said(&log, "Integer"));
    CHECK(fmi2Reset(c) == fmi2OK && fmi2SetBoolean(c, &REFERENCE, 1, &integer) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2GetBoolean(c, &REFERENCE, 1, &integer) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2GetString(c, &REFERENCE, 1, &string) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2SetString(c, &REFERENCE, 1, &string) == fmi2Error);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2SetBoolean(c, NULL, 0, NULL) == fmi2OK);
    CHECK(fmi2SetInteger(c, NULL, 0, NULL) == fmi2OK && fmi2GetString(c, NULL, 0, NULL) == fmi2OK);
    fmi2FreeInstance(c);
}
