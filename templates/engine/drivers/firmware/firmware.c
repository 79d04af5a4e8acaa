#include "firmware.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "equations.h"
#include "events.h"
#include "integrator.h"
#include "massless.h"
#include "scale.h"
#include "values.h"

/* Numbers of type float do not tell the times of a long run apart. Where the equations do not contain the time, each
   step begins at time 0 for them. */
enum { TIME_STANDS_STILL = DBL_DIG < 10 && !TIME_DEPENDENT };

/* In units of the step: the most by which rounding of the time may change its length. Where it changes it by more, the
   time is too large for this step. */
static const double STEP_ROUNDING = 0.01;

Firmware *firmware_init(void *memory, size_t size) {
    if (memory == NULL || size < FIRMWARE_SIZE) {
        return NULL;
    }
    char *begin = (char *)memory + (ARENA_UNIT - (uintptr_t)memory % ARENA_UNIT) % ARENA_UNIT;
    Firmware *firmware = (Firmware *)(void *)begin;
    memset(firmware, 0, sizeof *firmware);
    firmware->instance.policy = &OWN_SOLVER;
    instance_work_in(&firmware->instance, arena_begin(begin + FIRMWARE_HEAD, ARENA_CAPACITY, ARENA_WORK));
    instance_start(&firmware->instance);
    return firmware;
}

static bool started(const Firmware *firmware) {
    return firmware->instance.state.phase == PHASE_RUNNING;
}

static bool is_a_variable(int variable) {
    return variable >= 0 && variable < N_VARIABLES;
}

static bool settable(const Firmware *firmware, VariableKind kind) {
    const bool always = kind == VARIABLE_INPUT || kind == VARIABLE_PARAMETER;
    const bool before = kind == VARIABLE_STATE || kind == VARIABLE_MASSLESS || kind == VARIABLE_FIXED_PARAMETER;
    return always || (before && !started(firmware));
}

FirmwareStatus firmware_set(Firmware *firmware, int variable, double value) {
    if (!is_a_variable(variable) || !settable(firmware, VARIABLES[variable].kind)) {
        return FIRMWARE_NO_VARIABLE;
    }
    const Variable *chosen = &VARIABLES[variable];
    if (!isfinite(value) || value < chosen->minimum || value > chosen->maximum) {
        return FIRMWARE_NO_VALUE;
    }
    instance_assign(&firmware->instance, value_slot(&firmware->instance, chosen), value);
    return FIRMWARE_OK;
}

FirmwareStatus firmware_get(Firmware *firmware, int variable, double *value) {
    Instance *instance = &firmware->instance;
    if (!is_a_variable(variable) || VARIABLES[variable].kind == VARIABLE_CLOCK) {
        return FIRMWARE_NO_VARIABLE;
    }
    const Variable *chosen = &VARIABLES[variable];
    if (chosen->kind == VARIABLE_TIME) {
        *value = firmware->time;
        return FIRMWARE_OK;
    }
    if (!started(firmware) && !settable(firmware, chosen->kind)) {
        return FIRMWARE_NOT_NOW;
    }
    if (value_is_integer(chosen->kind)) {
        *value = (double)value_integer(instance, chosen);
        return FIRMWARE_OK;
    }
    if (started(firmware) && !value_update(instance, chosen->kind)) {
        return FIRMWARE_FAILED;
    }
    const double found = *value_slot(instance, chosen);
    if (!isfinite(found)) {
        return FIRMWARE_NO_VALUE;
    }
    *value = found;
    return FIRMWARE_OK;
}

FirmwareStatus firmware_start(Firmware *firmware, double time) {
    Instance *instance = &firmware->instance;
    State *state = &instance->state;
    bool jumped;
    if (started(firmware)) {
        return FIRMWARE_NOT_NOW;
    }
    if (!isfinite(time)) {
        return FIRMWARE_NO_VALUE;
    }
    firmware->time = firmware->begun = time;
    state->time = state->start_time = TIME_STANDS_STILL ? 0.0 : time;
    instance_forget_cache(instance);
    state->phase = PHASE_SOLVING_START;
    if (!equations_settle(instance) || !events_refresh(instance, &jumped)) {
        state->phase = PHASE_SETTING_UP;
        return FIRMWARE_FAILED;
    }
    massless_keep(state);
    state->phase = PHASE_RUNNING;
    return FIRMWARE_OK;
}

/* The end of the next step, from a count of steps: it does not drift. Steps are equal if they differ by rounding. */
static double step_end(Firmware *firmware, double step) {
    if (!(fabs(step - firmware->length) <= NOISE * step) || firmware->count == INT32_MAX) {
        firmware->begun = firmware->time;
        firmware->length = step;
        firmware->count = 0;
    }
    return firmware->begun + ((double)firmware->count + 1.0) * firmware->length;
}

FirmwareStatus firmware_step(Firmware *firmware, double step) {
    Instance *instance = &firmware->instance;
    State *state = &instance->state;
    if (!started(firmware)) {
        return FIRMWARE_NOT_NOW;
    }
    if (!(step > 0.0 && step <= LONGEST_STEP * (1.0 + SLIVER))) {
        return FIRMWARE_NO_STEP;
    }
    const double end = step_end(firmware, step);
    if (TIME_STANDS_STILL) {
        state->time = 0.0;
    } else if (!(fabs(end - state->time - step) <= STEP_ROUNDING * step)) {
        return FIRMWARE_NO_STEP;
    }
    if (!integrate(instance, TIME_STANDS_STILL ? step : end)) {
        firmware->time = TIME_STANDS_STILL ? firmware->time + state->time : state->time;
        firmware->length = 0.0;
        return FIRMWARE_FAILED;
    }
    firmware->count++;
    firmware->time = end;
    return FIRMWARE_OK;
}

double firmware_time(const Firmware *firmware) {
    return firmware->time;
}

int firmware_failure(const Firmware *firmware) {
    return (int)firmware->instance.failure.kind;
}

int firmware_notices(const Firmware *firmware) {
    const State *state = &firmware->instance.state;
    int noticed = (int)state->noticed;
    for (int i = 0; i < N_BOUNDED; i++) {
        noticed |= state->left_range[i] != 0 ? (int)NOTICE_RANGE : 0;
    }
    return noticed;
}
