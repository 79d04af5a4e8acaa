/* Steps of the motion and its derivatives, with one control of both errors. */
#include <string.h>

#include "directed_steps.h"
#include "event_steps.h"
#include "inputs.h"
#include "notices.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_size.h"

/* The derivatives through the trial step of the motion; *error: the greatest of theirs. */
static bool follow_motion(void *of, Step step, double *error) {
    Variations *variations = of;
    Instance *instance = &variations->study.instance;
    *error = 0.0;
    if (!directions_follow(variations, step)) {
        return false;
    }
    for (int d = 0; d < variations->count && *error <= 1.0; d++) {
        const double own = directions_error(variations, d, step, solver_tolerance(&instance->state));
        *error = larger(*error, own);
    }
    return true;
}

/* The derivatives at the end of a good step: on the constraints, with their slopes. A step that an event has cut may
   end where a slip in space comes to 0. Its direction is singular there, and derivatives may need a shorter step. */
static bool finish_directions(void *of, Step tried, Step step) {
    Variations *variations = of;
    const Scratch *scratch = &variations->study.instance.scratch;
    double error = 0.0;
    if (step.end != tried.end && (!follow_motion(of, step, &error) || !(error <= 1.0))) {
        variations->study.instance.state.event_pending = 0;
        return false;
    }
    if ((N_CONSTRAINTS == 0 && directions_have_slope()) || !(step.length > 0.0)) {
        return true;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->seed.states, direction->new_states, sizeof direction->new_states);
    }
    if (!directions_project(variations, step.end, scratch->unprojected, scratch->new_states) ||
        !directions_evaluate(variations, step.end, scratch->new_states)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->new_states, direction->seed.states, sizeof direction->new_states);
        memcpy(direction->new_slope, direction->rates, sizeof direction->new_slope);
    }
    return true;
}

static bool accept_directions(void *of, Step step) {
    Variations *variations = of;
    if (!directions_within(variations, step)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->states, direction->new_states, sizeof direction->states);
        memcpy(direction->slope, direction->new_slope, sizeof direction->slope);
    }
    return true;
}

static bool pass_with_motion(void *of) {
    return directions_pass(of);
}

bool directions_begin_stretch(Variations *variations, double end, const Companion *with) {
    Instance *instance = &variations->study.instance;
    instance->failure.kind = FAILURE_NONE;
    instance->scratch.step_end = end;
    begin_notices(instance);
    instance_forget_motion(instance);
    inputs_begin(instance);
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->seed.states, direction->states, sizeof direction->states);
    }
    if (ENDS_AT_EVENTS && directions_due(variations) && !with->pass(with->of)) {
        return false;
    }
    return (!ENDS_AT_EVENTS || events_begin(instance)) && update_first_stage(instance) &&
           directions_settle(variations);
}

bool directions_step(Variations *variations, double end, const Companion *with) {
    Instance *instance = &variations->study.instance;
    const bool adaptive = METHOD.error_order > 0;
    if (!(adaptive ? adaptive_steps(instance, end, with) : integrate_in_equal_steps(instance, with))) {
        return false;
    }
    inputs_end(instance);
    return true;
}

bool directions_integrate(Variations *variations, double end) {
    const Companion derivatives = {variations, follow_motion, finish_directions, accept_directions,
                                   pass_with_motion};
    return directions_begin_stretch(variations, end, &derivatives) && directions_step(variations, end, &derivatives);
}
