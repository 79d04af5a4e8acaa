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
        CHECK(set(c, Q_THETA1, 1e-9) == fmi2OK); /* else the solver steps over the communication point */
        CHECK(fmi2DoStep(c, 0.25, 1e-7, fmi2True) == fmi2OK && proposal(c) >= proposals[k]);
        fmi2FreeInstance(c);
    }
    CHECK(proposals[0] > 4.0 * proposals[1] && proposals[0] < 25.0 * proposals[1]);
}

static int ahead(fmi2Component c) {
    return ((const Instance *)c)->state.ahead != 0;
}

/* Short communication steps leave the solver its own steps; the states in between are as exact as those at their
   ends. */
void check_stepping_over(void) {
    static const double TOLERANCES[] = {1e-5, 1e-7, 1e-9};
    for (int k = 0; k < 3; k++) {
        Log log;
        fmi2Component c = instantiate(fmi2CoSimulation, &log), exact = instantiate(fmi2CoSimulation, &log);
        CHECK(set(c, SOLVER_TOLERANCE, TOLERANCES[k]) == fmi2OK && set(exact, SOLVER_TOLERANCE, 1e-13) == fmi2OK);
        CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
        CHECK(fmi2EnterInitializationMode(exact) == fmi2OK && fmi2ExitInitializationMode(exact) == fmi2OK);
        int over = 0, steps_made = 0;
        double end = 0.0, largest = 0.0;
        for (int i = 0; i < 1000; i++) {
            CHECK(steps(c, 1e-3 * i, 1e-3, 1) == fmi2OK && steps(exact, 1e-3 * i, 1e-3, 1) == fmi2OK);
            CHECK(set(c, Q_THETA1, get(c, Q_THETA1)) == fmi2OK); /* the same bits */
            over += ahead(c);
            steps_made += ((const Instance *)c)->state.dense.end != end;
            end = ((const Instance *)c)->state.dense.end;
            for (fmi2ValueReference x = THETA1; x <= THETA2_DOT; x++) {
                largest = fmax(largest, fabs(get(c, x) - get(exact, x)));
            }
        }
        CHECK(over > 900 && steps_made < 250);
        CHECK(largest < 100.0 * TOLERANCES[k] && largest > 0.001 * TOLERANCES[k]);
        fmi2FreeInstance(c);
        fmi2FreeInstance(exact);
    }
}

/* States that nobody asked for are behind; whoever asks sees no difference, in whatever state of the instance. */
void check_states_behind(void) {
    Log log;
    fmi2Component read = start(fmi2CoSimulation, &log), quiet = start(fmi2CoSimulation, &log);
    int behind = 0;
    for (int i = 0; i < 500; i++) {
        CHECK(steps(read, 1e-3 * i, 1e-3, 1) == fmi2OK && steps(quiet, 1e-3 * i, 1e-3, 1) == fmi2OK);
        CHECK(isfinite(get(read, THETA1)) && !((const Instance *)read)->cache.states_behind);
        behind += ((const Instance *)quiet)->cache.states_behind;
    }
    CHECK(behind > 400 && same_state(read, quiet));
    CHECK(steps(read, 0.5, 1e-3, 3) == fmi2OK && steps(quiet, 0.5, 1e-3, 2) == fmi2OK);
    CHECK(get(quiet, THETA1) != get(read, THETA1) && steps(quiet, 0.502, 1e-3, 1) == fmi2OK);
    CHECK(((const Instance *)quiet)->cache.states_behind && fmi2Terminate(quiet) == fmi2OK);
    CHECK(get(quiet, TIME) == get(read, TIME) && get(quiet, THETA1) == get(read, THETA1));
    CHECK(steps(read, 0.503, 1e-3, 1) == fmi2OK);
    const double theta = get(read, THETA1);
    CHECK(steps(read, 0.9, 1e-3, 1) == fmi2Error && get(read, THETA1) == theta); /* not its communication point */
    fmi2FreeInstance(read);
    fmi2FreeInstance(quiet);
}

/* Where the solver is belongs to the saved state: also when the importer comes back there from another way. */
void check_return_to_a_step_over(void) {
    fmi2FMUstate saved = NULL;
    Log log;
    fmi2Component a = start(fmi2CoSimulation, &log), b = start(fmi2CoSimulation, &log);
    CHECK(steps(a, 0.0, 1e-3, 10) == fmi2OK && ahead(a) && fmi2GetFMUstate(a, &saved) == fmi2OK);
    CHECK(set(a, Q_THETA1, 3.0) == fmi2OK && steps(a, 0.01, 1e-3, 40) == fmi2OK);
    CHECK(fmi2SetFMUstate(a, saved) == fmi2OK && steps(a, 0.01, 1e-3, 40) == fmi2OK);
    CHECK(steps(b, 0.0, 1e-3, 10) == fmi2OK && steps(b, 0.01, 1e-3, 40) == fmi2OK);
    CHECK(same_state(a, b));
    CHECK(fmi2FreeFMUstate(a, &saved) == fmi2OK);
    fmi2FreeInstance(a);
    fmi2FreeInstance(b);
}

/* Beyond the communication point the inputs must be known and the time must exist. */
void check_no_stepping_over(void) {
    Log log;
    fmi2Component c = start(fmi2CoSimulation, &log);
    for (int i = 0; i < 20; i++) { /* inputs that change */
        CHECK(set(c, Q_THETA1, 1e-3 * i) == fmi2OK && steps(c, 1e-3 * i, 1e-3, 1) == fmi2OK && !ahead(c));
    }
    CHECK(steps(c, 0.02, 1e-3, 5) == fmi2OK && ahead(c));
    CHECK(set(c, Q_THETA2, 1.0) == fmi2OK && !ahead(c)); /* goes on from the communication point */
    CHECK(steps(c, 0.025, 1e-3, 5) == fmi2OK && ahead(c));
    CHECK(fmi2SetRealInputDerivatives(c, &(fmi2ValueReference){Q_THETA1}, 1, &(fmi2Integer){1}, &(double){2.0}) ==
          fmi2OK);
    CHECK(steps(c, 0.03, 1e-3, 1) == fmi2OK && !ahead(c));
    fmi2FreeInstance(c);

    c = instantiate(fmi2CoSimulation, &log);
    CHECK(fmi2SetupExperiment(c, fmi2True, 1e-3, 0.0, fmi2True, 0.02) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    for (int i = 0; i < 20; i++) {
        CHECK(steps(c, 1e-3 * i, 1e-3, 1) == fmi2OK && ((const Instance *)c)->state.dense.end <= 0.02);
    }
    CHECK(!ahead(c) || ((const Instance *)c)->state.dense.end == 0.02);
    fmi2FreeInstance(c);
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
