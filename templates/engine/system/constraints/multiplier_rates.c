/* Derivatives of the multipliers of redundant constraints, which are of least norm. */
#include <string.h>

#include "accelerations.h"
#include "constraint_factorization.h"
#include "system.h"

/* tangents[n + m] = [dM a - dG^T multipliers, dG a] along the seed, with unknowns[n + m] = [a, multipliers]: what these
   add to still[n + m], the tangent of the residual where all of them are 0. */
static void matrix_tangents(const Instance *instance, const Seed *seed, const double unknowns[], const double still[],
                            double tangents[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N_RESIDUALS);
    const State *state = &instance->state;
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters, unknowns, seed->time,
                               seed->states, seed->inputs, seed->parameters, change);
    for (int i = 0; i < N_UNKNOWNS; i++) {
        tangents[i] = change[i] - still[i];
    }
    arena_release(mark);
}

/* Adds what rates[m] of the multipliers of the accelerations lack for those that are reported, G being another one:
   the change of their forces G^T multiplier is the same. */
static void add_exchange(const Instance *instance, const Seed *seed, const double still[], double rates[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, tangents, N_UNKNOWNS);
    WORK_ZEROS(mark, double, change, N_UNKNOWNS);
    const Cache *cache = &instance->cache;
    for (int k = N_COORDINATES; k < N_UNKNOWNS; k++) {
        unknowns[k] = cache->reported[k] - cache->accelerations[k];
    }
    matrix_tangents(instance, seed, unknowns, still, tangents);
    memcpy(change, tangents, N_COORDINATES * sizeof(double));
    system_answer(&cache->system, change, unknowns);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        rates[k] += unknowns[N_COORDINATES + k];
    }
    arena_release(mark);
}

/* ds of row k, see own_rates. */
static double square_rate(const Instance *instance, const Seed *seed, const double still[], int k) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, row, N_UNKNOWNS);
    WORK(mark, double, tangents, N_UNKNOWNS);
    const double *response = instance->cache.system.constraints.response + k * N_COORDINATES; /* M^-1 g */
    memcpy(row, response, N_COORDINATES * sizeof(double));
    matrix_tangents(instance, seed, row, still, tangents);
    double ds = 2.0 * tangents[N_COORDINATES + k];
    for (int i = 0; i < N_COORDINATES; i++) {
        ds -= row[i] * tangents[i];
    }
    arena_release(mark);
    return ds;
}

/* own[m] = squares dG w - ds/s multiplier with 1/squares = s = g M^-1 g^T, g the row of G: how the multipliers
   squares G w change that are reported, w and the forces being as they are. */
static void own_rates(const Instance *instance, const Seed *seed, const double still[], double own[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, w, N_UNKNOWNS);
    WORK(mark, double, tangents, N_UNKNOWNS);
    WORK(mark, double, weights, N_CONSTRAINTS);
    const ConstraintFactorization *f = &instance->cache.system.constraints;
    const double *multipliers = instance->cache.reported + N_COORDINATES;
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        own[k] = f->scale[k] > 0.0 ? multipliers[k] / (f->scale[k] * f->scale[k]) : 0.0;
    }
    constraints_solve(instance->arena, f, own, NULL, weights);
    constraints_respond(f, weights, w);
    matrix_tangents(instance, seed, w, still, tangents);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        const double scale = f->scale[k];
        own[k] = scale > 0.0 ? scale * scale * (tangents[N_COORDINATES + k] -
                                                square_rate(instance, seed, still, k) * multipliers[k])
                             : 0.0; /* open contacts cost nothing */
    }
    arena_release(mark);
}

/* The reported multipliers are scale^2 G w, and their rates own rates + scale^2 G dw. Golub, Pereyra, The
   differentiation of pseudo-inverses and nonlinear least squares problems whose variables separate, SIAM Journal on
   Numerical Analysis 10, 1973. */
void multipliers_spread_rates(const Instance *instance, const Seed *seed, double unknowns[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, still, N_UNKNOWNS);
    WORK(mark, double, own, N_CONSTRAINTS);
    static const double NOTHING[N_UNKNOWNS] = {0.0};
    double *rates = unknowns + N_COORDINATES;
    if (multipliers_unique(instance)) {
        arena_release(mark);
        return;
    }
    matrix_tangents(instance, seed, NOTHING, NOTHING, still);
    add_exchange(instance, seed, still, rates);
    own_rates(instance, seed, still, own);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        rates[k] -= own[k];
    }
    constraints_spread(instance->arena, &instance->cache.system.constraints, rates);
    for (int k = 0; k < N_CONSTRAINTS; k++) {
        rates[k] += own[k];
    }
    arena_release(mark);
}
