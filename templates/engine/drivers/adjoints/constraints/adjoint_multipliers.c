/* multipliers_spread_rates backwards. What it takes from a tangent of the residual for each row, matrices M and G times
   vectors, is here one sweep: the derivatives of the sums of their entries with weights. */
#include <string.h>

#include "accelerations.h"
#include "adjoint_parts.h"
#include "constraint_factorization.h"
#include "seeds.h"
#include "system.h"

/* Weights of the entries of M (lower triangle) and G. */
typedef struct {
    double mass[N * N];
    double jacobian[K * N];
} Entries;

/* constraints_spread: scale^2 G (G^T ...)^+ G^T, symmetric but for the scale. */
static void spread_adjoint(Arena *arena, const ConstraintFactorization *f, double multipliers[]) {
    for (int k = 0; k < K; k++) {
        multipliers[k] *= f->scale[k] > 0.0 ? f->scale[k] * f->scale[k] : 1.0;
    }
    constraints_spread(arena, f, multipliers);
    for (int k = 0; k < K; k++) {
        multipliers[k] /= f->scale[k] > 0.0 ? f->scale[k] * f->scale[k] : 1.0;
    }
}

void multipliers_spread_adjoint(const Instance *instance, double unknowns[], Spread *spread) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, rates, N_UNKNOWNS);
    WORK(mark, double, change, N_UNKNOWNS);
    const System *system = &instance->cache.system;
    double *multipliers = unknowns + N;
    spread->unique = multipliers_unique(instance);
    if (spread->unique) {
        arena_release(mark);
        return;
    }
    memcpy(spread->own, multipliers, sizeof spread->own);
    spread_adjoint(instance->arena, &system->constraints, multipliers);
    memcpy(rates + N, multipliers, K * sizeof(double));
    system_answer_adjoint(system, rates, change);
    memcpy(spread->exchange, change, sizeof spread->exchange);
    for (int k = 0; k < K; k++) {
        spread->own[k] -= multipliers[k];
    }
    arena_release(mark);
}

/* own_rates: the weights of squares dG w - ds/s multiplier. */
static void add_own(const Instance *instance, const Spread *spread, Entries *entries) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, w, N);
    WORK(mark, double, forces, K);
    WORK(mark, double, weights, K);
    const ConstraintFactorization *f = &instance->cache.system.constraints;
    const double *multipliers = instance->cache.reported + N;
    for (int k = 0; k < K; k++) {
        forces[k] = f->scale[k] > 0.0 ? multipliers[k] / (f->scale[k] * f->scale[k]) : 0.0;
    }
    constraints_solve(instance->arena, f, forces, NULL, weights);
    constraints_respond(f, weights, w);
    for (int k = 0; k < K; k++) {
        const double *row = f->response + k * N;
        const double weight = f->scale[k] * f->scale[k] * spread->own[k], ds = -weight * multipliers[k];
        for (int i = 0; i < N; i++) {
            entries->jacobian[k * N + i] += weight * w[i] + 2.0 * ds * row[i];
            for (int j = 0; j <= i; j++) {
                entries->mass[i * N + j] -= (i == j ? 1.0 : 2.0) * ds * row[i] * row[j];
            }
        }
    }
    arena_release(mark);
}

void multipliers_spread_knowns(const Instance *instance, const Spread *spread, const double change[],
                               Seed *sensitivity) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Entries, entries);
    WORK_OF(mark, Seed, term);
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    memset(term, 0, sizeof *term);
    if (spread->unique) {
        arena_release(mark);
        return;
    }
    memset(entries, 0, sizeof *entries);
    for (int k = 0; k < K; k++) {
        const double difference = cache->reported[N + k] - cache->accelerations[N + k];
        for (int i = 0; i < N; i++) {
            entries->jacobian[k * N + i] -= difference * (spread->exchange[i] - change[i]);
        }
    }
    add_own(instance, spread, entries);
    mechanism_matrices_adjoint(state->time, state->states, state->inputs, state->parameters, entries->mass,
                               entries->jacobian, &term->time, term->states, term->inputs, term->parameters);
    seed_add(sensitivity, term);
    arena_release(mark);
}
