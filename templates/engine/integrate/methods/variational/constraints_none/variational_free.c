/* Variational integrators without constraints. */
#include "system.h"
#include "variational.h"

void stages_guess_multipliers(const System *system, Stages *stages) {
    (void)system;
    (void)stages;
}

void stages_constrain(Instance *instance, Step step, Stages *stages) {
    (void)instance;
    (void)step;
    (void)stages;
}

double stages_reaction(const Stages *stages, int i, int coordinate) {
    (void)stages;
    (void)i;
    (void)coordinate;
    return 0.0;
}

void stages_meet_constraints(const System *system, double h, Stages *stages, double changes[STAGES][N_UNKNOWNS]) {
    (void)system;
    (void)h;
    (void)stages;
    (void)changes;
}

void stages_end_step(Instance *instance, double time, const double missing[], double states[], double impulse[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, change, N);
    (void)time;
    (void)impulse;
    system_solve(&instance->scratch.system, missing, NULL, NULL, change);
    for (int k = 0; k < N; k++) {
        states[N + k] += change[k];
    }
    arena_release(mark);
}

bool mass_regular(Instance *instance, double time, const double states[], const System *system) {
    (void)instance;
    (void)time;
    (void)states;
    (void)system;
    return true;
}

bool new_states_on_constraints(Instance *instance, Step step) {
    (void)instance;
    (void)step;
    return true;
}
