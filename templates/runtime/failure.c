/* The sentences on failed evaluations and solver steps. */
#include "failure.h"

#include <stdio.h>

#include "solver.h"

#if VARIATIONAL && N_CONSTRAINTS > 0
static const char DEPENDENCE[] = " or its constraints are about to become dependent";
#else
static const char DEPENDENCE[] = "";
#endif

/* Where nothing controls the error, a motion that blows up may be the solver's own. */
static const char *fixed_step_remedy(void) {
    return METHOD.error_order > 0 ? "" : ", unless the solver step is too long for it: lower solver_step, or export "
                                         "with --solver radau5";
}

/* What helps where an iteration fails. Under error control steps became as short as they can be. */
static const char *iteration_remedy(void) {
    return METHOD.error_order > 0 ? "raise solver_tolerance unless the motion is singular here"
                                  : "lower solver_step, or export with --solver radau5 if the mechanism is stiff";
}

enum { NAMES_SHOWN = 8, NAMES_SIZE = 400 };

/* Writes the names of the flagged coordinates as "a, b, c"; of a long list the first NAMES_SHOWN. */
static void list_coordinates(const bool flags[N_COORDINATES], char text[], size_t size) {
    size_t used = 0;
    int shown = 0;
    text[0] = '\0';
    for (int i = 0; i < N_COORDINATES && used < size; i++) {
        if (!flags[i] || shown > NAMES_SHOWN) {
            continue;
        }
        const char *name = shown < NAMES_SHOWN ? COORDINATE_NAMES[i] : "...";
        const int written = snprintf(text + used, size - used, "%s%s", shown > 0 ? ", " : "", name);
        used += written > 0 ? (size_t)written : 0;
        shown++;
    }
}

#if N_CONSTRAINTS > 0
/* Writes "a = 0.1, b = -2e-05"; constraints[count], or NULL for the first ones, says whose the residuals are. */
static void list_residuals(const Failure *failure, const int constraints[], char text[], size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int k = 0; k < failure->count && k < NAMES_SHOWN && used < size; k++) {
        const char *name = CONSTRAINT_NAMES[constraints == NULL ? k : constraints[k]];
        const int written = snprintf(text + used, size - used, "%s%s = %.3g", k > 0 ? ", " : "", name,
                                     failure->residuals[k]);
        used += written > 0 ? (size_t)written : 0;
    }
}
#endif

static void massless_sentence(const Failure *failure, const char names[], char text[], size_t size) {
    char residuals[NAMES_SIZE] = "";
#if N_MASSLESS > 0
    list_residuals(failure, MASSLESS_CONSTRAINTS, residuals, sizeof residuals);
#endif
    snprintf(text, size, "at time %.17g the forces on what has no mass do not determine %s near the last completed "
             "step; residuals: %s; take shorter steps, or start elsewhere", failure->time, names, residuals);
}

static void constraints_sentence(const Failure *failure, char text[], size_t size) {
#if N_CONSTRAINTS > 0
    char residuals[NAMES_SIZE];
    list_residuals(failure, NULL, residuals, sizeof residuals);
    snprintf(text, size, "at time %.17g no states near the present ones meet the constraints; residuals: %s; start "
             "nearer to a solution, or check what moves the supports", failure->time, residuals);
#else
    snprintf(text, size, "at time %.17g constraints are not met", failure->time);
#endif
}

void failure_sentence(const Failure *failure, char text[], size_t size) {
    char names[NAMES_SIZE];
    list_coordinates(failure->coordinates, names, sizeof names);
    switch (failure->kind) {
    case FAILURE_SINGULAR:
        snprintf(text, size, "at time %.17g the mass matrix becomes singular and does not determine the acceleration "
                 "of %s; check the masses and inertias, or start elsewhere", failure->time, names);
        break;
    case FAILURE_NEARLY_SINGULAR:
        snprintf(text, size, "at time %.17g the mass matrix is nearly singular and hardly determines the acceleration "
                 "of %s; if the run ends here, this is why: check the masses and inertias, or start elsewhere",
                 failure->time, names);
        break;
    case FAILURE_NOT_FINITE:
        snprintf(text, size, "at time %.17g the equations of motion give no finite acceleration of %s; "
                 "the motion has left the range where they are defined%s", failure->time, names, fixed_step_remedy());
        break;
    case FAILURE_OVERFLOW:
        snprintf(text, size, "at time %.17g the state %s grows beyond all bounds even in a solver step of %.3g s; "
                 "the motion ends here%s", failure->time, state_name(failure->state), failure->step,
                 fixed_step_remedy());
        break;
    case FAILURE_ACCURACY:
        snprintf(text, size, "at time %.17g a solver step of %.3g s still makes an error of %.3g times the tolerance "
                 "in the state %s; raise solver_tolerance unless the motion is singular here", failure->time,
                 failure->step, failure->amount, state_name(failure->state));
        break;
    case FAILURE_TRIAL_COUNT:
        snprintf(text, size, "a communication step took %.3g solver steps to come to time %.17g; take shorter "
                 "communication steps, a larger solver_tolerance or solver_max_step, or export with --solver radau5 if "
                 "the mechanism is stiff", failure->amount, failure->time);
        break;
    case FAILURE_STEP_COUNT:
        snprintf(text, size, "from time %.17g the communication step would take %.3g solver steps; raise solver_step",
                 failure->time, failure->amount);
        break;
    case FAILURE_ITERATION:
        snprintf(text, size, "at time %.17g the equations of an implicit solver step of %.3g s are not solved by "
                 "iteration; %s%s", failure->time, failure->step, iteration_remedy(), DEPENDENCE);
        break;
    case FAILURE_CONSTRAINTS:
        constraints_sentence(failure, text, size);
        break;
    case FAILURE_MASSLESS:
        massless_sentence(failure, names, text, size);
        break;
    case FAILURE_NONE:
        snprintf(text, size, "no failure is recorded");
        break;
    }
}
