/* The memory of the solver, seen from inside: the stored derivative and the proposed step. */
#include <math.h>
#include <string.h>

#include "checks.h"
#include "host.h"
#include "instance.h"

/* The proposal for the next solver step, s. */
static double proposal(fmi2Component c) {
    return ((const Instance *)c)->state.next_step;
}

/* A new input counts from the beginning of the next step: in a very short one, velocities change by qdd h. */
void check_stored_derivative(void) {
    static const fmi2ValueReference CHANGED[] = {Q_THETA1, M1, L2, G};
    for (size_t i = 0; i < sizeof CHANGED / sizeof CHANGED[0]; i++) {
        const double h = 1e-6;
        Log log;
        fmi2Component c = start(fmi2CoSimulation, &log);
        CHECK(steps(c, 0.0, 0.1, 2) == fmi2OK);
        CHECK(((const Instance *)c)->state.first_stage_valid);
        CHECK(set(c, CHANGED[i], get(c, CHANGED[i]) + 2.0) == fmi2OK);
        const double before = get(c, THETA1_DOT), acceleration = get(c, THETA1_DDOT);
        CHECK(fmi2DoStep(c, 0.2, h, fmi2True) == fmi2OK);
        CHECK(fabs((get(c, THETA1_DOT) - before) / h - acceleration) < 1e-3 * fabs(acceleration));
        fmi2FreeInstance(c);
    }
}

/* The proposal follows the tolerance with the fifth root, and a step that was cut short does not reduce it. */
void check_step_proposal(void) {
    static const double TOLERANCES[] = {1e-6, 1e-11};
    double proposals[2];
    for (int k = 0; k < 2; k++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log);
        CHECK(set(c, SOLVER_TOLERANCE, TOLERANCES[k]) == fmi2OK);
        CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
        CHECK(fmi2DoStep(c, 0.0, 0.25, fmi2True) == fmi2OK);
        proposals[k] = proposal(c);
        CHECK(fmi2DoStep(c, 0.25, 1e-7, fmi2True) == fmi2OK && proposal(c) >= proposals[k]);
        fmi2FreeInstance(c);
    }
    CHECK(proposals[0] > 4.0 * proposals[1] && proposals[0] < 25.0 * proposals[1]);
}

/* A communication step of some units in the last place may end before the present time; it ends where it was told. */
void check_backward_rounding(void) {
    Log log;
    fmi2Component c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetupExperiment(c, fmi2False, 0.0, 1e6, fmi2False, 0.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    CHECK(fmi2DoStep(c, 1e6 - 2e-9, 1e-9, fmi2True) == fmi2OK && get(c, TIME) == 1e6 - 2e-9 + 1e-9);
    CHECK(fmi2DoStep(c, 1e6, 1e-9, fmi2True) == fmi2OK && get(c, TIME) == 1e6 + 1e-9);
    fmi2FreeInstance(c);
}
