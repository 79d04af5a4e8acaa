/* The time is looked at in parts. A part is halved until its margins are known not to come down in it, or to come down
   steadily, so that there is one root. Bounds follow from the slopes and from the values at both ends. */
#include "timed_switches.h"

#include <float.h>
#include <math.h>

#include "event_noise.h"
#include "failure.h"
#include "intervals.h"
#include "scale.h"
#include "settings.h"
#include "step_size.h"
#include "timed_bounds.h"

/* Bounds: of the parts that one search looks at, which tells how far it has come if there are more; and of bisections,
   which end before it where no number is left between both ends. */
enum { MOST_PARTS = 20000, MOST_BISECTIONS = 200 };

/* A part is longer than the one before it by this factor at most. */
static const double GROWTH_OF_PARTS = 2.0;

/* In units of rounding of the time: the length up to which a part is not halved any more. */
static const double SHORTEST = 4.0;

/* In default experiments: how far ahead a switch of the time is looked for if the importer has not told when it
   stops. */
static const double FARTHEST_LOOK = 1000.0;

/* What is known of a part of the time. */
typedef struct {
    double from, to; /* s */
    double first[SIZE_SWITCHES], last[SIZE_SWITCHES]; /* margins at its ends, positive on the sides of the switches */
    Interval values[SIZE_SWITCHES], slopes[SIZE_SWITCHES]; /* in between, of the same signs; slopes in 1/s */
} Part;

static double side_of(const Instance *instance, int k) {
    return instance->state.parameters[N_MASKS + k];
}

/* Sets values[k] to the margins at a time (s), positive on the sides of their switches. */
static bool margins_at(Instance *instance, double time, double values[]) {
    mechanism_timed(time, instance->state.parameters, values);
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!TIMED_SWITCHES[k]) {
            continue;
        }
        values[k] *= side_of(instance, k);
        if (!isfinite(values[k])) {
            return report_event(instance, FAILURE_EVENT_VALUE, time, k);
        }
    }
    return true;
}

static void bound(const Instance *instance, const Interval parameters[], Part *part) {
    mechanism_timed_bounds((Interval){part->from, part->to}, parameters, part->values, part->slopes);
    for (int k = 0; k < N_SWITCHES; k++) {
        if (TIMED_SWITCHES[k] && side_of(instance, k) < 0.0) {
            part->values[k] = interval_negate(part->values[k]);
            part->slopes[k] = interval_negate(part->slopes[k]);
        }
    }
}

/* The least that values at the ends and slopes leave possible in a part of this width (s). */
static double least_by_slopes(double first, double last, Interval slope, double width) {
    if (slope.low >= 0.0 || slope.high <= 0.0) {
        return slope.low >= 0.0 ? first : last;
    }
    if (!isfinite(slope.low) || !isfinite(slope.high)) {
        return -HUGE_VAL;
    }
    const double at = (first - last + slope.high * width) / (slope.high - slope.low);
    return first + slope.low * smaller(larger(at, 0.0), width);
}

/* The root of a margin that comes down steadily in a part: the first time, to rounding, at which it is not positive. */
static bool bisect(Instance *instance, const Part *part, int k, double *root) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_SWITCHES);
    double positive = part->from, negative = part->to;
    if (part->first[k] <= 0.0) {
        *root = part->from;
        return arena_leave(mark, true);
    }
    for (int i = 0; i < MOST_BISECTIONS; i++) {
        const double middle = 0.5 * (positive + negative);
        if (middle <= positive || middle >= negative) {
            break;
        }
        if (!margins_at(instance, middle, values)) {
            return arena_leave(mark, false);
        }
        if (values[k] > 0.0) {
            positive = middle;
        } else {
            negative = middle;
        }
    }
    *root = negative;
    return arena_leave(mark, true);
}

/* What counts as 0 of a margin in a part: rounding beside its values there, and what was left of it at its last event.
   Rounding beside its nominal value would hide the top of a short pulse. */
static double noise_in(const Instance *instance, const Part *part, int k) {
    const double size = larger(fabs(part->values[k].low), fabs(part->values[k].high));
    const double rounding = isfinite(size) ? NOISE * size : 0.0;
    return smaller(instance->state.event_rests[k] + rounding, events_noise(instance, k));
}

/* Looks for the root of the switch k in a part. *told: there is none, or found has it. */
static bool look_into_part(Instance *instance, const Part *part, int k, bool shortest, TimedRoots *found, bool *told) {
    const double noise = noise_in(instance, part, k), last = part->last[k], width = part->to - part->from;
    const Interval slope = part->slopes[k];
    const double least = larger(part->values[k].low, least_by_slopes(part->first[k], last, slope, width));
    const bool none = least >= -noise || (shortest && last >= -noise);
    *told = none || shortest || slope.high <= 0.0;
    if (none || !*told) {
        return true;
    }
    found->slopes[k] = 0.5 * (smaller(slope.low, 0.0) + smaller(slope.high, 0.0));
    if (!isfinite(found->slopes[k])) {
        found->slopes[k] = (last - part->first[k]) / width;
    }
    return bisect(instance, part, k, &found->roots[k]);
}

/* Looks for the roots of all switches in a part. */
static bool look_for_all(Instance *instance, const Part *part, bool shortest, TimedRoots *found, bool *told) {
    *told = true;
    found->first = -1;
    for (int k = 0; k < N_SWITCHES && *told; k++) {
        found->roots[k] = HUGE_VAL;
        if (!TIMED_SWITCHES[k]) {
            continue;
        }
        if (!look_into_part(instance, part, k, shortest, found, told)) {
            return false;
        }
        if (found->roots[k] < (found->first < 0 ? HUGE_VAL : found->roots[found->first])) {
            found->first = k;
        }
    }
    return true;
}

static void copy(const double values[], double to[]) {
    for (int k = 0; k < N_SWITCHES; k++) {
        to[k] = values[k];
    }
}

bool timed_first(Instance *instance, double from, double to, TimedRoots *found) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, Interval, parameters, SIZE_PARAMETERS);
    WORK_OF(mark, Part, part);
    double width = to - from;
    for (int i = 0; i < SIZE_PARAMETERS; i++) {
        parameters[i] = interval_of(instance->state.parameters[i]);
    }
    part->from = from;
    found->first = -1;
    found->known = from;
    if (!margins_at(instance, from, part->first)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < MOST_PARTS && part->from < to && found->first < 0; i++) {
        bool told = false;
        part->to = part->from + width < to ? part->from + width : to;
        const double rounding = DBL_EPSILON * larger(fabs(part->from), fabs(part->to));
        const bool shortest = part->to - part->from <= SHORTEST * rounding;
        if (margins_at(instance, part->to, part->last)) {
            bound(instance, parameters, part);
            if (!look_for_all(instance, part, shortest, found, &told)) {
                return arena_leave(mark, false);
            }
        } else if (shortest) {
            return arena_leave(mark, false);
        }
        if (!told) {
            found->first = -1;
            width *= 0.5;
            continue;
        }
        found->known = found->first < 0 ? part->to : found->roots[found->first];
        part->from = part->to;
        copy(part->last, part->first);
        width *= GROWTH_OF_PARTS;
    }
    return arena_leave(mark, true);
}

/* What timed_next returns for the roots found; not told: the search ended early. The end (s) is that of the search. */
static double next_of(const TimedRoots *found, double time, bool told, double end) {
    if (!told) {
        return found->known > time ? found->known : HUGE_VAL;
    }
    if (found->first >= 0) {
        return found->roots[found->first] > time ? found->roots[found->first] : HUGE_VAL;
    }
    return found->known < end ? found->known : HUGE_VAL;
}

double timed_next(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, TimedRoots, found);
    const State *state = &instance->state;
    const double ahead = (state->stop_time_defined ? 1.0 : FARTHEST_LOOK) * experiment_duration(state);
    const double end = state->time + ahead;
    const bool told = timed_first(instance, state->time, end, found);
    const double next = next_of(found, state->time, told, end);
    arena_release(mark);
    return next;
}
