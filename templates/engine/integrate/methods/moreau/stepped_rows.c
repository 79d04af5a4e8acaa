/* Evaluating rows by their entries, and trying rows of one colour together. Coleman, More, Estimation of sparse
   Jacobian matrices and graph coloring problems, SIAM J. Numer. Anal. 20, 1983. */
#include "stepped_rows.h"

#include <math.h>
#include <string.h>

#include "inputs.h"
#include "mass_matrix.h"
#include "system.h"

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

bool stepped_measure(Instance *instance, double time, const double states[], SteppedRows *at) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pivots, N);
    System *system = &instance->scratch.system;
    const double *inputs = inputs_at(instance, time);
    memset(at->positions, 0, sizeof at->positions);
    memset(system->weight, 0, sizeof system->weight);
    mechanism_stepping(time, states, inputs, instance->state.parameters, system->factor, pivots, system->forcing,
                       at->entries, at->positions, at->velocities);
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

void stepped_force(Instance *instance, double time, const double states[]) {
    mechanism_forcing(time, states, inputs_at(instance, time), instance->state.parameters,
                      instance->scratch.system.forcing);
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

void stepped_add(const SteppedRows *at, int row, double factor, double vector[]) {
    for (int e = ENTRY_STARTS[row]; e < ENTRY_STARTS[row + 1]; e++) {
        vector[ENTRY_COLUMNS[e]] += factor * at->entries[e];
    }
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

/* What an active row does to itself and those behind it, which do the same to it. */
static void meet_row(SolverScratch *scratch, int row, const double response[], const int owners[]) {
    for (int e = MEETING_STARTS[row]; e < MEETING_STARTS[row + 1]; e++) {
        const int other = MEETING_ROWS[e];
        if (other >= row && scratch->active[other]) {
            const double moved = N_BLOCKS == 1 ? stepped_along(&scratch->at, other, response)
                                               : along_in(&scratch->at, other, response, owners, row);
            scratch->delassus[e] = scratch->delassus[MEETING_MIRRORS[e]] = moved;
        }
    }
}

/* What the active rows of one colour do: each to the rows that it meets. */
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

void stepped_meet(Instance *instance) {
    for (int colour = 0; colour < N_ROW_COLOURS; colour++) {
        meet_colour(instance, colour);
    }
}

void stepped_respond(const Instance *instance, const double impulses[], double start[], double changes[]) {
    for (int row = 0; row < K; row++) {
        if (impulses[row] != 0.0) {
            stepped_add(&instance->scratch.solver.at, row, impulses[row], start);
        }
    }
    divide(instance, start, changes);
}
