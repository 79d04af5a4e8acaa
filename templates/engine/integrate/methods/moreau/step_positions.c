#include "step_positions.h"

#include <math.h>
#include <string.h>

#include "contact_modes.h"
#include "notices.h"
#include "scale.h"
#include "step_impulses.h"

/* Bounds of the corrections at the end and in the middle of the step, and the number of rows that hold always. */
enum {
    MOST_POSITION_CORRECTIONS = 8,
    MOST_MIDDLE_CORRECTIONS = REAL_TIME ? 1 : 3,
    HELD = N_HOLONOMIC - N_UNILATERALS - N_OFFSETS /* permanent holonomic constraints */
};

/* The part of the error before that a correction leaves at most if it converges: the next correction with the same
   operator leaves the same part again, so it need not be measured. Good corrections leave 1e-3. */
static const double CONVERGES = 0.1;

/* Keeps in *worst and *which the row that is farthest from where it has to be, in units of its size. A value that is
   not a number is the worst. */
static void need(const SolverScratch *scratch, int row, double value, double *worst, int *which) {
    const double relative = isnan(value) ? HUGE_VAL : fabs(value) / scratch->at.sizes[row];
    if (relative > *worst) {
        *worst = relative;
        *which = row;
    }
}

/* Is a contact to be closed after the step? */
static bool stays(const SolverScratch *scratch, int contact) {
    const int row = CONTACT_ROWS[contact];
    return scratch->closing && scratch->impulses[row] > 0.0 && step_stops(scratch, row);
}

/* The rows to be moved: those that hold a position, and contacts that touch. */
static void choose_moved(const SolverScratch *scratch, bool moved[]) {
    memset(moved, 0, K * sizeof(bool));
    memset(moved, true, HELD * sizeof(bool));
    for (int row = FIRST_LATCH_ROW; row < FIRST_LATCH_ROW + N_OFFSETS; row++) {
        moved[row] = scratch->active[row];
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        moved[CONTACT_ROWS[c]] = scratch->active[CONTACT_ROWS[c]];
    }
}

/* How far the rows to be moved are from where they have to be at the end: returns the greatest distance, in nominal
   positions; *which is that row. */
static double find_needs(const SolverScratch *scratch, const bool moved[], int *which) {
    const SteppedRows *at = &scratch->end;
    double worst = 0.0;
    for (int row = 0; row < HELD; row++) {
        need(scratch, row, at->positions[row], &worst, which);
    }
    for (int row = FIRST_LATCH_ROW; row < FIRST_LATCH_ROW + N_OFFSETS; row++) {
        need(scratch, row, moved[row] ? at->positions[row] : 0.0, &worst, which);
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int row = CONTACT_ROWS[c];
        const double gap = at->positions[row];
        need(scratch, row, moved[row] && (!(gap >= 0.0) || stays(scratch, c)) ? gap : 0.0, &worst, which);
    }
    return worst;
}

/* Moves q[n] by what the chosen rows need at these positions[m]. */
static void correct_positions(Instance *instance, const double positions[], double q[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, pushes, K);
    WORK(mark, double, changes, N);
    undo_chosen(instance, positions, pushes, changes);
    for (int i = 0; i < N; i++) {
        q[i] += changes[i];
    }
    arena_release(mark);
}

/* Of the chosen contacts those that do not stay may open. */
static void allow_opening(SolverScratch *scratch) {
    ChosenRows *chosen = &scratch->chosen;
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int i = chosen->met.index[CONTACT_ROWS[c]];
        if (i >= 0 && !stays(scratch, c)) {
            chosen->row[i].law = ROW_UNILATERAL;
        }
    }
}

/* Is a permanent constraint open? */
static bool constraints_open(const SteppedRows *at) {
    bool open = false;
    for (int row = 0; row < HELD && !open; row++) {
        open = fabs(at->positions[row]) > MET * at->sizes[row];
    }
    return open;
}

/* Moves q[n] by what the permanent constraints need where the rows were measured. */
static void correct_middle(Instance *instance, double q[]) {
    SolverScratch *scratch = &instance->scratch.solver;
    memset(scratch->active, 0, sizeof scratch->active);
    memset(scratch->active, true, HELD * sizeof(bool));
    scratch->nominal = true;
    stepped_meet(instance);
    choose_rows(scratch, scratch->active);
    correct_positions(instance, scratch->at.positions, q);
    scratch->nominal = false;
}

/* Corrections go on until the constraints are met, which stepped_measure tells beside all else. Before the first one,
   which most steps need, the constraints are measured alone. */
bool step_middle(Instance *instance, double time, double half, double states[]) {
    SteppedRows *at = &instance->scratch.solver.at;
    if (HELD > 0) {
        stepped_hold(instance, time, states, at);
    }
    bool regular = true;
    int corrections = 0;
    do {
        if (constraints_open(at)) {
            correct_middle(instance, states);
            corrections++;
        }
        regular = stepped_measure(instance, time, half, states, at);
    } while (regular && corrections < MOST_MIDDLE_CORRECTIONS && constraints_open(at));
    return regular;
}

static bool fail_positions(Instance *instance, double time, int row, double residual) {
    Failure *failure = &instance->failure;
    failure->kind = FAILURE_CONSTRAINTS;
    failure->flat = false;
    failure->time = time;
    failure->count = 1;
    failure->constraints[0] = PLACES[row];
    failure->residuals[0] = residual;
    return false;
}

/* Moves q by what the rows need at the end. */
static void correct_end(Instance *instance, const bool moved[], double q[]) {
    SolverScratch *scratch = &instance->scratch.solver;
    choose_rows(scratch, moved);
    allow_opening(scratch);
    correct_positions(instance, scratch->end.positions, q);
}

/* Moves q by what the gaps of closed contacts will need at the end, before they are measured. A path through the middle
   with the velocities of both ends has curved away from such a contact as much as it will until the end. */
static void foresee_positions(Instance *instance, double length, const bool moved[], double q[]) {
    SolverScratch *scratch = &instance->scratch.solver;
    bool any = false;
    memset(scratch->end.positions, 0, sizeof scratch->end.positions);
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int row = CONTACT_ROWS[c];
        const double half = 0.5 * length, before = half * scratch->at.velocities[row];
        const bool closed = contact_closed(&instance->state, c) && moved[row];
        const double end = (closed ? before : scratch->at.positions[row]) + half * scratch->after[row];
        scratch->end.positions[row] = end;
        any = any || (closed && fabs(end) > MET * scratch->at.sizes[row]);
    }
    if (any) {
        correct_end(instance, moved, q);
    }
}

/* Moves q until the rows are met as well as they can be. Returns how far the row that is farthest away is then, in
   nominal positions; *which is that row. What the last correction is sure to leave is not measured again. */
static double meet_positions(Instance *instance, Step step, double states[], int *which) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, bool, moved, K);
    SolverScratch *scratch = &instance->scratch.solver;
    double worst = HUGE_VAL;
    choose_moved(scratch, moved);
    if (scratch->closing) {
        foresee_positions(instance, step.length, moved, states);
    }
    for (int i = 0; i <= MOST_POSITION_CORRECTIONS; i++) {
        const double before = worst;
        stepped_place(instance, step.end, states, &scratch->end);
        worst = find_needs(scratch, moved, which);
        if (worst <= MET || i == MOST_POSITION_CORRECTIONS) {
            break;
        }
        correct_end(instance, moved, states);
        const double left = worst < CONVERGES * before ? worst * (worst / before) : worst;
        if (i > 0 && left <= SOLVED) {
            worst = left;
            break;
        }
    }
    arena_release(mark);
    return worst;
}

/* Closes the contacts that stay, and keeps gaps from being negative. If that fails, the gaps alone are kept: several
   points of a round body may stop within one step before they touch, and cannot all touch together. */
bool step_positions(Instance *instance, Step step, double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N);
    SolverScratch *scratch = &instance->scratch.solver;
    int which = 0;
    memcpy(before, states, N * sizeof(double));
    scratch->closing = true;
    double worst = meet_positions(instance, step, states, &which);
    if (worst > LOCATED && N_UNILATERALS > 0) {
        memcpy(states, before, N * sizeof(double));
        scratch->closing = false;
        worst = meet_positions(instance, step, states, &which);
    }
    if (REAL_TIME && worst > LOCATED && isfinite(worst)) {
        give_notice(instance, NOTICE_UNSOLVED, 0.0, 0);
        return arena_leave(mark, true);
    }
    return arena_leave(mark,
                       worst <= LOCATED || fail_positions(instance, step.end, which, scratch->end.positions[which]));
}
