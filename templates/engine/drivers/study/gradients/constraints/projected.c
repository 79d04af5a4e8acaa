/* directions_project backwards: velocities first, then positions. */
#include <string.h>

#include "adjoint_constraints.h"
#include "adjoint_parts.h"
#include "inputs.h"
#include "seeds.h"
#include "system.h"
#include "tape.h"

/* One level: by its last operation the states move by the answer to the residuals of some rows. */
static bool level_back(Tape *tape, double time, const double point[], bool positions, Seed *found) {
    Variations *variations = tape->variations;
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK_ZEROS(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, change, N_RESIDUALS);
    WORK_ZEROS(mark, double, rows, SIZE_CONSTRAINTS);
    WORK_ZEROS(mark, double, nothing, SIZE_CONSTRAINTS);
    Instance *probe = &variations->probe;
    System *system = &probe->scratch.system;
    const int count = positions ? N_HOLONOMIC : N_CONSTRAINTS;
    if (!system_factorize(probe, time, point, probe->state.inputs, count, 0.0, system)) {
        variations->study.instance.failure = probe->failure;
        return arena_leave(mark, false);
    }
    memcpy(unknowns, found->states + (positions ? 0 : N_COORDINATES), N_COORDINATES * sizeof(double));
    system_answer_adjoint(system, unknowns, change);
    memcpy(rows, change + N_COORDINATES, (size_t)count * sizeof(double));
    add_constraints_adjoint(probe, positions ? rows : nothing, positions ? nothing : rows, found);
    return arena_leave(mark, true);
}

bool tape_project_back(Tape *tape, double time, const double point[], double states[]) {
    Variations *variations = tape->variations;
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK_OF(mark, Seed, found);
    State *state = &variations->probe.state;
    state->time = time;
    memcpy(state->inputs, inputs_at(&variations->study.instance, time), N_SIGNALS * sizeof(double));
    memcpy(state->states, point, N_STATES * sizeof(double));
    instance_forget_cache(&variations->probe);
    memset(found, 0, sizeof *found);
    memcpy(found->states, states, N_STATES * sizeof(double));
    if (!level_back(tape, time, point, false, found) ||
        (N_HOLONOMIC > 0 && !level_back(tape, time, point, true, found))) {
        return arena_leave(mark, false);
    }
    memcpy(states, found->states, N_STATES * sizeof(double));
    memset(found->states, 0, sizeof found->states);
    seed_add(&tape->total, found);
    return arena_leave(mark, true);
}
