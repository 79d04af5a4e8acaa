/* directions_project backwards: velocities first, then positions. */
#include <string.h>

#include "adjoint_constraints.h"
#include "adjoint_parts.h"
#include "correction.h"
#include "inputs.h"
#include "seeds.h"
#include "system.h"
#include "tape.h"

/* correction_answer: c[n] and rows[m] for weights[n] of the change, which are overwritten. */
static void answer_back(const System *system, const Correction *correction, double weights[], double c[],
                        double rows[]) {
    const ArenaMark mark = arena_mark(system->arena);
    WORK_ZEROS(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, change, N_RESIDUALS);
    memset(rows, 0, SIZE_CONSTRAINTS * sizeof(double));
    for (int left = correction_solutions(correction); left > 0; left--) {
        memcpy(unknowns, weights, N_COORDINATES * sizeof(double));
        system_answer_adjoint(system, unknowns, change);
        for (int k = 0; k < rows_of(correction->level); k++) {
            rows[k] += change[N_COORDINATES + k];
            for (int i = 0; i < N_COORDINATES && left > 1; i++) {
                weights[i] += correction->values.jacobian[k * N_COORDINATES + i] * change[N_COORDINATES + k];
            }
        }
    }
    memcpy(c, change, N_COORDINATES * sizeof(double));
    arena_release(mark);
}

/* Adds what weights[n] of c give. */
static void tilt_back(const Instance *probe, const Correction *correction, const double weights[], Seed *sensitivity) {
    const ArenaMark mark = arena_mark(probe->arena);
    WORK_ZEROS(mark, double, change, N_RESIDUALS);
    WORK_ZEROS(mark, double, of_further, SIZE_FURTHER);
    WORK_OF(mark, Seed, term);
    static const double ZERO[N_UNKNOWNS] = {0.0};
    const State *state = &probe->state;
    for (int less = 0; less < 2 && correction->moved; less++) {
        memset(term, 0, sizeof *term);
        for (int i = 0; i < N_COORDINATES; i++) {
            change[i] = less ? -weights[i] : weights[i];
        }
        mechanism_adjoint(state->time, correction->at, state->inputs, state->parameters,
                          less ? ZERO : correction->unknowns, change, of_further, &term->time, term->states,
                          term->inputs, term->parameters);
        seed_add(sensitivity, term);
    }
    arena_release(mark);
}

/* One level: derivatives by the states before the projection are added to those of `before` where W is theirs. */
static bool level_back(Tape *tape, const double from[], const double to[], Level level, Seed *found, Seed *before) {
    Variations *variations = tape->variations;
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, weights, N_COORDINATES);
    WORK(mark, double, c, N_COORDINATES);
    WORK(mark, double, rows, SIZE_CONSTRAINTS);
    WORK_ZEROS(mark, double, nothing, SIZE_CONSTRAINTS);
    WORK_OF(mark, Correction, correction);
    Instance *probe = &variations->probe;
    if (!correction_find(probe, probe->state.time, probe->state.inputs, from, to, level, correction)) {
        variations->study.instance.failure = probe->failure;
        return arena_leave(mark, false);
    }
    memcpy(weights, found->states + (level == POSITIONS ? 0 : N_COORDINATES), N_COORDINATES * sizeof(double));
    answer_back(&probe->scratch.system, correction, weights, c, rows);
    add_constraints_adjoint(probe, level == POSITIONS ? rows : nothing, level == POSITIONS ? nothing : rows, found);
    tilt_back(probe, correction, c, correction_keeps(level) ? before : found);
    return arena_leave(mark, true);
}

bool tape_project_back(Tape *tape, double time, const double from[], const double to[], double states[]) {
    Variations *variations = tape->variations;
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK_OF(mark, Seed, found);
    WORK_OF(mark, Seed, before);
    State *state = &variations->probe.state;
    state->time = time;
    memcpy(state->inputs, inputs_at(&variations->study.instance, time), N_SIGNALS * sizeof(double));
    memmove(state->states, to, N_STATES * sizeof(double));
    instance_forget_cache(&variations->probe);
    memset(found, 0, sizeof *found);
    memset(before, 0, sizeof *before);
    memcpy(found->states, states, N_STATES * sizeof(double));
    if (!level_back(tape, from, state->states, VELOCITIES, found, before) ||
        (N_HOLONOMIC > 0 && !level_back(tape, from, state->states, POSITIONS, found, before))) {
        return arena_leave(mark, false);
    }
    seed_add(found, before);
    memcpy(states, found->states, N_STATES * sizeof(double));
    memset(found->states, 0, sizeof found->states);
    seed_add(&tape->total, found);
    return arena_leave(mark, true);
}
