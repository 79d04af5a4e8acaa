/* By tangents along groups of states that do not meet. Columns of the Jacobian whose rows do not meet are one colour
   and share a seed: COLOURS[colour][i] is the one that has an entry in row i, -1 if none has. Curtis, Powell, Reid, On
   the estimation of sparse Jacobian matrices, IMA Journal of Applied Mathematics 13, 1974. */
#include "jacobian.h"

#include <string.h>

#include "accelerations.h"
#include "contacts.h"
#include "further.h"
#include "inputs.h"
#include "system.h"

bool equations_jacobian(Instance *instance, double time, const double states[], double jacobian[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, changed, N_UNKNOWNS);
    WORK(mark, double, rates, SIZE_FURTHER);
    WORK(mark, double, change, N_RESIDUALS);
    WORK_OF(mark, Seed, seed);
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    System *system = &instance->scratch.system;
    if (!accelerations_at(instance, time, states, inputs, unknowns) ||
        !system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return arena_leave(mark, false);
    }
    memset(jacobian, 0, N_STATES * N_RATES * sizeof(double));
    for (int colour = 0; colour < N_COLOURS; colour++) {
        const int *column = COLOURS[colour];
        memset(seed, 0, sizeof *seed);
        for (int i = 0; i < N_RATES; i++) {
            if (column[i] >= 0) {
                seed->states[column[i]] = 1.0;
            }
        }
        mechanism_residual_tangent(time, states, inputs, parameters, unknowns, seed->time, seed->states, seed->inputs,
                                   seed->parameters, change);
        system_answer(system, change, changed);
        contacts_answer(instance, system, time, states, inputs, unknowns, seed, changed);
        further_tangent(instance, time, states, inputs, unknowns, seed, changed, rates);
        for (int i = 0; i < N_RATES; i++) {
            if (column[i] >= 0) {
                jacobian[column[i] * N_RATES + i] = i < N_COORDINATES ? changed[i] : rates[i - N_COORDINATES];
            }
        }
    }
    return arena_leave(mark, true);
}
