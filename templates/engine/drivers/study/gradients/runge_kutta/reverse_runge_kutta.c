/* Steps of an explicit Runge-Kutta method backwards. With x+ = x + h sum b_i k_i and k_i = f(x_i), where x_i = x + h
   sum_j a_ij k_j,

       k'_i = h b_i x+' + h sum_j a_ji x'_j,   x'_i = f_x(x_i)^T k'_i,   x' = x+' + sum x'_i,

   where a dash means the derivative by what is in front of it. Samples within the step add theirs, by the interpolant.
   Hager, Runge-Kutta methods in optimal control and the transformed adjoint system, Numer. Math. 87, 2000. */
#include <string.h>

#include "derivative.h"
#include "tableau.h"
#include "tape.h"

/* What h sum w_j k_j has as weights w_j is found with one k_j = 1 in the first state at a time. */
void tape_begin_method(Tape *tape) {
    static const double REST[N_STATES] = {0.0};
    double result[N_STATES], terms[DENSE_TERMS][N_STATES];
    memset(tape->method.stages, 0, sizeof tape->method.stages);
    memset(terms, 0, sizeof terms);
    for (int j = 0; j < STAGES; j++) {
        tape->method.stages[j][0] = 1.0;
        for (int i = j + 1; i <= STAGES; i++) {
            const int row = i < STAGES || !TABLEAU.first_same_as_last ? i : TABLEAU.stages - 1;
            memset(result, 0, sizeof result);
            tableau_states(row, 1.0, REST, (Stages)tape->method.stages, result);
            tape->method.rows[i][j] = row > j ? result[0] : 0.0;
        }
        tableau_dense(1.0, (Stages)tape->method.stages, terms);
        for (int k = HERMITE_TERMS; k < DENSE_TERMS; k++) {
            tape->method.dense[k][j] = terms[k][0];
        }
        tape->method.stages[j][0] = 0.0;
    }
}

static double stage_time(const Entry *entry, int i) {
    return TABLEAU.c[i] == 1.0 ? entry->step.end : entry->time + TABLEAU.c[i] * entry->step.length;
}

/* The states of the first stages of a step, whose slopes come to the memory of the solver. */
static bool stages_again(Tape *tape, const Entry *entry, int first, int end) {
    Instance *instance = &tape->variations->study.instance;
    double(*slopes)[N_STATES] = instance->scratch.solver.stages;
    for (int i = first; i < end; i++) {
        tableau_states(i, entry->step.length, instance->state.states, (Stages)slopes, tape->method.states[i]);
        if ((i + 1 < end || end == STAGES || !TABLEAU.first_same_as_last) &&
            !derivative_at(instance, stage_time(entry, i), tape->method.states[i], slopes[i])) {
            return false;
        }
    }
    return true;
}

/* The samples within a step: derivatives by its first states go to before[], by its last ones to after[], by all slopes
   into the tape. */
static bool samples_back(Tape *tape, const Entry *entry, double before[], double after[]) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, found, N_STATES);
    const double h = entry->step.length;
    Dense *dense = &instance->state.dense;
    dense_begin_cubic(instance, entry->step);
    tableau_dense(h, (Stages)instance->scratch.solver.stages, dense->terms);
    memset(tape->method.terms, 0, sizeof tape->method.terms);
    for (int k = entry->end - 1; k >= entry->first; k--) {
        const double time = tape->request->times[k];
        double factor = (time - dense->start) * dense->rate;
        const double factors[2] = {1.0 - factor, factor};
        dense_states(dense, time, states);
        memset(found, 0, N_STATES * sizeof(double));
        if (!tape_sample_back(tape, k, time, states, found)) {
            return arena_leave(mark, false);
        }
        tape_add_weighted(before, 1.0, found);
        for (int term = 0; term < DENSE_TERMS; term++) {
            tape_add_weighted(tape->method.terms[term], factor, found);
            factor *= factors[term % 2];
        }
    }
    for (int j = 0; j < STAGES; j++) {
        for (int term = HERMITE_TERMS; term < DENSE_TERMS; term++) {
            tape_add_weighted(tape->method.stages[j], h * tape->method.dense[term][j], tape->method.terms[term]);
        }
    }
    double(*terms)[N_STATES] = tape->method.terms; /* of the cubic, see begin_dense */
    tape_add_weighted(terms[0], 1.0, terms[2]);
    tape_add_weighted(terms[1], -1.0, terms[2]);
    tape_add_weighted(terms[0], -1.0, terms[1]);
    tape_add_weighted(tape->method.stages[0], h, terms[1]);
    tape_add_weighted(after, 1.0, terms[0]);
    tape_add_weighted(before, -1.0, terms[0]);
    memset(found, 0, N_STATES * sizeof(double));
    tape_add_weighted(found, -h, terms[2]);
    return arena_leave(mark, tape_slope_back(tape, entry->step.end, instance->scratch.new_states,
                                             instance->scratch.new_derivatives, found, NULL, after));
}

/* The stages backwards, from one behind the last one to the first. */
static bool stages_back(Tape *tape, const Entry *entry, int end, int first, double before[]) {
    const ArenaMark mark = arena_mark(tape->variations->study.instance.arena);
    WORK(mark, double, found, N_STATES);
    const double(*slopes)[N_STATES] = (Stages)tape->variations->study.instance.scratch.solver.stages;
    for (int i = end - 1; i >= first; i--) {
        bool any = false;
        for (int k = 0; k < N_STATES; k++) {
            any = any || tape->method.stages[i][k] != 0.0;
        }
        memset(found, 0, N_STATES * sizeof(double));
        if (any && !tape_slope_back(tape, stage_time(entry, i), tape->method.states[i], slopes[i],
                                    tape->method.stages[i], NULL, found)) {
            return arena_leave(mark, false);
        }
        for (int j = 0; any && j < i; j++) {
            tape_add_weighted(tape->method.stages[j], entry->step.length * tape->method.rows[i][j], found);
        }
        tape_add_weighted(before, 1.0, found);
    }
    return arena_leave(mark, true);
}

bool tape_step_back(Tape *tape, const Entry *entry, const Checkpoint *checkpoint) {
    Instance *instance = &tape->variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, before, N_STATES);
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const bool sampled = entry->first < entry->end;
    double *after = tape->total.states;
    state->time = entry->time;
    memcpy(state->states, checkpoint->states, sizeof state->states);
    memcpy(state->first_stage, checkpoint->slope, sizeof state->first_stage);
    memcpy(scratch->new_states, checkpoint->end_states, sizeof scratch->new_states);
    memcpy(scratch->solver.stages[0], checkpoint->slope, sizeof checkpoint->slope);
    memcpy(tape->method.states[0], checkpoint->states, sizeof checkpoint->states);
    memset(tape->method.stages, 0, sizeof tape->method.stages);
    if (!stages_again(tape, entry, 1, sampled ? STAGES : TABLEAU.stages)) {
        return arena_leave(mark, false);
    }
    if (sampled && (!derivative_at(instance, entry->step.end, scratch->new_states, scratch->new_derivatives) ||
                    !samples_back(tape, entry, before, after))) {
        return arena_leave(mark, false);
    }
    if (!tape_project_back(tape, entry->step.end, checkpoint->unprojected, checkpoint->end_states, after)) {
        return arena_leave(mark, false);
    }
    if (sampled && !stages_back(tape, entry, STAGES, TABLEAU.stages, before)) {
        return arena_leave(mark, false);
    }
    for (int j = 0; j < TABLEAU.stages; j++) {
        tape_add_weighted(tape->method.stages[j], entry->step.length * tape->method.rows[STAGES][j], after);
    }
    if (!stages_back(tape, entry, TABLEAU.stages, 0, before)) {
        return arena_leave(mark, false);
    }
    tape_add_weighted(after, 1.0, before);
    return arena_leave(mark, true);
}
