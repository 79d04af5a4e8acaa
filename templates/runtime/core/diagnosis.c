/* Looking at the mass matrix where something goes wrong. */
#include "diagnosis.h"

#include <math.h>

#include "failure.h"
#include "mass_matrix.h"
#include "massless.h"

enum { N = N_COORDINATES };

/* A pivot that far below the largest one explains why a solver cannot go on. */
static const double EXPLAINS = 1e-6;

/* A pivot that far below the largest one may become the reason. */
static const double FORETELLS = 1e-4;

/* The reason is near where velocities change by their size that often in a usual solver step. */
static const double SUDDEN = 10.0;

void explain_failure(Instance *instance) {
    bool concerned[N_COORDINATES] = {false};
    if (instance->failure.kind == FAILURE_ACCURACY && mass_about_to_vanish(instance, EXPLAINS, concerned)) {
        report_coordinates(instance, FAILURE_SINGULAR, instance->state.time, concerned);
    }
    massless_explain_failure(instance);
}

bool runs_into_singularity(Instance *instance, const double accelerations[]) {
    const double *velocities = instance->state.states + N;
    bool concerned[N_COORDINATES] = {false};
    bool sudden = false;
    for (int i = 0; i < N; i++) {
        const double usual = (fabs(velocities[i]) + NOMINAL_STATES[N + i]) / DEFAULT_SOLVER_STEP;
        sudden = sudden || fabs(accelerations[i]) > SUDDEN * usual;
    }
    return sudden && mass_about_to_vanish(instance, FORETELLS, concerned) &&
           !report_coordinates(instance, FAILURE_NEARLY_SINGULAR, instance->state.time, concerned);
}
