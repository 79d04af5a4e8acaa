/* How the derivatives of a motion jump at events (saltation). The event is where its function g comes down to 0, so
   that it moves with what is varied by

       dtau = - (g_x S + g_p dp) / (g_t + g_x f-),

   and where the states x+ = R(t, x-, p) after it follow from those before,

       S+ = dR (S- + f- dtau, dp, dtau) - f+ dtau.

   g and R are what the motion itself uses, modes, impacts and friction included. Their derivatives along each direction
   are central differences with one step of Richardson's extrapolation, whose error is near rounding because modes hold:
   where modes would differ beside the motion there is no derivative. di Bernardo, Budd, Champneys, Kowalczyk,
   Piecewise-smooth Dynamical Systems, 2008, section 2.5. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "contact_events.h"
#include "directions.h"
#include "event_noise.h"
#include "event_steps.h"
#include "events.h"
#include "scale.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_size.h"

/* The width of differences, relative to the size of what is moved. */
static const double WIDTH = 1e-4;

/* The least width. Where the event is another one at WIDTH beside the motion, as a slow impact may be, ever smaller
   widths are tried. This one is still far above the size of a gap that counts as closed, and rounding leaves 9 digits
   of the difference. */
static const double NARROWEST = 5e-7;

/* Relative: two derivatives by differences of WIDTH that are farther apart differ. Where modes hold they agree to the
   square of WIDTH. */
static const double DIFFERENT = 1e-5;

/* Relative: where differences of two widths are farther apart, what is looked at is not smooth. */
static const double ROUGH = 1e-3;

/* A way to move away from the point before an event. */
typedef struct {
    double states[N_STATES];
    double time;
    double scale;     /* the length of a usual move along this way */
    double width;     /* of differences */
    const Seed *seed; /* inputs and parameters; NULL: they stay */
} Way;

/* Refuses derivatives, with a sentence; returns false. */
static bool no_jump(Variations *variations, int k, const char *reason) {
    Study *study = &variations->study;
    snprintf(study->message, sizeof study->message,
             "at time %.9g s, where %.200s is 0, the motion has no derivative: %s", variations->before.state.time,
             EVENT_NAMES[k], reason);
    return false;
}

/* The length along a way that moves what it moves most by way->width of its size; 0 if the way leads nowhere. */
static double width_of(const Instance *instance, const Way *way) {
    const State *state = &instance->state;
    double size = fabs(way->time) / experiment_duration(state);
    for (int i = 0; i < N_STATES; i++) {
        size = larger(size, fabs(way->states[i]) / (fabs(state->states[i]) + NOMINAL_STATES[i]));
    }
    for (int i = 0; way->seed != NULL && i < N_INPUTS; i++) {
        size = larger(size, fabs(way->seed->inputs[i]) / (fabs(state->inputs[i]) + 1.0));
    }
    for (int i = 0; way->seed != NULL && i < N_PARAMETERS; i++) {
        const double value = fabs(state->parameters[i]);
        size = larger(size, fabs(way->seed->parameters[i]) / (value > 0.0 ? value : 1.0));
    }
    return size * way->scale > MET ? way->width / size : 0.0;
}

/* The probe becomes the instance before the event, moved along a way by the length `by`. */
static void move_probe(Variations *variations, const Way *way, double by) {
    Instance *probe = &variations->probe;
    State *state = &probe->state;
    *probe = variations->before;
    state->time += by * way->time;
    for (int i = 0; i < N_STATES; i++) {
        state->states[i] += by * way->states[i];
    }
    for (int i = 0; way->seed != NULL && i < N_INPUTS; i++) {
        state->inputs[i] += by * way->seed->inputs[i];
    }
    for (int i = 0; way->seed != NULL && i < N_PARAMETERS; i++) {
        state->parameters[i] += by * way->seed->parameters[i];
    }
    instance_forget_cache(probe);
}

/* values[N_EVENTS]: the event functions beside the motion, at the length `by` along a way. */
static bool look_along(Variations *variations, const Way *way, double by, double values[]) {
    move_probe(variations, way, by);
    const State *state = &variations->probe.state;
    contacts_foresee(&variations->probe);
    return events_evaluate(&variations->probe, state->time, state->states, values);
}

/* Passes the event to which a step has come, or which changed inputs make. */
static bool pass_or_refresh(Instance *instance) {
    bool jumped;
    return instance->state.modes_settled ? events_pass(instance) : events_refresh(instance, &jumped);
}

/* result[N_JUMPING]: what the event leads to at the length `by` along a way. False: other modes follow there. */
static bool pass_beside(Variations *variations, const Way *way, double by, double result[]) {
    const State *after = &variations->study.instance.state, *state = &variations->probe.state;
    move_probe(variations, way, by);
    if (!pass_or_refresh(&variations->probe) || memcmp(state->modes, after->modes, sizeof state->modes) != 0 ||
        memcmp(state->parameters + N_MASKS, after->parameters + N_MASKS, N_SWITCHES * sizeof(double)) != 0) {
        return false;
    }
    memcpy(result, state->states, sizeof state->states);
    memcpy(result + N_STATES, state->parameters, N_MASKS * sizeof(double));
    return true;
}

typedef bool (*Looked)(Variations *variations, const Way *way, double by, double values[]);

/* slopes[count]: the derivatives along a way of what `looked` sees, by central differences of two widths and one step
   of Richardson's extrapolation; apart[count]: by how much the two differ. */
static bool differentiate(Variations *variations, const Way *way, Looked looked, int count, double slopes[],
                          double apart[]) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, ahead, N_JUMPING + SIZE_EVENTS);
    WORK(mark, double, behind, N_JUMPING + SIZE_EVENTS);
    WORK(mark, double, coarse, N_JUMPING + SIZE_EVENTS);
    const double width = width_of(&variations->before, way);
    memset(slopes, 0, (size_t)count * sizeof(double));
    memset(apart, 0, (size_t)count * sizeof(double));
    for (int level = 0; width > 0.0 && level < 2; level++) {
        const double by = level == 0 ? width : 0.5 * width;
        if (!looked(variations, way, by, ahead) || !looked(variations, way, -by, behind)) {
            return arena_leave(mark, false);
        }
        for (int i = 0; i < count; i++) {
            const double slope = (ahead[i] - behind[i]) / (2.0 * by);
            slopes[i] = level == 0 ? slope : (4.0 * slope - coarse[i]) / 3.0;
            apart[i] = level == 0 ? 0.0 : fabs(slope - coarse[i]);
            coarse[i] = slope;
        }
    }
    return arena_leave(mark, true);
}

/* Is what jumps a smooth function along a way? Its differences of two widths then agree, in nominal values. */
static bool smooth(const Variations *variations, const Way *way, const double slopes[], const double apart[]) {
    const State *state = &variations->before.state;
    const double part = width_of(&variations->before, way) / way->width;
    double greatest = 1.0, furthest = 0.0;
    for (int i = 0; i < N_JUMPING; i++) {
        const double size = i < N_STATES ? fabs(state->states[i]) + NOMINAL_STATES[i] : 1.0;
        greatest = larger(greatest, part * fabs(slopes[i]) / size);
        furthest = larger(furthest, part * apart[i] / size);
    }
    return furthest <= ROUGH * greatest;
}

/* Sets the shift dtau (s) of the event for each direction. If several event functions are due, all have to come down at
   the same shifted time, else there is no derivative. */
static bool find_shifts(Variations *variations) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, falls, SIZE_EVENTS);
    WORK(mark, double, changes, SIZE_EVENTS);
    WORK(mark, double, apart, SIZE_EVENTS);
    const State *state = &variations->before.state;
    Way along = {.time = 1.0, .scale = experiment_duration(state), .width = WIDTH};
    int first = -1;
    memcpy(along.states, state->first_stage, sizeof along.states);
    for (int k = 0; k < N_EVENTS; k++) {
        first = state->due[k] && first < 0 ? k : first;
    }
    for (int d = 0; d < variations->count; d++) {
        variations->directions[d].shift = 0.0;
    }
    if (first < 0) {
        return arena_leave(mark, true);
    }
    if (!differentiate(variations, &along, look_along, N_EVENTS, falls, apart)) {
        return arena_leave(mark, no_jump(variations, first, "the functions of events have no values beside it"));
    }
    if (fabs(falls[first]) * experiment_duration(state) < LOCATED * events_size(&variations->before, first)) {
        return arena_leave(mark, no_jump(variations, first, "this value is only touched, not crossed; vary the start "
                                                           "a little"));
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        Way way = {.scale = direction->scale, .width = WIDTH, .seed = &direction->seed};
        memcpy(way.states, direction->states, sizeof way.states);
        if (!differentiate(variations, &way, look_along, N_EVENTS, changes, apart)) {
            return arena_leave(mark, no_jump(variations, first, "the functions of events have no values beside it"));
        }
        direction->shift = -changes[first] / falls[first];
        for (int k = first + 1; k < N_EVENTS; k++) {
            const double left = fabs(changes[k] + direction->shift * falls[k]);
            if (state->due[k] && left > DIFFERENT * (fabs(changes[k]) + fabs(direction->shift * falls[k]))) {
                return arena_leave(mark, no_jump(variations, k, "another event comes at the same time, and what is "
                                         "varied parts the two"));
            }
        }
    }
    return arena_leave(mark, true);
}

/* Do the states go on without a jump, and does no latch remember a new place? Then it makes no difference if modes are
   decided otherwise beside the motion, as that of a contact whose force has come down to 0. The direction in which a
   slip in space begins counts for an instant only: soon the slip has one by itself. */
static bool continuous(const State *before, const State *after) {
    bool still = !contacts_catch(before, after);
    for (int i = 0; i < N_STATES; i++) {
        const double size = fabs(before->states[i]) + NOMINAL_STATES[i];
        still = still && fabs(after->states[i] - before->states[i]) <= HYSTERESIS * size;
    }
    return still;
}

/* What the event sets anew, as the first direction of a slip, is constant. Places that latches go on holding stay. */
static void keep_masks(const Variations *variations, Seed *seed) {
    const State *before = &variations->before.state, *after = &variations->study.instance.state;
    for (int i = 0; i < N_MASKS; i++) {
        seed->parameters[i] = after->parameters[i] == before->parameters[i] ? seed->parameters[i] : 0.0;
    }
}

/* Sets the seed of one direction to S after the event, and to the derivatives of the places that latches remember. k is
   the event function that failures name. */
static bool jump(Variations *variations, Direction *direction, int k) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, jumped, N_JUMPING);
    WORK(mark, double, apart, N_JUMPING);
    const double *before = variations->before.state.first_stage;
    const double *after = variations->study.instance.state.first_stage;
    Way way = {.time = direction->shift, .scale = direction->scale, .width = WIDTH, .seed = &direction->seed};
    bool known = false;
    for (int i = 0; i < N_STATES; i++) {
        way.states[i] = direction->states[i] + before[i] * direction->shift;
        direction->seed.states[i] = way.states[i] - after[i] * direction->shift;
    }
    if (continuous(&variations->before.state, &variations->study.instance.state)) {
        keep_masks(variations, &direction->seed);
        return arena_leave(mark, true);
    }
    for (; !known && way.width > NARROWEST; way.width *= 0.1) {
        known = differentiate(variations, &way, pass_beside, N_JUMPING, jumped, apart) &&
                smooth(variations, &way, jumped, apart);
    }
    if (!known) {
        return arena_leave(mark, no_jump(variations, k, "beside the motion contacts decide otherwise, as where several "
                                 "meet at one time"));
    }
    for (int i = 0; i < N_STATES; i++) {
        direction->seed.states[i] = jumped[i] - after[i] * direction->shift;
    }
    memcpy(direction->seed.parameters, jumped + N_STATES, N_MASKS * sizeof(double));
    return arena_leave(mark, true);
}

bool directions_due(Variations *variations) {
    Instance *instance = &variations->study.instance, *probe = &variations->probe;
    bool jumped;
    if (instance->state.modes_settled) {
        return false;
    }
    *probe = *instance;
    return events_refresh(probe, &jumped) && !continuous(&instance->state, &probe->state);
}

/* Where no step has come to the event, inputs have changed, at a time that stays. */
static bool place_event(Variations *variations) {
    for (int d = 0; d < variations->count; d++) {
        variations->directions[d].shift = 0.0;
    }
    return !variations->before.state.event_pending || find_shifts(variations);
}

bool directions_pass(Variations *variations) {
    Instance *instance = &variations->study.instance;
    variations->before = *instance;
    const State *before = &variations->before.state;
    int k = 0;
    while (k < N_EVENTS - 1 && !before->due[k]) {
        k++;
    }
    if (!place_event(variations) || !pass_or_refresh(instance) || !update_first_stage(instance)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        if (!jump(variations, &variations->directions[d], k)) {
            return false;
        }
    }
    return directions_settle(variations);
}

/* Notes the gaps as due that are 0 at the start and become smaller: they are impacts. *first: one of them, -1 if there
   are none; *others: something else touches or rubs there, so that the motion before the start is not known. */
static bool find_due(Variations *variations, int *first, bool *others) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, gaps, SIZE_EVENTS);
    WORK(mark, double, falls, SIZE_EVENTS);
    WORK(mark, double, apart, SIZE_EVENTS);
    State *state = &variations->before.state;
    Way along = {.time = 1.0, .scale = experiment_duration(state), .width = WIDTH};
    memcpy(along.states, state->first_stage, sizeof along.states);
    *first = -1;
    *others = N_FRICTIONS > 0;
    memset(state->due, 0, sizeof state->due);
    if (!events_evaluate(&variations->before, state->time, state->states, gaps) ||
        !differentiate(variations, &along, look_along, N_EVENTS, falls, apart)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        const int k = N_SWITCHES + 2 * i;
        if (fabs(gaps[k]) <= TYPED * EVENT_NOMINALS[k]) {
            state->due[k] = falls[k] < 0.0;
            *others = *others || !state->due[k];
            *first = state->due[k] && *first < 0 ? k : *first;
        }
    }
    return arena_leave(mark, true);
}

/* Does the event, passed from before the start, lead to the states after it? */
static bool passes_alike(Variations *variations) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, passed, N_JUMPING);
    const State *after = &variations->study.instance.state;
    const Way still = {.scale = 1.0};
    bool alike = pass_beside(variations, &still, 0.0, passed);
    for (int i = 0; i < N_STATES && alike; i++) {
        alike = fabs(passed[i] - after->states[i]) <= HYSTERESIS * (fabs(after->states[i]) + NOMINAL_STATES[i]);
    }
    return arena_leave(mark, alike);
}

/* The instance before the impacts of its start, which it has passed, with the directions on its constraints. */
static bool stand_before(Variations *variations) {
    Instance *before = &variations->before;
    before->state.modes_settled = 1;
    before->state.first_stage_valid = 0;
    instance_forget_cache(before);
    if (!directions_stand(variations, before)) {
        return false;
    }
    before->state.phase = PHASE_RUNNING;
    return update_first_stage(before);
}

bool directions_start(Variations *variations) {
    Study *study = &variations->study;
    int first = -1;
    bool jumped, others;
    variations->before = study->instance;
    if (!events_refresh(&study->instance, &jumped)) {
        return study_explain(study);
    }
    const State *now = &study->instance.state;
    const bool held = memcmp(now->parameters, variations->before.state.parameters, N_MASKS * sizeof(double)) != 0;
    if (((jumped || held) && !stand_before(variations)) || (jumped && !find_due(variations, &first, &others))) {
        return no_jump(variations, 0, "the motion before it is not known");
    }
    const bool caught = jumped && contacts_catch(&variations->before.state, &study->instance.state);
    if (first < 0 && !caught) { /* what jumped is rounding, taken off what touches or rests */
        return (jumped || held ? directions_land(variations) : directions_stand(variations, &study->instance)) &&
               study_settle(study);
    }
    if (!study_settle(study) || !update_first_stage(&study->instance) || !find_shifts(variations)) {
        return false;
    }
    const int named = first < 0 ? 0 : first;
    for (int d = 0; d < variations->count; d++) {
        if ((others && fabs(variations->directions[d].shift) > 0.0) || !passes_alike(variations)) {
            return no_jump(variations, named, "an impact at the start is not alone there; begin a little earlier");
        }
        if (!jump(variations, &variations->directions[d], named)) {
            return false;
        }
        memcpy(variations->directions[d].states, variations->directions[d].seed.states, N_STATES * sizeof(double));
    }
    return true;
}
