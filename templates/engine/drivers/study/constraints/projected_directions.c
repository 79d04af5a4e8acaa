#include <string.h>

#include "correction.h"
#include "directions.h"
#include "inputs.h"
#include "system.h"

/* c[n] of the correction along a direction. */
static void tilt(const Variations *variations, double time, const double inputs[], const Correction *correction,
                 const Direction *direction, double c[]) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, along, N_STATES);
    WORK(mark, double, with, N_RESIDUALS);
    WORK(mark, double, without, N_RESIDUALS);
    static const double ZERO[N_UNKNOWNS] = {0.0};
    const Seed *seed = &direction->seed;
    const double *parameters = variations->study.instance.state.parameters;
    memset(c, 0, N_COORDINATES * sizeof(double));
    if (!correction->moved) {
        arena_release(mark);
        return;
    }
    memcpy(along, seed->states, N_STATES * sizeof(double));
    if (correction_keeps(correction->level)) {
        memcpy(along, direction->unprojected, N_COORDINATES * sizeof(double));
    }
    mechanism_residual_tangent(time, correction->at, inputs, parameters, correction->unknowns, seed->time, along,
                               seed->inputs, seed->parameters, with);
    mechanism_residual_tangent(time, correction->at, inputs, parameters, ZERO, seed->time, along, seed->inputs,
                               seed->parameters, without);
    for (int i = 0; i < N; i++) {
        c[i] = with[i] - without[i];
    }
    arena_release(mark);
}

/* One level of directions_project: positions by the first rows, the holonomic ones, or velocities by all rows. */
static bool project_level(Variations *variations, double time, const double from[], const double to[], Level level) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, inputs, N_SIGNALS);
    WORK(mark, double, c, N_COORDINATES);
    WORK(mark, double, change, N_COORDINATES);
    WORK(mark, double, residuals, N_RESIDUALS);
    WORK_OF(mark, Correction, correction);
    static const double ZERO[N_UNKNOWNS] = {0.0};
    const int first = N_UNKNOWNS + (level == POSITIONS ? N_CONSTRAINTS : 0);
    Instance *instance = &variations->study.instance;
    memcpy(inputs, inputs_at(instance, time), N_SIGNALS * sizeof(double));
    if (!correction_find(instance, time, inputs, from, to, level, correction)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        Seed *seed = &variations->directions[d].seed;
        tilt(variations, time, inputs, correction, &variations->directions[d], c);
        mechanism_residual_tangent(time, to, inputs, instance->state.parameters, ZERO, seed->time, seed->states,
                                   seed->inputs, seed->parameters, residuals);
        correction_answer(&instance->scratch.system, correction, c, residuals + first, change);
        for (int i = 0; i < N; i++) {
            seed->states[(level == POSITIONS ? 0 : N) + i] += change[i];
        }
    }
    return arena_leave(mark, true);
}

bool directions_project(Variations *variations, double time, const double from[], const double to[]) {
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->unprojected, direction->seed.states, sizeof direction->unprojected);
    }
    return (N_HOLONOMIC == 0 || project_level(variations, time, from, to, POSITIONS)) &&
           project_level(variations, time, from, to, VELOCITIES);
}
