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
    const double *inputs = inputs_at(instance, time), *parameters = instance->state.parameters;
    System *system = &instance->scratch.system;
    double unknowns[N_UNKNOWNS], changed[N_UNKNOWNS], rates[SIZE_FURTHER], change[N_RESIDUALS];
    if (!accelerations_at(instance, time, states, inputs, unknowns) ||
        !system_factorize(instance, time, states, inputs, N_CONSTRAINTS, 0.0, system)) {
        return false;
    }
    memset(jacobian, 0, N_STATES * N_RATES * sizeof(double));
    for (int colour = 0; colour < N_COLOURS; colour++) {
        const int *column = COLOURS[colour];
        Seed seed = {.time = 0.0};
        for (int i = 0; i < N_RATES; i++) {
            if (column[i] >= 0) {
                seed.states[column[i]] = 1.0;
            }
        }
        mechanism_residual_tangent(time, states, inputs, parameters, unknowns, seed.time, seed.states, seed.inputs,
                                   seed.parameters, change);
        system_answer(system, change, changed);
        contacts_answer(instance, system, time, states, inputs, unknowns, &seed, changed);
        further_tangent(instance, time, states, inputs, unknowns, &seed, changed, rates);
        for (int i = 0; i < N_RATES; i++) {
            if (column[i] >= 0) {
                jacobian[column[i] * N_RATES + i] = i < N_COORDINATES ? changed[i] : rates[i - N_COORDINATES];
            }
        }
    }
    return true;
}
