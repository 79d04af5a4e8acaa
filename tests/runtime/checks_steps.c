/* Co-simulation: accuracy, communication points, stop time, settings of the solver, failed steps. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "mechanism.h"

/* theta1 at 2 s, with this tolerance and communication step (s). */
static double angle_at_2(double tolerance, double step) {
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetupExperiment(c, fmi2True, tolerance, 0.0, fmi2True, 2.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    const double energy = get(c, TOTAL_ENERGY);
    CHECK(steps(c, 0.0, step, (int)lround(2.0 / step)) == fmi2OK);
    CHECK(fabs(get(c, TIME) - 2.0) < 1e-12);
    CHECK(fabs(get(c, TOTAL_ENERGY) - energy) < 1e4 * tolerance);
    const double angle = get(c, THETA1);
    fmi2FreeInstance(c);
    return angle;
}

void check_accuracy(void) {
    static const double STEPS[] = {2.0, 1.0, 0.1, 0.01, 1.0 / 60.0, 0.001};
    const double exact = angle_at_2(1e-13, 2.0);
    for (size_t i = 0; i < sizeof STEPS / sizeof STEPS[0]; i++) {
        CHECK(fabs(angle_at_2(1e-6, STEPS[i]) - exact) < 1e-4);
        CHECK(fabs(angle_at_2(1e-9, STEPS[i]) - exact) < 1e-7);
    }
}

void check_communication_points(void) {
    static const struct {
        double point, step;
        fmi2Status status;
    } POINTS[] = {
        {0.0, 0.1, fmi2OK},          {0.9e-4, 0.1, fmi2OK},      {-0.9e-4, 0.1, fmi2OK},   {1.1e-4, 0.1, fmi2Error},
        {-1.1e-4, 0.1, fmi2Error},   {0.0, 0.0, fmi2Error},      {0.0, -0.1, fmi2Error},   {0.0, NAN, fmi2Error},
        {NAN, 0.1, fmi2Error},       {0.0, HUGE_VAL, fmi2Error}, {HUGE_VAL, 0.1, fmi2Error}, {0.0, 1e-15, fmi2OK},
        {0.0, 1e-300, fmi2OK},
    };
    for (size_t i = 0; i < sizeof POINTS / sizeof POINTS[0]; i++) {
        Log log;
        fmi2Component c = start(fmi2CoSimulation, &log);
        CHECK(fmi2DoStep(c, POINTS[i].point, POINTS[i].step, fmi2True) == POINTS[i].status);
        CHECK(get(c, TIME) == (POINTS[i].status == fmi2OK ? POINTS[i].point + POINTS[i].step : 0.0));
        fmi2FreeInstance(c);
    }

    /* 60 Hz: times counted or summed, both come out */
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    double sum = 0.0;
    for (int i = 0; i < 600; i++) {
        CHECK(fmi2DoStep(c, i % 2 == 0 ? sum : i / 60.0, 1.0 / 60.0, fmi2True) == fmi2OK);
        sum += 1.0 / 60.0;
    }
    fmi2FreeInstance(c);
}

void check_stop_time(void) {
    static const struct {
        double step;
        fmi2Status status;
    } LAST[] = {{1.0, fmi2OK}, {1.0 + 5e-7, fmi2OK}, {1.0 + 5e-6, fmi2Error}, {2.0, fmi2Error}};
    for (size_t i = 0; i < sizeof LAST / sizeof LAST[0]; i++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 3.0, fmi2True, 4.0) == fmi2OK);
        CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
        CHECK(fmi2DoStep(c, 3.0, LAST[i].step, fmi2True) == LAST[i].status);
        CHECK(LAST[i].status == fmi2OK || said(&log, "stop time"));
        fmi2FreeInstance(c);
    }
}

/* The same step with other settings: a smaller tolerance or a bounded step changes the result, within the tolerance. */
void check_solver_settings(void) {
    static const struct {
        fmi2ValueReference setting;
        double value, deviation;
    } SETTINGS[] = {
        {SOLVER_TOLERANCE, 1e-12, 1e-4}, {SOLVER_STEP, 1e-4, 1e-4}, {SOLVER_MAX_STEP, 1e-3, 1e-4}};
    const double automatic = angle_at_2(1e-6, 2.0);
    const double exact = angle_at_2(1e-13, 2.0);
    for (size_t i = 0; i < sizeof SETTINGS / sizeof SETTINGS[0]; i++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(set(c, SETTINGS[i].setting, SETTINGS[i].value) == fmi2OK);
        CHECK(set(c, SETTINGS[i].setting, -1.0) == fmi2Discard);
        CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
        CHECK(fmi2DoStep(c, 0.0, 2.0, fmi2True) == fmi2OK);
        CHECK(get(c, THETA1) != automatic && fabs(get(c, THETA1) - exact) < SETTINGS[i].deviation);
        CHECK(SETTINGS[i].setting == SOLVER_STEP || fabs(get(c, THETA1) - exact) < 1e-9);
        CHECK(set(c, SETTINGS[i].setting, 0.0) == fmi2Error && said(&log, "fmi2ExitInitializationMode"));
        fmi2FreeInstance(c);
    }
}

void check_discarded_step(void) {
    fmi2Boolean terminated = fmi2False;
    double time = -1.0;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    CHECK(steps(c, 0.0, 0.1, 2) == fmi2OK);
    const double angle = get(c, THETA1);
    CHECK(set(c, M2, 0.0) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.2, 0.1, fmi2True) == fmi2Discard);
    CHECK(strcmp(log.category, "logSingularLinearSystems") == 0 && log.status == fmi2Discard);
    CHECK(said(&log, "singular") && said(&log, "theta2") && !said(&log, "theta1"));
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time) == fmi2OK && time == 0.2);
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) == fmi2OK && terminated);
    CHECK(get(c, THETA1) == angle && get(c, TIME) == 0.2);
    CHECK(fmi2Terminate(c) == fmi2OK && get(c, THETA1) == angle);
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) == fmi2OK && terminated);
    CHECK(fmi2Reset(c) == fmi2OK && fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(set(c, M2, 0.0) == fmi2OK && isnan(get(c, THETA1_DDOT))); /* in co-simulation an error */
    CHECK(log.status == fmi2Error && get(c, THETA1) == START_STATES[0]);
    fmi2FreeInstance(c);
}

void check_status(void) {
    fmi2Boolean terminated = fmi2True;
    fmi2Integer integer;
    fmi2Status pending;
    fmi2String string;
    double time = -1.0;
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    CHECK(steps(c, 0.0, 0.1, 3) == fmi2OK);
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time) == fmi2OK && time == get(c, TIME));
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) == fmi2OK && !terminated);
    CHECK(fmi2GetStatus(c, fmi2DoStepStatus, &pending) == fmi2Discard);
    CHECK(fmi2GetStringStatus(c, fmi2PendingStatus, &string) == fmi2Discard);
    CHECK(fmi2GetIntegerStatus(c, fmi2DoStepStatus, &integer) == fmi2Discard);
    CHECK(fmi2GetRealStatus(c, fmi2Terminated, &time) == fmi2Discard);
    CHECK(steps(c, 0.3, 0.1, 1) == fmi2OK);
    fmi2FreeInstance(c);
}
