/* Variational integrators in lanes, without constraints; the method, its iteration and its numbers are those of the
   scalar engine, see variational.c there. A lane whose iteration has ended rests while its neighbours go on. */
#include <math.h>

#include "lane_equations.h"
#include "lane_group.h"

enum { S = STAGES, MOST_ITERATIONS = 100 };

static const double CONVERGED = 1e-9; /* relative changes below this may stay as they are, by rounding */
static const double RESTING_REACH = 16.0 * 2.220446049250313e-16 / 1e-9;

/* The velocities at the stages, and what follows from them: states, momenta dL/dqd, forces F. */
typedef struct {
    Lanes velocities[S][N];
    Lanes further[S][N_FURTHER + 1];
    Lanes rates[S][N_FURTHER + 1];
    Lanes states[S][N_STATES];
    Lanes momenta[S][N];
    Lanes forces[S][N];
} Stages;

static void canonical(const Group *group, Lanes time, const Lanes states[], Lanes momenta[], Lanes forces[]) {
    Lanes inputs[SIZE_SIGNALS];
    group_inputs(group, time, inputs);
    lanes_canonical(time, states, inputs, group->parameters, momenta, forces);
}

/* What solving with M at a time (s) and states takes. Lanes where M is singular become lost. */
static void factorize_mass(Group *group, Mask mask, Lanes time, const Lanes states[], Lanes factor[]) {
    Lanes inputs[SIZE_SIGNALS], pivots[N];
    group_inputs(group, time, inputs);
    lanes_factor(time, states, inputs, group->parameters, factor, pivots);
    for (int i = 0; i < N; i++) {
        group->lost |= mask & ~(Mask)(pivots[i] > group->least_pivots[i]);
    }
}

static Lanes stage_time(const Group *group, int i) {
    return C[i] == 1.0 ? group->end : group->time + C[i] * group->length;
}

/* sum_j weights[j] rows[j][k] */
#define WEIGHED(sum, weights, rows, k) \
    Lanes sum = (weights)[0] * (rows)[0][k]; \
    for (int j = 1; j < S; j++) { \
        sum += (weights)[j] * (rows)[j][k]; \
    }

/* States, momenta and forces that belong to the velocities and further states. */
static void complete_stages(const Group *group, Stages *stages) {
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            WEIGHED(velocity, A[i], stages->velocities, k)
            stages->states[i][k] = group->states[k] + group->length * velocity;
            stages->states[i][N + k] = stages->velocities[i][k];
        }
        for (int k = 0; k < N_FURTHER; k++) {
            stages->states[i][2 * N + k] = stages->further[i][k];
        }
        canonical(group, stage_time(group, i), stages->states[i], stages->momenta[i], stages->forces[i]);
    }
}

/* The greater of two numbers; NaN and infinity count as greatest. */
static Lanes greater(Lanes greatest, Lanes value) {
    return lanes_select((Mask)(value <= greatest), greatest, value);
}

/* Further states at the stages, moved on by one round in the lanes of a mask; returns the greatest relative change. */
static Lanes correct_further(Group *group, Mask mask, Stages *stages) {
    Lanes greatest = lanes_of(0.0), unknowns[N_UNKNOWNS], derivatives[N_STATES];
    for (int i = 0; i < S && N_FURTHER > 0; i++) {
        group_derivative(group, mask, stage_time(group, i), stages->states[i], unknowns, derivatives);
        for (int k = 0; k < N_FURTHER; k++) {
            lanes_put(&stages->rates[i][k], mask, derivatives[2 * N + k]);
        }
    }
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N_FURTHER; k++) {
            WEIGHED(rate, A[i], stages->rates, k)
            const Lanes z = group->states[2 * N + k] + group->length * rate;
            const Lanes size = lanes_abs(z) + group->batch->nominals[2 * N + k];
            greatest = greater(greatest, lanes_abs(z - stages->further[i][k]) / size);
            lanes_put(&stages->further[i][k], mask, z);
        }
    }
    return greatest;
}

/* One round: each V_i is corrected by M^-1 times what is missing from its momentum, with M at the start of the step, in
   the lanes of a mask. Returns the greatest relative change. */
static Lanes correct_velocities(const Group *group, Mask mask, const Lanes factor[], Stages *stages) {
    const double *nominals = group->batch->nominals;
    Lanes greatest = lanes_of(0.0), changes[S][N], missing[N];
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            WEIGHED(force, HAT[i], stages->forces, k)
            missing[k] = group->memory.momenta[k] + group->length * force - stages->momenta[i][k];
        }
        lanes_solve(factor, missing, changes[i]);
    }
    for (int i = 0; i < S; i++) {
        for (int k = 0; k < N; k++) {
            const Lanes velocity = stages->velocities[i][k] + changes[i][k];
            const Lanes reach = (lanes_abs(stages->states[i][k]) + nominals[k]) / group->length;
            const Lanes size = lanes_abs(velocity) + nominals[N + k] + RESTING_REACH * reach;
            greatest = greater(greatest, lanes_abs(changes[i][k]) / size);
            lanes_put(&stages->velocities[i][k], mask, velocity);
        }
    }
    return greatest;
}

/* Iterates until the changes are rounding errors: until they do not fall any more. Lanes where they do not become
   lost. */
static void solve_stages(Group *group, const Lanes factor[], Stages *stages) {
    Mask open = group->active & ~group->lost;
    Lanes previous = lanes_of(HUGE_VAL);
    for (int i = 0; i < MOST_ITERATIONS && lanes_any(open); i++) {
        complete_stages(group, stages);
        const Lanes further = correct_further(group, open, stages);
        const Lanes change = greater(further, correct_velocities(group, open, factor, stages));
        const Mask done = (Mask)(change == 0.0) | ((Mask)(change <= CONVERGED) & (Mask)(change >= previous));
        const Mask fails = ~done & ~((Mask)(change < 1e3 * previous) & (Mask)(change < HUGE_VAL));
        group->lost |= open & fails;
        open &= ~(done | fails);
        previous = change;
    }
    group->lost |= open;
    complete_stages(group, stages);
}

/* The stages to begin with: as if the accelerations and the further states at the start were constant. */
static void guess_stages(const Group *group, Stages *stages) {
    for (int i = 0; i < S; i++) {
        double share = 0.0;
        for (int j = 0; j < S; j++) {
            share += HAT[i][j];
        }
        for (int k = 0; k < N; k++) {
            stages->velocities[i][k] = group->states[N + k] + share * group->length * group->stages[0][N + k];
        }
        for (int k = 0; k < N_FURTHER; k++) {
            stages->further[i][k] = group->states[2 * N + k];
        }
    }
}

/* Returns x + increment. The error that earlier sums left in rest goes in, and that of this sum comes out. */
static Lanes add_compensated(Lanes x, Lanes increment, Lanes *rest) {
    const Lanes whole = increment + *rest;
    const Lanes sum = x + whole;
    *rest = (x - sum) + whole;
    return sum;
}

/* The velocities at the end, whose momenta are these: M qd + a = p, corrected once for rounding. */
static void find_velocities(Group *group, const Lanes momenta[]) {
    Lanes factor[SIZE_FACTOR], found[N], forces[N], change[N];
    Lanes *states = group->new_states;
    for (int k = 0; k < N; k++) {
        states[N + k] = lanes_of(0.0);
    }
    factorize_mass(group, group->active, group->end, states, factor);
    for (int round = 0; round < 2; round++) {
        canonical(group, group->end, states, found, forces);
        for (int k = 0; k < N; k++) {
            found[k] = momenta[k] - found[k];
        }
        lanes_solve(factor, found, change);
        for (int k = 0; k < N; k++) {
            states[N + k] += change[k];
        }
    }
}

/* A step of this method is never rejected: a lane that cannot take it is lost. So the memory moves on at once. */
Lanes method_try(Group *group) {
    Lanes factor[SIZE_FACTOR], unknowns[N_UNKNOWNS], finite = lanes_of(0.0);
    Memory *memory = &group->memory;
    Stages stages;
    factorize_mass(group, group->active, group->time, group->states, factor);
    guess_stages(group, &stages);
    solve_stages(group, factor, &stages);
    for (int k = 0; k < N; k++) {
        WEIGHED(velocity, B, stages.velocities, k)
        WEIGHED(force, B, stages.forces, k)
        group->new_states[k] =
            add_compensated(group->states[k], group->length * velocity, &memory->rest_coordinates[k]);
        memory->momenta[k] = add_compensated(memory->momenta[k], group->length * force, &memory->rest_momenta[k]);
    }
    for (int k = 0; k < N_FURTHER; k++) {
        WEIGHED(rate, B, stages.rates, k)
        group->new_states[2 * N + k] = group->states[2 * N + k] + group->length * rate;
    }
    find_velocities(group, memory->momenta);
    group_derivative(group, group->active, group->end, group->new_states, unknowns, group->new_derivatives);
    for (int i = 0; i < N_STATES; i++) {
        finite += 0.0 * group->new_derivatives[i] + 0.0 * group->new_states[i];
    }
    return finite;
}

void method_dense(Group *group, Mask mask) {
    (void)group; /* Hermite's cubic is all */
    (void)mask;
}

void method_begin(Group *group, Mask mask) {
    Memory *memory = &group->memory;
    Lanes momenta[N], forces[N];
    canonical(group, group->time, group->states, momenta, forces);
    for (int k = 0; k < N; k++) {
        lanes_put(&memory->momenta[k], mask, momenta[k]);
        lanes_put(&memory->rest_coordinates[k], mask, lanes_of(0.0));
        lanes_put(&memory->rest_momenta[k], mask, lanes_of(0.0));
    }
}
