/* Evaluating rows by their entries, and trying rows of one colour together. Coleman, More, Estimation of sparse
   Jacobian matrices and graph coloring problems, SIAM J. Numer. Anal. 20, 1983. */
#include "stepped_rows.h"

#include <math.h>
#include <string.h>

#include "further.h"
#include "inputs.h"
#include "mass_matrix.h"
#include "system.h"

/* The one block of coordinates is touched by each row. */
enum { ONE_BLOCK = N_BLOCKS == 1 && N_TOUCHES == N_CONSTRAINTS };

/* M where the generated factors are not sound: densely, and where it is singular with the permanent constraints added.
   What modes switch must not be added. */
static bool factorize_stepped_mass(Instance *instance, double time, const double states[], const double inputs[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, masks, N_ROWS);
    double *parameters = instance->state.parameters;
    memcpy(masks, parameters, N_ROWS * sizeof(double));
    memset(parameters, 0, N_ROWS * sizeof(double));
    const bool regular = system_factorize(instance, time, states, inputs, 0, 0.0, &instance->scratch.system);
    memcpy(parameters, masks, N_ROWS * sizeof(double));
    return arena_leave(mark, regular);
}

/* The sizes of the first rows. */
static void find_sizes(SteppedRows *at, int rows) {
    for (int row = 0; row < rows; row++) {
        double size = 0.0;
        for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1]; e++) {
            const double moved = fabs(at->entries[e]) * NOMINAL_STATES[ENTRY_COLUMNS[e]];
            size = moved > size ? moved : size;
        }
        at->sizes[row] = size > 0.0 ? size : 1.0;
    }
}

bool stepped_measure(Instance *instance, double time, double half, const double states[], SteppedRows *at) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pivots, N);
    System *system = &instance->scratch.system;
    const double *inputs = inputs_at(instance, time);
    memset(at->positions, 0, sizeof at->positions);
    memset(system->weight, 0, sizeof system->weight);
    mechanism_stepping(time, states, inputs, instance->state.parameters, half, system->factor, pivots, system->forcing,
                       at->entries, at->positions, at->velocities, instance->scratch.solver.still);
    find_sizes(at, K);
    system->dense = !pivots_sound(instance, pivots);
    return arena_leave(mark, !system->dense || factorize_stepped_mass(instance, time, states, inputs));
}

void stepped_place(Instance *instance, double time, const double states[], SteppedRows *at) {
    memset(at->positions, 0, sizeof at->positions);
    mechanism_placing(time, states, inputs_at(instance, time), instance->state.parameters, at->entries, at->positions,
                      at->velocities);
    find_sizes(at, N_PERMANENT);
}

void stepped_hold(Instance *instance, double time, const double states[], SteppedRows *at) {
    memset(at->positions, 0, sizeof at->positions);
    mechanism_holding(time, states, inputs_at(instance, time), instance->state.parameters, at->entries, at->positions,
                      at->velocities);
    find_sizes(at, N_PERMANENT);
}

/* Where M is factorised densely, no damper is in it: all of them pull in the middle of the step. */
void stepped_force(Instance *instance, double time, const double states[]) {
    if (IMPLICIT_DAMPERS != 0 && instance->scratch.system.dense) {
        mechanism_dynamics(time, states, inputs_at(instance, time), instance->state.parameters, instance->scratch.mass,
                           instance->scratch.system.forcing);
        return;
    }
    mechanism_forcing(time, states, inputs_at(instance, time), instance->state.parameters,
                      instance->scratch.solver.still, instance->scratch.system.forcing);
}

bool stepped_further(Instance *instance, double time, const double states[], const double unknowns[], double rates[]) {
    mechanism_stepped_further(time, states, inputs_at(instance, time), instance->state.parameters, unknowns,
                              instance->scratch.solver.still, rates);
    return further_finite(instance, time, rates);
}

void stepped_accelerate(const Instance *instance, double accelerations[]) {
    mass_divide(&instance->scratch.system, instance->scratch.system.forcing, accelerations);
}

/* By nominal values, in whose metric the rows serve before M is known. */
static void divide(const Instance *instance, const double b[], double a[]) {
    if (!instance->scratch.solver.nominal) {
        mass_divide(&instance->scratch.system, b, a);
        return;
    }
    for (int i = 0; i < N; i++) {
        a[i] = NOMINAL_STATES[i] * NOMINAL_STATES[i] * b[i];
    }
}

double stepped_along(const SteppedRows *at, int row, const double vector[]) {
    double sum = 0.0;
    for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1]; e++) {
        sum += at->entries[e] * vector[ENTRY_COLUMNS[e]];
    }
    return sum;
}

/* G_row . response[n] in the blocks that belong to the row owner. */
static double along_in(const SteppedRows *at, int row, const double response[], const int owners[], int owner) {
    double sum = 0.0;
    for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1]; e++) {
        const int column = ENTRY_COLUMNS[e];
        sum += owners[BLOCKS[column]] == owner ? at->entries[e] * response[column] : 0.0;
    }
    return sum;
}

void rows_number(RowsMet *met, const bool which[]) {
    met->count = 0;
    for (int row = 0; row < K; row++) {
        met->index[row] = which[row] ? met->count : -1;
        if (which[row]) {
            met->rows[met->count++] = row;
        }
    }
}

/* The numbers of the rows that touch each block, ascending: from list[starts[block]] to list[starts[block + 1]]. */
static void list_blocks(const RowsMet *met, int starts[], int list[]) {
    memset(starts, 0, (N_BLOCKS + 1) * sizeof(int));
    for (int i = 0; i < met->count; i++) {
        for (int k = TOUCH_STARTS[met->rows[i]]; k < TOUCH_STARTS[met->rows[i] + 1]; k++) {
            starts[TOUCHED_BLOCKS[k]]++;
        }
    }
    for (int block = 1; block <= N_BLOCKS; block++) {
        starts[block] += starts[block - 1];
    }
    for (int i = met->count - 1; i >= 0; i--) {
        for (int k = TOUCH_STARTS[met->rows[i]]; k < TOUCH_STARTS[met->rows[i] + 1]; k++) {
            list[--starts[TOUCHED_BLOCKS[k]]] = i;
        }
    }
}

/* Takes and returns the least number that is left in the lists of the blocks that a row touches; at their end none. */
static int pass_least(int row, const int starts[], const int list[], int next[], int none) {
    int least = none;
    for (int k = TOUCH_STARTS[row]; k < TOUCH_STARTS[row + 1]; k++) {
        const int block = TOUCHED_BLOCKS[k];
        if (next[block] < starts[block + 1] && list[next[block]] < least) {
            least = list[next[block]];
        }
    }
    for (int k = TOUCH_STARTS[row]; k < TOUCH_STARTS[row + 1]; k++) {
        const int block = TOUCHED_BLOCKS[k];
        next[block] += next[block] < starts[block + 1] && list[next[block]] == least;
    }
    return least;
}

/* All rows touch the only block: each meets each. */
static void meet_all(RowsMet *met) {
    for (int i = 0; i < met->count; i++) {
        met->start[i] = i * met->count;
        for (int k = 0; k < met->count; k++) {
            met->column[i * met->count + k] = k;
        }
    }
    met->start[met->count] = met->count * met->count;
}

/* Are the rows numbered just as these would be? */
static bool rows_numbered(const RowsMet *met, const bool which[]) {
    int count = 0;
    bool same = true;
    for (int row = 0; row < K && same; row++) {
        same = met->index[row] == (which[row] ? count++ : -1);
    }
    return same && met->count == count && count > 0;
}

/* Notes for each active row which active rows it meets: those that touch one of its blocks, and itself. Most steps have
   the active rows of the step before. */
static void find_meetings(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, int, starts, N_BLOCKS + 1);
    WORK(mark, int, next, N_BLOCKS);
    WORK(mark, int, list, SIZE_TOUCHES);
    RowsMet *met = &instance->scratch.solver.met;
    int entries = 0;
    const bool *active = instance->scratch.solver.active;
    const bool same = !ONE_BLOCK && rows_numbered(met, active);
    if (!same) {
        rows_number(met, active);
    }
    if (ONE_BLOCK) {
        meet_all(met);
    }
    if (ONE_BLOCK || same) {
        arena_release(mark);
        return;
    }
    list_blocks(met, starts, list);
    for (int i = 0; i < met->count; i++) {
        const int row = met->rows[i], none = met->count;
        met->start[i] = entries;
        for (int k = TOUCH_STARTS[row]; k < TOUCH_STARTS[row + 1]; k++) {
            next[TOUCHED_BLOCKS[k]] = starts[TOUCHED_BLOCKS[k]];
        }
        for (int other = pass_least(row, starts, list, next, none); other < none;
             other = pass_least(row, starts, list, next, none)) {
            met->column[entries++] = other;
        }
        if (entries == met->start[i]) {
            met->column[entries++] = i;
        }
    }
    met->start[met->count] = entries;
    arena_release(mark);
}

/* Entries of the operator in a row, from the diagonal on, by the response M^-1 G_row^T. */
static void meet_row(SolverScratch *scratch, int row, const double response[], const int owners[]) {
    RowsMet *met = &scratch->met;
    const int own = met->index[row];
    for (int e = met->start[own]; e < met->start[own + 1]; e++) {
        if (met->column[e] >= own) {
            const int other = met->rows[met->column[e]];
            met->value[e] = N_BLOCKS == 1 ? stepped_along(&scratch->at, other, response)
                                          : along_in(&scratch->at, other, response, owners, row);
        }
    }
}

/* Entries of the operator in the active rows of one colour. These touch no common block, so that one solution with M
   gives the responses of all of them. */
static void meet_colour(Instance *instance, int colour) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, push, N);
    WORK(mark, double, response, N);
    WORK(mark, int, owners, N_BLOCKS);
    SolverScratch *scratch = &instance->scratch.solver;
    bool any = false;
    memset(owners, -1, N_BLOCKS * sizeof(int));
    for (int i = COLOUR_STARTS[colour]; i < COLOUR_STARTS[colour + 1]; i++) {
        const int row = COLOUR_ROWS[i];
        for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1] && scratch->active[row]; e++) {
            push[ENTRY_COLUMNS[e]] += scratch->at.entries[e];
            owners[BLOCKS[ENTRY_COLUMNS[e]]] = row;
        }
        any = any || scratch->active[row];
    }
    if (any) {
        divide(instance, push, response);
    }
    for (int i = COLOUR_STARTS[colour]; i < COLOUR_STARTS[colour + 1]; i++) {
        if (scratch->active[COLOUR_ROWS[i]]) {
            meet_row(scratch, COLOUR_ROWS[i], response, owners);
        }
    }
    arena_release(mark);
}

/* Entries of the operator in row `own`, where all coordinates are one block. Its response is kept if there is room. */
static void meet_alone(Instance *instance, int own) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, push, N);
    WORK(mark, double, work, N);
    SolverScratch *scratch = &instance->scratch.solver;
    RowsMet *met = &scratch->met;
    double *response = own < MOST_RESPONSES ? scratch->responses[own] : work;
    const int row = met->rows[own];
    for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1]; e++) {
        push[ENTRY_COLUMNS[e]] = scratch->at.entries[e];
    }
    divide(instance, push, response);
    for (int other = own; other < met->count; other++) {
        met->value[own * met->count + other] = stepped_along(&scratch->at, met->rows[other], response);
        met->value[other * met->count + own] = met->value[own * met->count + other];
    }
    arena_release(mark);
}

/* The operator is symmetric: copies the entries behind the diagonal to those before it. */
static void mirror(Arena *arena, RowsMet *met) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, int, next, K);
    memcpy(next, met->start, (size_t)met->count * sizeof(int));
    for (int i = 0; i < met->count; i++) {
        for (int e = met->start[i]; e < met->start[i + 1]; e++) {
            if (met->column[e] > i) {
                met->value[next[met->column[e]]++] = met->value[e];
            }
        }
    }
    arena_release(mark);
}

void stepped_meet(Instance *instance) {
    RowsMet *met = &instance->scratch.solver.met;
    find_meetings(instance);
    instance->scratch.solver.chosen.known = false;
    for (int own = 0; own < met->count && ONE_BLOCK; own++) {
        meet_alone(instance, own);
    }
    for (int colour = 0; colour < N_ROW_COLOURS && !ONE_BLOCK; colour++) {
        meet_colour(instance, colour);
    }
    if (!ONE_BLOCK) {
        mirror(instance->arena, met);
    }
}

void stepped_respond(const Instance *instance, const double impulses[], double changes[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, push, N);
    const SolverScratch *scratch = &instance->scratch.solver;
    const RowsMet *met = &scratch->met;
    if (ONE_BLOCK && met->count <= MOST_RESPONSES) {
        memset(changes, 0, N * sizeof(double));
        for (int own = 0; own < met->count; own++) {
            const double impulse = impulses[met->rows[own]];
            for (int i = 0; i < N && impulse != 0.0; i++) {
                changes[i] += impulse * scratch->responses[own][i];
            }
        }
        arena_release(mark);
        return;
    }
    for (int row = 0; row < K; row++) {
        for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1] && impulses[row] != 0.0; e++) {
            push[ENTRY_COLUMNS[e]] += impulses[row] * scratch->at.entries[e];
        }
    }
    divide(instance, push, changes);
    arena_release(mark);
}
