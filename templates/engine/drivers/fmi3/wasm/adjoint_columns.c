/* Adjoint derivatives in components for WebAssembly: the weights times each column of J, which is a directional
   derivative. Adjoint functions of the mechanism, which libraries have, take a fraction of that time, but they would be
   a fifth of a component, which is sent over networks. */
#include <stddef.h>
#include <string.h>

#include "adjoint.h"
#include "equations.h"
#include "values.h"

double *adjoint_weight(Tangent *weights, Seed *sensitivity, const Variable *variable) {
    const bool moves = variable->kind != VARIABLE_IMPULSE;
    return moves ? (double *)value_in_tangent(sensitivity, weights, variable) : NULL;
}

/* The scalar product; what has no weight may have no value. */
static double weighted_sum(const double weights[], const double values[], int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += weights[i] != 0.0 ? weights[i] * values[i] : 0.0;
    }
    return sum;
}

static bool has_weight(const double weights[], int count) {
    return weighted_sum(weights, weights, count) != 0.0;
}

typedef struct {
    Instance *instance;
    const Tangent *weights;
    const double *of_states; /* the weights of states */
    bool moving;             /* is there a weight of what equations_tangent gives? */
    Seed *seed;              /* 0 everywhere */
    Tangent *tangent;
} Columns;

/* results[count]: the weighted derivative along each of the knowns whose places in the seed are seeds[count]. */
static bool columns_weighted(const Columns *columns, double seeds[], double results[], int count) {
    const Tangent *weights = columns->weights, *tangent = columns->tangent;
    for (int i = 0; i < count; i++) {
        memset(columns->seed, 0, sizeof *columns->seed);
        seeds[i] = 1.0;
        if (!equations_settle_seed(columns->instance, columns->seed)) {
            return false;
        }
        equations_dependent_tangent(columns->instance, columns->seed, columns->tangent);
        if (columns->moving && !equations_tangent(columns->instance, columns->seed, columns->tangent)) {
            return false;
        }
        if (columns->moving) {
            equations_locals_tangent(columns->instance, columns->seed, columns->tangent);
        }
        results[i] = weighted_sum(columns->of_states, columns->seed->states, N_STATES) +
                     weighted_sum(weights->dependent, tangent->dependent, N_DEPENDENT) +
                     weighted_sum(weights->accelerations, tangent->accelerations, N_UNKNOWNS) +
                     weighted_sum(weights->further, tangent->further, N_FURTHER) +
                     weighted_sum(weights->locals, tangent->locals, N_LOCALS);
    }
    return true;
}

bool equations_adjoint(Instance *instance, const Tangent *weights, Seed *sensitivity) {
    if (!equations_settle(instance)) {
        return false;
    }
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Seed, seed);
    WORK_OF(mark, Tangent, tangent);
    WORK(mark, double, of_states, N_STATES);
    memset(tangent, 0, sizeof *tangent);
    memcpy(of_states, sensitivity->states, N_STATES * sizeof(double));
    const bool moving = has_weight(weights->accelerations, N_UNKNOWNS) || has_weight(weights->further, N_FURTHER) ||
                        has_weight(weights->locals, N_LOCALS);
    const Columns columns = {instance, weights, of_states, moving, seed, tangent};
    return arena_leave(mark, columns_weighted(&columns, &seed->time, &sensitivity->time, 1) &&
                                 columns_weighted(&columns, seed->states, sensitivity->states, N_STATES) &&
                                 columns_weighted(&columns, seed->inputs, sensitivity->inputs, N_SIGNALS) &&
                                 columns_weighted(&columns, seed->parameters, sensitivity->parameters, N_PARAMETERS));
}
