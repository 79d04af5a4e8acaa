#include "values.h"

#include <limits.h>
#include <stddef.h>

#include "equations.h"

bool value_is_integer(VariableKind kind) {
    return kind == VARIABLE_MODE || kind == VARIABLE_IMPACTS;
}

bool value_is_real(VariableKind kind) {
    return !value_is_integer(kind) && kind != VARIABLE_CLOCK;
}

/* While the rest of accumulating impacts lasts, a contact is open, though they are not followed one by one. */
static int64_t mode_of(const State *state, int element) {
    const bool contact = N_UNILATERALS > 0 && element < N_UNILATERALS;
    return contact && state->cascading[element] ? (int64_t)MODE_OPEN : state->modes[element];
}

int value_integer(const Instance *instance, const Variable *variable) {
    const State *state = &instance->state;
    const int64_t value =
        variable->kind == VARIABLE_MODE ? mode_of(state, variable->index) : state->impacts[variable->index];
    return value < INT_MAX ? (int)value : INT_MAX;
}

double *value_slot(Instance *instance, const Variable *variable) {
    State *state = &instance->state;
    Cache *cache = &instance->cache;
    switch (variable->kind) {
    case VARIABLE_STATE:
    case VARIABLE_MASSLESS:        return &state->states[variable->index];
    case VARIABLE_INPUT:           return &state->inputs[variable->index];
    case VARIABLE_ESTIMATE:
    case VARIABLE_PARAMETER:
    case VARIABLE_FIXED_PARAMETER: return &state->parameters[variable->index];
    case VARIABLE_SETTING:         return &state->settings[variable->index];
    case VARIABLE_ACCELERATION:    return &cache->accelerations[variable->index];
    case VARIABLE_FURTHER_RATE:    return &cache->further[variable->index];
    case VARIABLE_MULTIPLIER:      return &cache->shown[N_COORDINATES + variable->index];
    case VARIABLE_DEPENDENT:       return &cache->dependent[variable->index];
    case VARIABLE_LOCAL:           return &cache->locals[variable->index];
    case VARIABLE_IMPULSE:         return &state->impulses[variable->index];
    case VARIABLE_INDICATOR:       return &cache->indicators[variable->index];
    case VARIABLE_SAMPLE:
    case VARIABLE_TUNING:
    case VARIABLE_FIXED_TUNING:
    case VARIABLE_BELIEF:          return &state->observer.slots[variable->index];
    case VARIABLE_CLOCK:
    case VARIABLE_MODE:
    case VARIABLE_IMPACTS:
    case VARIABLE_TIME:
    case N_VARIABLE_KINDS:         break;
    }
    return &state->time;
}

bool value_update(Instance *instance, VariableKind kind) {
    if (kind == VARIABLE_DEPENDENT) {
        equations_dependent(instance);
    }
    if (kind == VARIABLE_MASSLESS) {
        return equations_massless(instance);
    }
    if (kind == VARIABLE_ACCELERATION || kind == VARIABLE_FURTHER_RATE) {
        return equations_accelerations(instance);
    }
    if (kind == VARIABLE_MULTIPLIER) {
        return equations_multipliers(instance);
    }
    if (kind == VARIABLE_INDICATOR) {
        return equations_indicators(instance);
    }
    return kind != VARIABLE_LOCAL || equations_locals(instance);
}

double *value_in_seed(Seed *seed, const Variable *variable) {
    switch (variable->kind) {
    case VARIABLE_TIME:            return &seed->time;
    case VARIABLE_STATE:           return &seed->states[variable->index];
    case VARIABLE_INPUT:           return &seed->inputs[variable->index];
    case VARIABLE_FIXED_PARAMETER:
    case VARIABLE_PARAMETER:       return &seed->parameters[variable->index];
    case VARIABLE_SETTING:         return &seed->settings[variable->index];
    default:                       return NULL;
    }
}

int value_tangent_order(VariableKind kind) {
    const bool moves = kind == VARIABLE_ACCELERATION || kind == VARIABLE_FURTHER_RATE || kind == VARIABLE_MULTIPLIER;
    return kind == VARIABLE_LOCAL ? 2 : moves ? 1 : 0;
}

bool value_is_unknown(VariableKind kind) {
    return kind == VARIABLE_STATE || kind == VARIABLE_MASSLESS || kind == VARIABLE_DEPENDENT ||
           kind == VARIABLE_IMPULSE || value_tangent_order(kind) > 0;
}

const double *value_in_tangent(const Seed *seed, const Tangent *tangent, const Variable *variable) {
    static const double CONSTANT = 0.0; /* the rate of what changes at impacts only */
    switch (variable->kind) {
    case VARIABLE_ACCELERATION: return &tangent->accelerations[variable->index];
    case VARIABLE_FURTHER_RATE: return &tangent->further[variable->index];
    case VARIABLE_MULTIPLIER:   return &tangent->accelerations[N_COORDINATES + variable->index];
    case VARIABLE_DEPENDENT:    return &tangent->dependent[variable->index];
    case VARIABLE_LOCAL:        return &tangent->locals[variable->index];
    case VARIABLE_IMPULSE:      return &CONSTANT;
    default:                    return &seed->states[variable->index];
    }
}

static bool in_states(const Variable *variable) {
    return variable->kind == VARIABLE_STATE || variable->kind == VARIABLE_MASSLESS;
}

static bool is_further(const Variable *variable) {
    return variable->kind == VARIABLE_STATE && variable->index >= 2 * N_COORDINATES;
}

/* The row of Motion's q from which the derivatives of a state or acceleration are counted. */
static int first_row(const Variable *variable) {
    return in_states(variable) ? variable->index / N_COORDINATES : 2;
}

int value_motion_order(const Variable *variable, int order) {
    if (variable->kind == VARIABLE_IMPULSE) {
        return 0;
    }
    if (is_further(variable)) {
        return order - 1;
    }
    return variable->kind == VARIABLE_LOCAL ? order : first_row(variable) + order - 2;
}

double value_in_motion(const Motion *motion, const Variable *variable, int order) {
    if (variable->kind == VARIABLE_IMPULSE) {
        return 0.0;
    }
    if (is_further(variable)) {
        return motion->further[order - 1][variable->index - 2 * N_COORDINATES];
    }
    const int column = in_states(variable)                     ? variable->index % N_COORDINATES
                       : variable->kind == VARIABLE_MULTIPLIER ? N_COORDINATES + variable->index
                                                               : variable->index;
    return variable->kind == VARIABLE_LOCAL ? motion->locals[order - 1][variable->index]
                                            : motion->q[first_row(variable) + order][column];
}
