/* One sentence for each kind of notice. */
#include "notice_sentence.h"

#include <stdio.h>

#include "names.h"
#include "solver.h"
#include "watching.h"

enum { VIBRATIONS_SHOWN = 3 }; /* the sentence names the fastest ones that are not resolved */

static void stiffness_sentence(const Notice *notice, char text[], size_t size) {
    if (METHOD.error_order > 0) {
        snprintf(text, size, "the mechanism is stiff at time %.17g s: stability, not accuracy, bounds the steps of "
                 "solver %s, to %.3g s there; export with --solver radau5", notice->time, METHOD.name, notice->step);
    } else if (METHOD.damps) {
        snprintf(text, size, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: its stiff "
                 "directions turn too far in it for solver %s, whose results are wrong then; lower solver_step, or "
                 "export with --solver radau5", notice->time, notice->step, METHOD.name);
    } else {
        snprintf(text, size, "the mechanism is too stiff at time %.17g s for a solver step of %.3g s: solver %s is not "
                 "stable with it; lower solver_step, or export with --solver ros2 or radau5", notice->time,
                 notice->step, METHOD.name);
    }
}

/* Names the vibrations that are faster than steps of this length resolve, and says how to keep them. */
static void vibrations_sentence(const Notice *notice, char text[], size_t size) {
    char list[400] = "";
    size_t used = 0;
    int count = 0;
    for (; count < N_VIBRATIONS && notice->step > resolving_step(VIBRATIONS[count]); count++) {
        if (count < VIBRATIONS_SHOWN && used < sizeof list) {
            const int written = snprintf(list + used, sizeof list - used, "%s%.3g rad/s (%.80s)", count > 0 ? ", " : "",
                                         VIBRATIONS[count], COORDINATE_NAMES[VIBRATING[count]]);
            used += written > 0 ? (size_t)written : 0;
        }
    }
    if (count > VIBRATIONS_SHOWN && used < sizeof list) {
        snprintf(list + used, sizeof list - used, " and %d slower ones", count - VIBRATIONS_SHOWN);
    }
    const double enough = 0.4 * resolving_step(VIBRATIONS[0]);
    if (METHOD.damps) {
        snprintf(text, size, "solver %s damps undamped vibrations at time %.17g s, where its step of %.3g s is longer "
                 "than an eighth of a period: %s; if they matter, set solver_max_step to %.2g s", METHOD.name,
                 notice->time, notice->step, list, enough);
    } else {
        snprintf(text, size, "solver %s gets vibrations wrong, or is unstable, at time %.17g s, where its step of %.3g "
                 "s is longer than an eighth of a period: %s; set solver_step to %.2g s, or export with --solver "
                 "dopri5", METHOD.name, notice->time, notice->step, list, enough);
    }
}

static void motion_sentence(const Notice *notice, char text[], size_t size) {
    const int input = FIRST_MOTION + 3 * notice->index;
    snprintf(text, size, "the input %s moves at time %.17g s, but %s and %s stay 0: the equations take the support as "
             "resting; connect all three, or set derivatives for all three", variable_name(VARIABLE_INPUT, input),
             notice->time, variable_name(VARIABLE_INPUT, input + 1), variable_name(VARIABLE_INPUT, input + 2));
}

static void impact_sentence(const Notice *notice, char text[], size_t size) {
    const char *name = EVENT_NAMES[notice->index];
    if (notice->kind == NOTICE_NO_FORCES) {
        snprintf(text, size, "at time %.17g s sliding friction left no forces that obey their laws (Painleve's "
                 "paradox; %.400s): an impact without a collision stopped the slip; check the coefficient of friction",
                 notice->time, name);
    } else if (notice->kind == NOTICE_TWO_SOLUTIONS) {
        snprintf(text, size, "at time %.17g s friction allows two motions (Painleve's paradox; %.400s): the present "
                 "mode goes on; check the coefficient of friction", notice->time, name);
    } else if (notice->kind == NOTICE_POISSON) {
        snprintf(text, size, "at time %.17g s Newton's law of impact would have made the kinetic energy grow, or had "
                 "no solution (%.400s): Poisson's law was taken there; lower the restitution or the friction if that "
                 "is not meant", notice->time, name);
    } else if (notice->kind == NOTICE_REDUCED) {
        snprintf(text, size, "at time %.17g s Newton's law of impact would have made the kinetic energy grow (%.400s): "
                 "the restitution was reduced there; lower the restitution or the friction if that is not meant",
                 notice->time, name);
    } else {
        snprintf(text, size, "at time %.17g s the rounds of an impact had no end (%.400s): it was closed without "
                 "restitution; export with impacts = \"simultaneous\" if the contacts share it", notice->time, name);
    }
}

void notice_sentence(const Notice *notice, char text[], size_t size) {
    switch (notice->kind) {
    case NOTICE_STIFF:
        stiffness_sentence(notice, text, size);
        break;
    case NOTICE_UNEQUAL:
        snprintf(text, size, "the solver step changed to %.17g s at time %.17g s; solver %s keeps the energy bounded "
                 "over long times with equal steps only: keep the communication steps equal", notice->step,
                 notice->time, METHOD.name);
        break;
    case NOTICE_UNRESOLVED:
        vibrations_sentence(notice, text, size);
        break;
    case NOTICE_MOTION:
        motion_sentence(notice, text, size);
        break;
    case NOTICE_RANGE:
        snprintf(text, size, "the coordinate %s leaves its range from %.6g to %.6g (SI) before time %.17g s; the "
                 "bounds are no stops, and the motion goes on without them", state_name(BOUNDED[notice->index]),
                 RANGES[notice->index][0], RANGES[notice->index][1], notice->time);
        break;
    case NOTICE_UNSOLVED:
        snprintf(text, size, "before time %.17g s %s; impulses obey their limits, and what is left of the laws goes "
                 "to the next steps; take shorter steps", notice->time,
                 REAL_TIME ? "the laws of contact asked for more work than a step in real time has"
                           : "contacts gave way by up to a hundredth, where the laws of rigid ones had no solution");
        break;
    case NOTICE_NO_FORCES:
    case NOTICE_TWO_SOLUTIONS:
    case NOTICE_POISSON:
    case NOTICE_CLOSED:
    case NOTICE_REDUCED:
        impact_sentence(notice, text, size);
        break;
    case NOTICE_NONE:
    default:
        snprintf(text, size, "nothing was noticed");
        break;
    }
}
