/* Checks on a motion that ends: with start velocity 1, xi = -ln(1 - t), xi_dot = 1 / (1 - t). Compiled with each of the
   tableaus: adaptive with and without first-same-as-last, and fixed step. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "host.h"
#include "mechanism.h"
#include "solver.h"

static const double LN_2 = 0.6931471805599453;

enum { XI = 1, XI_DOT, XI_DDOT, F, TOLERANCE, STEP, MAX_STEP };

/* An instance in step complete, with a start position and two settings of the solver. */
static fmi2Component start_at(double xi, double tolerance, double step, Log *log) {
    fmi2Component c = instantiate(fmi2CoSimulation, log);
    CHECK(set(c, XI, xi) == fmi2OK && set(c, TOLERANCE, tolerance) == fmi2OK && set(c, STEP, step) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    return c;
}

/* |error| of xi_dot at 0.5 s, in communication steps of 0.1 s. */
static double error_at_half(double tolerance, double step) {
    Log log;
    fmi2Component c = start_at(0.0, tolerance, step, &log);
    CHECK(steps(c, 0.0, 0.1, 5) == fmi2OK);
    const double error = fabs(get(c, XI_DOT) - 2.0);
    CHECK(get(c, XI_DDOT) > 3.9 && fabs(get(c, XI) - LN_2) < 2.0 * error + 1e-9);
    fmi2FreeInstance(c);
    return error;
}

/* Adaptive methods keep the tolerance, fixed-step methods converge with their order. */
static void check_order(void) {
    if (METHOD.error_order > 0) {
        CHECK(error_at_half(1e-5, 0.0) < 1e-3);
        CHECK(error_at_half(1e-8, 0.0) < 1e-6);
    } else {
        const double ratio = error_at_half(0.0, 0.025) / error_at_half(0.0, 0.0125);
        CHECK(fabs(log2(ratio) - METHOD.order) < 0.3);
        CHECK(error_at_half(0.0, 0.0) < pow(1e-2, METHOD.order)); /* DEFAULT_SOLVER_STEP */
    }
}

/* The step that meets the end is discarded; all values are finite and belong to the last successful time. */
static void check_end(double xi, double end, const char *category, const char *words) {
    double time = 0.0;
    fmi2Boolean terminated = fmi2False;
    Log log;
    fmi2Component c = start_at(xi, 1e-6, 0.0, &log);
    CHECK(steps(c, 0.0, 0.25, 3) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.75, 0.5, fmi2True) == fmi2Discard);
    CHECK(strcmp(log.category, category) == 0 && said(&log, words));
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time) == fmi2OK && time > 0.75 && time < end + 1e-2);
    CHECK(METHOD.error_order == 0 || fabs(time - end) < 1e-3);
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &terminated) == fmi2OK && terminated);
    for (fmi2ValueReference i = 0; i <= XI_DDOT; i++) {
        CHECK(isfinite(get(c, i)));
    }
    CHECK(get(c, 0) == time);
    CHECK(fmi2DoStep(c, time, 0.1, fmi2True) == fmi2Error);
    fmi2FreeInstance(c);
}

/* After a failed step an instance can be taken back, and repeats itself. */
static void check_return(void) {
    fmi2FMUstate saved = NULL;
    Log log;
    fmi2Component c = start_at(0.0, 1e-6, 0.0, &log);
    CHECK(steps(c, 0.0, 0.25, 3) == fmi2OK && fmi2GetFMUstate(c, &saved) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.75, 0.125, fmi2False) == fmi2OK);
    const double velocity = get(c, XI_DOT);
    CHECK(fmi2SetFMUstate(c, saved) == fmi2OK && fmi2DoStep(c, 0.75, 0.5, fmi2False) == fmi2Discard);
    CHECK(fmi2SetFMUstate(c, saved) == fmi2OK && fmi2DoStep(c, 0.75, 0.125, fmi2False) == fmi2OK);
    CHECK(get(c, XI_DOT) == velocity);
    CHECK(set(c, F, -1e3) == fmi2OK && fmi2DoStep(c, 0.875, 0.01, fmi2False) == fmi2OK && get(c, XI_DOT) < velocity);
    CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK);
    fmi2FreeInstance(c);
}

/* Motion without force and without mass in the way is exact, whatever the step. */
static void check_long_steps(void) {
    Log log;
    fmi2Component c = start_at(0.0, 1e-6, 0.0, &log);
    CHECK(set(c, F, -1.0) == fmi2OK); /* xi_ddot = 1 - 1 = 0: xi = t until 5 */
    CHECK(fmi2DoStep(c, 0.0, 4.5, fmi2True) == fmi2OK && fabs(get(c, XI) - 4.5) < 1e-9);
    CHECK(set(c, F, -1.0 + 1e-15) == fmi2OK); /* a new value: the solver does not step over the singular range */
    CHECK(fmi2DoStep(c, 4.5, 1.0, fmi2True) == fmi2Discard);
    CHECK(get(c, XI) <= 5.0 && get(c, XI) > 4.99 && said(&log, "singular") && said(&log, "xi"));
    fmi2FreeInstance(c);

    c = start_at(0.0, 1e-6, 1e-20, &log); /* a hopeless setting ends in a sentence, not in an endless loop */
    const fmi2Status status = fmi2DoStep(c, 0.0, 0.5, fmi2True);
    CHECK(METHOD.error_order == 0 ? status == fmi2Discard && said(&log, "raise solver_step") : status == fmi2OK);
    fmi2FreeInstance(c);
}

/* With F = -v0^2 + a - 2 v0 a t - a^2 t^2 the motion is xi_dot = v0 + a t, which all methods solve exactly; time
   derivatives of outputs are those of this motion. */
static void check_polynomial_force(void) {
    static const double v0 = 1.0, a = -0.75;
    static const fmi2ValueReference FORCE[] = {F, F}, OUTPUTS[] = {XI, XI, XI_DOT, XI_DOT, XI_DDOT, XI_DDOT};
    static const fmi2Integer ORDERS[] = {1, 2, 1, 2, 1, 2};
    const double rates[] = {-2.0 * v0 * a, -2.0 * a * a};
    Log log;
    fmi2Component c = start_at(0.0, 1e-10, 0.0, &log);
    CHECK(set(c, F, a - v0 * v0) == fmi2OK && fmi2SetRealInputDerivatives(c, FORCE, 2, ORDERS, rates) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.0, 2.0, fmi2True) == fmi2OK);
    const double v = v0 + 2.0 * a;
    CHECK(fabs(get(c, XI_DOT) - v) < 1e-9 && fabs(get(c, XI) - 2.0 * v0 - 2.0 * a) < 1e-9);
    CHECK(fabs(get(c, F) - a + v * v) < 1e-12 && fabs(get(c, XI_DDOT) - a) < 1e-8);

    const double expected[] = {v, a, a, 0.0, 0.0, 0.0};
    double found[6];
    CHECK(fmi2GetRealOutputDerivatives(c, OUTPUTS, 6, ORDERS, found) == fmi2OK);
    for (int i = 0; i < 6; i++) {
        CHECK(fabs(found[i] - expected[i]) < 1e-7);
    }
    fmi2FreeInstance(c);
}

/* xi = -ln(1 - t): the derivatives of order n are (n - 1)! / (1 - t)^n. */
static void check_free_derivatives(void) {
    static const fmi2ValueReference OUTPUTS[] = {XI_DDOT, XI_DDOT, XI_DOT};
    double found[3];
    Log log;
    fmi2Component c = start_at(0.0, 1e-10, 1e-3, &log);
    CHECK(fmi2DoStep(c, 0.0, 0.5, fmi2True) == fmi2OK);
    CHECK(fmi2GetRealOutputDerivatives(c, OUTPUTS, 3, (const fmi2Integer[]){1, 2, 2}, found) == fmi2OK);
    CHECK(fabs(found[0] - 16.0) < 1e-6 && fabs(found[1] - 96.0) < 1e-5 && fabs(found[2] - 16.0) < 1e-6);
    fmi2FreeInstance(c);
}

/* Where the motion ends within a step, the input belongs to the time reached. */
static void check_input_of_a_discarded_step(void) {
    double reached = 0.0, slope = 0.0;
    Log log;
    fmi2Component c = start_at(0.0, 1e-6, 0.0, &log);
    CHECK(set(c, F, -0.5) == fmi2OK);
    CHECK(fmi2SetRealInputDerivatives(c, &(fmi2ValueReference){F}, 1, &(fmi2Integer){1}, &(double){2.0}) == fmi2OK);
    CHECK(fmi2DoStep(c, 0.0, 10.0, fmi2True) == fmi2Discard);
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &reached) == fmi2OK && reached > 0.1 && reached < 10.0);
    CHECK(fabs(get(c, F) + 0.5 - 2.0 * reached) < 1e-12 * reached);
    const double expected = 2.0 * get(c, XI_DOT) * get(c, XI_DDOT) + 2.0; /* xi''' = 2 xi' xi'' + F' */
    CHECK(fmi2GetRealOutputDerivatives(c, &(fmi2ValueReference){XI_DDOT}, 1, &(fmi2Integer){1}, &slope) == fmi2OK);
    CHECK(fabs(slope - expected) <= 1e-12 * fabs(expected));
    fmi2FreeInstance(c);
}

int main(void) {
    printf("- %s\n", METHOD.name);
    check_order();
    if (METHOD.order == 2 && METHOD.error_order == 0) {
        return summary() == 0 ? 0 : 1; /* an implicit method of fixed step may leap over the end and not see it */
    }
    check_end(0.0, 1.0 - exp(-5.0), "logSingularLinearSystems", "singular");
    check_end(20.0, 1.0, "logStatusDiscard", "xi");
    check_return();
    check_long_steps();
    check_polynomial_force();
    check_free_derivatives();
    check_input_of_a_discarded_step();
    return summary() == 0 ? 0 : 1;
}
