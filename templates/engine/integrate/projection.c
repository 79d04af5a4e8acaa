#include "projection.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "constraints.h"
#include "derivative.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"

bool project(Instance *instance, double time, double states[], bool *moved) {
    return constraints_project(instance, time, inputs_at(instance, time), states, moved);
}

bool bring_back(Instance *instance, double time, double states[], double derivatives[]) {
    bool moved;
    return project(instance, time, states, &moved) &&
           (!moved || derivative_at(instance, time, states, derivatives));
}

bool bring_back_result(Instance *instance, Step step) {
    Scratch *scratch = &instance->scratch;
    memcpy(scratch->unprojected, scratch->new_states, sizeof scratch->unprojected);
    const bool waits = REAL_TIME && DBL_DIG > 10 && step.end < scratch->step_end;
    return waits || METHOD.variational || TIME_STEPPING ||
           bring_back(instance, step.end, scratch->new_states, scratch->new_derivatives);
}

/* Does a step end near a singular position? What rows that are held or lost there leave off is taken away behind it,
   and the rounding of the states counts for more. A contact that pushes there may come to a dead centre. */
static bool leaves_off(const Instance *instance) {
    const ConstraintFactorization *f = &instance->scratch.system.constraints;
    const bool lost = f->rows == N_CONSTRAINTS && instance->state.rows_known && f->rank < instance->state.rows.rank;
    const bool near = constraints_firmness(instance, &instance->scratch.system) <= CLEARLY_INDEPENDENT;
    return N_UNILATERALS == 0 && (f->holding || lost || near);
}

/* Shorter steps tell an adaptive method whether a projection comes from a kink, unless a motion that is given from
   outside jumps, or the step ends near a singular position. A step of one length may be coarse, and be moved far
   without a kink; a step in real time has no time to find out. */
static bool is_kink(Instance *instance, Step step, bool projected) {
    const double *inputs = inputs_at(instance, step.end), bar = DRIFT * solver_tolerance(&instance->state);
    const double *from = instance->state.states, *to = instance->scratch.unprojected;
    const bool tells = METHOD.error_order > 0 && N_MOTIONS == 0 && !leaves_off(instance);
    return (projected && tells) ||
           (!REAL_TIME && constraints_jump(instance, step.end, inputs, from, to, bar));
}

/* Implicit methods, whose stages may meet the constraints, need no projection behind a kink. There a velocity changes
   otherwise than by the mean of the accelerations at both ends. */
static double leap_of(const Instance *instance, Step step, int i) {
    const double change = instance->scratch.new_states[i] - instance->state.states[i];
    const double rates = instance->state.first_stage[i] + instance->scratch.new_derivatives[i];
    const bool concerns = METHOD.stability == 0.0 && i >= N && i < 2 * N;
    return concerns ? fabs(change - 0.5 * step.length * rates) : 0.0;
}

bool passes_kink(Instance *instance, Step step) {
    const Scratch *scratch = &instance->scratch;
    const double tolerance = solver_tolerance(&instance->state);
    for (int i = 0; i < N_STATES && N_CONSTRAINTS > 0 && !TIME_STEPPING; i++) {
        const double projected = fabs(scratch->new_states[i] - scratch->unprojected[i]);
        const double moved = fmax(projected, leap_of(instance, step, i));
        const double weight = tolerance * (fabs(scratch->unprojected[i]) + NOMINAL_STATES[i]);
        if (moved > DRIFT * weight) {
            Failure *failure = &instance->failure;
            if (!is_kink(instance, step, projected > DRIFT * weight)) {
                return false;
            }
            failure->kind = FAILURE_KINK;
            failure->time = instance->state.time;
            failure->state = i;
            failure->amount = moved / weight;
            failure->step = step.length;
            return true;
        }
    }
    return false;
}
