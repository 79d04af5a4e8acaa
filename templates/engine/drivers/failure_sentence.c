/* One sentence for each kind of failure. */
#include "failure_sentence.h"

#include <math.h>
#include <stdio.h>

#include "names.h"
#include "solver.h"

/* Where nothing controls the error, a motion that blows up may be the solver's own. */
static const char *fixed_step_remedy(void) {
    return METHOD.error_order > 0 ? "" : ", unless the solver step is too long for it: lower solver_step, or export "
                                         "with --solver radau5";
}

/* What helps where the equations of an implicit step are not solved. An adaptive method has tried short steps. */
static const char *iteration_remedy(void) {
    return METHOD.error_order > 0 ? "raise solver_tolerance unless the motion is singular here"
           : TIME_STEPPING        ? "lower solver_step"
           : METHOD.variational && N_CONSTRAINTS > 0
               ? "lower solver_step, or export with --solver radau5 if the mechanism is stiff or its constraints are "
                 "about to become dependent"
               : "lower solver_step, or export with --solver radau5 if the mechanism is stiff";
}

/* The most names that a sentence lists, and the bytes that they may take. */
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

/* Writes the constraints that are not met as "a = 0.1, b = -2e-05"; of a long list the first NAMES_SHOWN. */
static void list_residuals(const Failure *failure, char text[], size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int k = 0; k < failure->count && k < NAMES_SHOWN && used < size; k++) {
        const char *name = CONSTRAINT_NAMES[failure->constraints[k]];
        const int written = snprintf(text + used, size - used, "%s%s = %.3g", k > 0 ? ", " : "", name,
                                     failure->residuals[k]);
        used += written > 0 ? (size_t)written : 0;
    }
}

/* The kinds that concern constraints and what has no mass. */
static void constraints_sentence(const Failure *failure, char text[], size_t size) {
    char names[NAMES_SIZE], residuals[NAMES_SIZE];
    list_coordinates(failure->coordinates, names, sizeof names);
    list_residuals(failure, residuals, sizeof residuals);
    if (failure->kind == FAILURE_CONSTRAINTS && failure->imported) {
        snprintf(text, size, "at time %.17g the importer's solver has left the constraints so far that no states near "
                 "its own meet them; residuals: %s; its steps are too long: shorten them, take a solver of higher "
                 "order, or co-simulation", failure->time, residuals);
    } else if (failure->kind == FAILURE_CONSTRAINTS && failure->flat) {
        snprintf(text, size, "at time %.17g a constraint has hardly any slope, as where all links lie in one line, and "
                 "its residual there is rounding; residuals: %s; start a little beside such a position", failure->time,
                 residuals);
    } else if (failure->kind == FAILURE_CONSTRAINTS) {
        snprintf(text, size, "at time %.17g no states near the present ones meet the constraints; residuals: %s; start "
                 "nearer to a solution, or check what moves the supports%s", failure->time, residuals,
                 fixed_step_remedy());
    } else {
        snprintf(text, size, "at time %.17g the forces on what has no mass do not determine %s near the last completed "
                 "step; residuals: %s; take shorter steps, or start elsewhere", failure->time, names, residuals);
    }
}

/* Solver steps that lead nowhere. */
static void standstill_sentence(const Failure *failure, char text[], size_t size) {
    const int written = snprintf(text, size, "the last %.3g solver steps took the motion on by %.3g s only, to time "
                                 "%.17g", failure->amount, failure->step, failure->time);
    const size_t used = written > 0 && (size_t)written < size ? (size_t)written : size - 1;
    if (failure->event >= 0) {
        snprintf(text + used, size - used, ", and events of %.400s followed each other there; check what acts on it",
                 EVENT_NAMES[failure->event]);
    } else {
        snprintf(text + used, size - used, "; the motion is singular there, masses, stiffnesses and forces are out of "
                 "proportion, or the communication step is far too long for it");
    }
}

/* Where an observer does not go on. */
static void observer_sentence(const Failure *failure, char text[], size_t size) {
    if (failure->kind == FAILURE_SAMPLE_TIME) {
        snprintf(text, size, "from time %.17g the communication step of %.6g s is longer than a sample time, %.6g s; "
                 "take shorter steps, or sample less often", failure->time, failure->step, failure->amount);
    } else if (failure->kind == FAILURE_PAST) {
        snprintf(text, size, "at time %.17g samples may be late by %.6g s, in which there are more communication "
                 "points than the %.0f that are kept; take longer steps", failure->time, failure->step,
                 failure->amount);
    } else {
        snprintf(text, size, "at time %.17g the equations have no value at the estimate, or no state near it meets the "
                 "constraints; give smaller noise of the start and the process, start nearer to the motion, or sample "
                 "more often", failure->time);
    }
}

/* Too many solver steps, or one that fails. */
static void steps_sentence(const Failure *failure, char text[], size_t size) {
    if (failure->kind == FAILURE_TRIAL_COUNT) {
        snprintf(text, size, "a communication step took %.3g solver steps to come to time %.17g; take shorter "
                 "communication steps, a larger solver_tolerance or solver_max_step, or export with --solver radau5 if "
                 "the mechanism is stiff", failure->amount, failure->time);
    } else if (failure->kind == FAILURE_EVENT_COUNT) {
        snprintf(text, size, "a communication step met %.3g events, the last one at time %.17g, of %.400s; take "
                 "shorter communication steps, unless the motion should not have them: each face that is struck is a "
                 "contact of its own", failure->amount, failure->time, EVENT_NAMES[failure->event]);
    } else if (failure->kind == FAILURE_ITERATION) {
        snprintf(text, size, "at time %.17g the equations of an implicit solver step of %.3g s are not solved by "
                 "iteration; %s", failure->time, failure->step, iteration_remedy());
    } else if (failure->kind != FAILURE_STEP_COUNT) {
        observer_sentence(failure, text, size);
    } else {
        snprintf(text, size, "from time %.17g the communication step would take %.3g solver steps; raise solver_step",
                 failure->time, failure->amount);
    }
}

/* The kinds that concern one state. */
static void state_sentence(const Failure *failure, char text[], size_t size) {
    const char *name = state_name(failure->state);
    if (failure->kind == FAILURE_FURTHER) {
        snprintf(text, size, "at time %.17g the derivative of the state %s is %g; its expression is not defined for "
                 "the present states and inputs%s", failure->time, name, failure->amount, fixed_step_remedy());
    } else if (failure->kind == FAILURE_OVERFLOW) {
        snprintf(text, size, "at time %.17g the state %s grows beyond all bounds even in a solver step of %.3g s; "
                 "the motion ends here%s", failure->time, name, failure->step, fixed_step_remedy());
    } else {
        snprintf(text, size, "at time %.17g a solver step of %.3g s still makes an error of %.3g times the tolerance "
                 "in the state %s; raise solver_tolerance unless the motion is singular here", failure->time,
                 failure->step, failure->amount, name);
    }
}

/* The kinds that leave accelerations without a value. */
static void accelerations_sentence(const Failure *failure, char text[], size_t size) {
    char names[NAMES_SIZE];
    list_coordinates(failure->coordinates, names, sizeof names);
    if (failure->kind == FAILURE_SINGULAR) {
        snprintf(text, size, "at time %.17g the mass matrix becomes singular and does not determine the acceleration "
                 "of %s; check the masses and inertias, or start elsewhere", failure->time, names);
    } else if (failure->kind == FAILURE_NEARLY_SINGULAR) {
        snprintf(text, size, "at time %.17g the mass matrix is nearly singular and hardly determines the acceleration "
                 "of %s; if the run ends here, this is why: check the masses and inertias, or start elsewhere",
                 failure->time, names);
    } else {
        snprintf(text, size, "at time %.17g the equations of motion give no finite acceleration of %s; "
                 "the motion has left the range where they are defined%s", failure->time, names,
                 failure->imported ? ", unless the steps of the importer's solver are too long" : fixed_step_remedy());
    }
}

/* A coefficient or a force of friction that is below 0, or not finite. */
static void friction_sentence(const Failure *failure, char text[], size_t size) {
    const bool coefficient = failure->kind == FAILURE_FRICTION;
    const char *what = coefficient ? "coefficient of friction of" : "force of the dry friction";
    const char *name = CONSTRAINT_NAMES[failure->count];
    if (failure->amount < 0.0 && isfinite(failure->amount)) {
        snprintf(text, size, "at time %.17g the %s %.400s is %.6g%s", failure->time, what, name, failure->amount,
                 coefficient ? "; expected 0 or more: check what it is made of, or write max(0, ...) around it"
                             : " (SI), which would push; expected 0 or more: write abs(...) around a load that changes "
                               "its sign, or check the inputs");
    } else {
        snprintf(text, size, "at time %.17g the %s %.400s is %.6g; expected a finite number, at rest as well: bound "
                 "what it is divided by, as in 1/max(abs(x_dot), 1e-3)", failure->time, what, name, failure->amount);
    }
}

/* The kinds that concern the laws of contacts and dry frictions. */
static void laws_sentence(const Failure *failure, char text[], size_t size) {
    if (failure->kind == FAILURE_PENETRATION) {
        snprintf(text, size, "at the start, time %.17g, the gap of %.400s is %.6g (SI); expected 0 or more: start "
                 "where nothing penetrates", failure->time, CONSTRAINT_NAMES[failure->count], failure->amount);
    } else if (failure->kind == FAILURE_JUMP) {
        snprintf(text, size, "at time %.17g a condition turns in the gap of %.400s, which jumps to %.6g (SI): no "
                 "impact carries bodies out of each other; describe each face by a contact of its own, a step by its "
                 "top and its side", failure->time, CONSTRAINT_NAMES[failure->count], failure->amount);
    } else if (failure->kind == FAILURE_RESTITUTION) {
        snprintf(text, size, "at time %.17g the coefficient of restitution of %.400s is %.6g; expected 0 to 1: check "
                 "what it is made of, or write max(0, min(1, ...)) around it", failure->time,
                 CONSTRAINT_NAMES[failure->count], failure->amount);
    } else if (failure->kind == FAILURE_FRICTION || failure->kind == FAILURE_PUSHING) {
        friction_sentence(failure, text, size);
    } else if (failure->kind == FAILURE_MEMORY) {
        snprintf(text, size, "at time %.17g there is no memory for the laws of all that touches, %.0f bytes more; "
                 "free memory, or let less touch at once", failure->time, failure->amount);
    } else if (failure->kind == FAILURE_SLIDING) {
        snprintf(text, size, "at time %.17g no forces of sliding friction are in equilibrium with the forces that they "
                 "depend on; check the coefficients of friction", failure->time);
    } else {
        snprintf(text, size, "at time %.17g no modes of contacts and dry frictions were found that obey their laws; "
                 "check friction, and whether latches press a contact shut that cannot give way", failure->time);
    }
}

/* An argument that leaves its table. */
static void tables_sentence(const Failure *failure, char text[], size_t size) {
    const TableArgument *argument = &ARGUMENTS[failure->state];
    snprintf(text, size, "at time %.17g argument %d of the table %s is %.9g, outside its data from %.9g to %.9g (SI); "
             "extend the table, or set outside = \"hold\" or \"extrapolate\"", failure->time, argument->position,
             argument->table, failure->amount, argument->least, argument->greatest);
}

/* A contact at one point is not enough for what lies flat; nor are forces that jump so that nothing may rest there. */
static const char FLAT[] = "give what lies on a line or a face a contact for each of its ends or corners";
static const char SIGN[] = "describe dry friction in [frictions], or take a function that rises within a small width, "
                           "as tanh(s/width) for sign(s)";

static void kink_sentence(const Failure *failure, char text[], size_t size) {
    snprintf(text, size, "at time %.17g constraints or closed gaps have a kink or come to a dead centre, behind which "
             "the velocity %s does not meet them; leave smooth(...) out around a kink, and %s", failure->time,
             state_name(failure->state), FLAT);
}

/* The kinds that concern one event function. */
static void events_sentence(const Failure *failure, char text[], size_t size) {
    const char *name = EVENT_NAMES[failure->event];
    if (failure->kind == FAILURE_EVENT_VALUE) {
        snprintf(text, size, "at time %.17g the expression %.400s, at whose sign the equations of motion change, has "
                 "no finite value; the motion has left the range where it is defined", failure->time, name);
    } else if (failure->kind == FAILURE_EVENT_POLE) {
        snprintf(text, size, "at time %.17g %.400s grows beyond all bounds or turns ever faster, and what the "
                 "equations of motion say ends there; does a force lose its lever, or a denominator vanish?",
                 failure->time, name);
    } else {
        const bool of_switch = failure->event < N_SWITCHES;
        const char *other = of_switch && N_UNILATERALS > 0 ? "; if a gap contains it, " : ""; /* it may be either */
        snprintf(text, size, "at time %.17g the motion is pushed back to where %.400s is 0 from both sides, so that "
                 "the forces there have no value; %s%s%s", failure->time, name, of_switch ? SIGN : FLAT, other,
                 *other != '\0' ? FLAT : "");
    }
}

/* The kinds that say where the motion has come to. */
static void place_sentence(const Failure *failure, char text[], size_t size) {
    if (failure->kind == FAILURE_KINK) {
        kink_sentence(failure, text, size);
    } else if (failure->kind == FAILURE_TABLE) {
        tables_sentence(failure, text, size);
    } else {
        standstill_sentence(failure, text, size);
    }
}

void failure_sentence(const Failure *failure, char text[], size_t size) {
    switch (failure->kind) {
    case FAILURE_SINGULAR:
    case FAILURE_NEARLY_SINGULAR:
    case FAILURE_NOT_FINITE:
        accelerations_sentence(failure, text, size);
        break;
    case FAILURE_FURTHER:
    case FAILURE_OVERFLOW:
    case FAILURE_ACCURACY:
        state_sentence(failure, text, size);
        break;
    case FAILURE_KINK:
    case FAILURE_TABLE:
    case FAILURE_STANDSTILL:
        place_sentence(failure, text, size);
        break;
    case FAILURE_TRIAL_COUNT:
    case FAILURE_EVENT_COUNT:
    case FAILURE_STEP_COUNT:
    case FAILURE_ITERATION:
    case FAILURE_ESTIMATE:
    case FAILURE_SAMPLE_TIME:
    case FAILURE_PAST:
        steps_sentence(failure, text, size);
        break;
    case FAILURE_RESTITUTION:
    case FAILURE_FRICTION:
    case FAILURE_PUSHING:
    case FAILURE_PENETRATION:
    case FAILURE_JUMP:
    case FAILURE_SLIDING:
    case FAILURE_MODES:
    case FAILURE_MEMORY:
        laws_sentence(failure, text, size);
        break;
    case FAILURE_CONSTRAINTS:
    case FAILURE_MASSLESS:
        constraints_sentence(failure, text, size);
        break;
    case FAILURE_EVENT_VALUE:
    case FAILURE_EVENT_POLE:
    case FAILURE_CHATTERING:
        events_sentence(failure, text, size);
        break;
    case FAILURE_NONE:
        snprintf(text, size, "no failure is recorded");
    }
}
