/* How a start at which something touches at rest, rubs or is latched answers to what is varied. A touching body is
   lifted a little, or falls, and comes back by impacts; a slip that is to be 0 ends by friction; a latch catches. Their
   sum takes from S what the rows G of what holds do not let be,

       dS = M^-1 G^T L,   G (S + dS) + phi_p dp = 0,

   for velocities and, as they are those of the way back, for positions. What slides rubs with each L. A latch holds the
   position in which it catches. */
#include <string.h>

#include "contact_modes.h"
#include "contacts.h"
#include "directions.h"
#include "element_rows.h"
#include "equations.h"
#include "system.h"

/* residuals[n + m and more]: the derivatives along a seed of all rows of equations at the present point. */
static void look(const Instance *instance, const Seed *seed, double residuals[]) {
    const State *state = &instance->state;
    mechanism_residual_tangent(state->time, state->states, state->inputs, state->parameters,
                               instance->cache.accelerations, seed->time, seed->states, seed->inputs, seed->parameters,
                               residuals);
}

/* Latches that hold from here on remember positions; they move with what is varied. */
static void remember_positions(const Variations *variations, Seed *seed) {
    const Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, residuals, N_RESIDUALS);
    look(instance, seed, residuals);
    for (int i = 0; i < N_OFFSETS; i++) {
        const int row = FIRST_LATCH + i;
        if (row_active(&instance->state, row) && !row_active(&variations->before.state, row)) {
            seed->parameters[FIRST_OFFSET + i] += residuals[N_UNKNOWNS + N_CONSTRAINTS + ROW_PLACES[row]];
        }
    }
    arena_release(mark);
}

/* Takes a level of a seed, its first `rows` rows of equations, whose derivatives begin at `first`, onto them. */
static void land(Instance *instance, int rows, int first, double level[], const Seed *seed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, residuals, N_RESIDUALS);
    WORK_ZEROS(mark, double, change, N_UNKNOWNS);
    WORK(mark, double, answer, N_UNKNOWNS);
    static const Seed STILL;
    const State *state = &instance->state;
    const Cache *cache = &instance->cache;
    look(instance, seed, residuals);
    memcpy(change + N, residuals + first, (size_t)rows * sizeof(double));
    system_answer(&cache->system, change, answer);
    contacts_answer(instance, &cache->system, state->time, state->states, state->inputs, cache->accelerations, &STILL,
                    answer);
    for (int i = 0; i < N; i++) {
        level[i] += answer[i];
    }
    arena_release(mark);
}

bool directions_land(Variations *variations) {
    Instance *instance = &variations->study.instance;
    if (!equations_accelerations(instance) || !equations_factorize(instance)) {
        return study_explain(&variations->study);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        Seed *seed = &direction->seed;
        remember_positions(variations, seed);
        land(instance, N_HOLONOMIC, N_UNKNOWNS + N_CONSTRAINTS, seed->states, seed);
        land(instance, N_CONSTRAINTS, N_UNKNOWNS, seed->states + N, seed);
        memcpy(direction->states, seed->states, sizeof direction->states);
    }
    return true;
}
