/* For tests: the whole Jacobian at the present point of an instance, by tangents and by adjoints. */
#include <string.h>

#include "adjoint.h"
#include "component.h"
#include "equations.h"
#include "values.h"

__attribute__((visibility("default"))) int probe_knowns(int references[]);
__attribute__((visibility("default"))) int probe_unknowns(int references[]);
__attribute__((visibility("default"))) int probe_tangents(void *component, double jacobian[]);
__attribute__((visibility("default"))) int probe_adjoints(void *component, double jacobian[]);
__attribute__((visibility("default"))) int probe_element_modes(void *component, int modes[]);

/* The references of all knowns; returns their number. */
int probe_knowns(int references[]) {
    Seed seed;
    int count = 0;
    for (int i = 0; i < N_VARIABLES; i++) {
        if (value_in_seed(&seed, &VARIABLES[i]) != NULL) {
            references[count++] = i;
        }
    }
    return count;
}

int probe_unknowns(int references[]) {
    int count = 0;
    for (int i = 0; i < N_VARIABLES; i++) {
        if (value_is_unknown(VARIABLES[i].kind)) {
            references[count++] = i;
        }
    }
    return count;
}

/* jacobian[unknown][known], as fmi2GetDirectionalDerivative calculates it; false if that fails. */
int probe_tangents(void *component, double jacobian[]) {
    static int knowns[N_VARIABLES], unknowns[N_VARIABLES];
    const int width = probe_knowns(knowns), height = probe_unknowns(unknowns);
    Instance *instance = &((Component *)component)->instance;
    for (int k = 0; k < width; k++) {
        Seed seed;
        Tangent tangent;
        memset(&seed, 0, sizeof seed);
        *value_in_seed(&seed, &VARIABLES[knowns[k]]) = 1.0;
        if (!equations_settle(instance) || !equations_settle_seed(instance, &seed)) {
            return 0;
        }
        equations_dependent_tangent(instance, &seed, &tangent);
        if (!equations_tangent(instance, &seed, &tangent)) {
            return 0;
        }
        equations_locals_tangent(instance, &seed, &tangent);
        for (int i = 0; i < height; i++) {
            jacobian[i * width + k] = *value_in_tangent(&seed, &tangent, &VARIABLES[unknowns[i]]);
        }
    }
    return 1;
}

int probe_adjoints(void *component, double jacobian[]) {
    static int knowns[N_VARIABLES], unknowns[N_VARIABLES];
    const int width = probe_knowns(knowns), height = probe_unknowns(unknowns);
    Instance *instance = &((Component *)component)->instance;
    for (int i = 0; i < height; i++) {
        Seed sensitivity;
        Tangent weights;
        memset(&sensitivity, 0, sizeof sensitivity);
        memset(&weights, 0, sizeof weights);
        double *weight = adjoint_weight(&weights, &sensitivity, &VARIABLES[unknowns[i]]);
        if (weight != NULL) {
            *weight = 1.0;
        }
        if (!equations_adjoint(instance, &weights, &sensitivity)) {
            return 0;
        }
        for (int k = 0; k < width; k++) {
            jacobian[i * width + k] = *value_in_seed(&sensitivity, &VARIABLES[knowns[k]]);
        }
    }
    return 1;
}

int probe_element_modes(void *component, int modes[]) {
    const State *state = &((Component *)component)->instance.state;
    for (int i = 0; i < SIZE_ELEMENTS; i++) {
        modes[i] = (int)state->modes[i];
    }
    return SIZE_ELEMENTS;
}
