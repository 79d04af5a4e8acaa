/* The sentences on failed evaluations and solver steps. */
#include "failure.h"

#include <stdio.h>

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

void failure_sentence(const Failure *failure, char text[], size_t size) {
    char names[NAMES_SIZE];
    list_coordinates(failure->coordinates, names, sizeof names);
    switch (failure->kind) {
    case FAILURE_SINGULAR:
        snprintf(text, size, "at time %.17g the mass matrix is singular and does not determine the acceleration of %s; "
                 "check the masses and inertias, or start elsewhere", failure->time, names);
        break;
    case FAILURE_NOT_FINITE:
        snprintf(text, size, "at time %.17g the equations of motion give no finite acceleration of %s; "
                 "the motion has left the range where they are defined", failure->time, names);
        break;
    case FAILURE_OVERFLOW:
        snprintf(text, size, "at time %.17g the state %s grows beyond all bounds even in a solver step of %.3g s; "
                 "the motion ends here", failure->time, variable_name(VARIABLE_STATE, failure->state), failure->step);
        break;
    case FAILURE_ACCURACY:
        snprintf(text, size, "at time %.17g a solver step of %.3g s still makes an error of %.3g times the tolerance "
                 "in the state %s; raise solver_tolerance unless the motion is singular here", failure->time,
                 failure->step, failure->amount, variable_name(VARIABLE_STATE, failure->state));
        break;
    case FAILURE_STEP_COUNT:
        snprintf(text, size, "from time %.17g the communication step would take %.3g solver steps; raise solver_step",
                 failure->time, failure->amount);
        break;
    case FAILURE_NONE:
        snprintf(text, size, "no failure is recorded");
        break;
    }
}
