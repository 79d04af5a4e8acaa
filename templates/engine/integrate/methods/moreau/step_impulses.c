/* The laws of the rows that take part, and the balance of energy over them. */
#include "step_impulses.h"

#include <math.h>
#include <string.h>

#include "complementarity_large.h"
#include "contact_events.h"
#include "contact_modes.h"
#include "failure.h"
#include "inputs.h"
#include "notices.h"
#include "scale.h"

/* Bounds: of solutions for the loads that dry frictions depend on, of bisections of the restitution, and of rounds of
   sweeps (complementarity_large.h). In real time they are few, and the laws are met as well as these allow. */
enum { MOST_LOADS = REAL_TIME ? 8 : 50, LOAD_BISECTIONS = REAL_TIME ? 8 : 30, MOST_ROUNDS = REAL_TIME ? 5 : 12 };

/* A velocity along a row that is as good as 0. */
static double least_speed(const SolverScratch *scratch, int row) {
    return AT_REST * scratch->pace * scratch->at.sizes[row];
}

bool step_stops(const SolverScratch *scratch, int row) {
    return fabs(scratch->after[row]) <= least_speed(scratch, row);
}

void unknowns_of(const double impulses[], double length, double unknowns[]) {
    memset(unknowns, 0, N * sizeof(double));
    for (int row = 0; row < K; row++) {
        unknowns[N + PLACES[row]] = impulses[row] / length;
    }
}

/* Is the operator known of just these rows? */
static bool rows_known(const ChosenRows *chosen, const bool which[]) {
    bool known = chosen->known;
    for (int row = 0; row < K && known; row++) {
        known = (chosen->met.index[row] >= 0) == which[row];
    }
    return known;
}

/* The operator of these rows among those that met. */
static void choose_meetings(const RowsMet *met, const bool which[], RowsMet *chosen) {
    int entries = 0;
    rows_number(chosen, which);
    if (chosen->count == met->count) {
        memcpy(chosen->start, met->start, (size_t)(met->count + 1) * sizeof *met->start);
        memcpy(chosen->column, met->column, (size_t)met->start[met->count] * sizeof *met->column);
        memcpy(chosen->value, met->value, (size_t)met->start[met->count] * sizeof *met->value);
        return;
    }
    for (int i = 0; i < chosen->count; i++) {
        const int active = met->index[chosen->rows[i]];
        chosen->start[i] = entries;
        for (int e = met->start[active]; e < met->start[active + 1]; e++) {
            const int other = chosen->index[met->rows[met->column[e]]];
            if (other >= 0) {
                chosen->column[entries] = other;
                chosen->value[entries++] = met->value[e];
            }
        }
    }
    chosen->start[chosen->count] = entries;
}

void choose_rows(SolverScratch *scratch, const bool which[]) {
    ChosenRows *chosen = &scratch->chosen;
    if (!rows_known(chosen, which)) {
        choose_meetings(&scratch->met, which, &chosen->met);
        chosen->known = true;
        chosen->few.known = false;
    }
    for (int i = 0; i < chosen->met.count; i++) {
        memset(&chosen->row[i], 0, sizeof chosen->row[i]);
        chosen->row[i].law = ROW_BILATERAL;
    }
    chosen->yielding = false;
}

/* Solves the problem of the chosen rows from lambda, and for their velocities w unless it is NULL; false if much more
   than rounding is left. Work is done in the arena. */
static bool solve_chosen(Arena *arena, ChosenRows *chosen, double w[]) {
    RowsMet *met = &chosen->met;
    const SparseProblem problem = {.arena = arena,
                                   .delassus = {met->count, met->start, met->column, met->value},
                                   .free = chosen->free,
                                   .row = chosen->row,
                                   .yielding = &chosen->yielding,
                                   .few = &chosen->few};
    return complementarity_large(&problem, MOST_ROUNDS, chosen->lambda, w);
}

void undo_chosen(Instance *instance, const double needs[], double pushes[], double changes[]) {
    ChosenRows *chosen = &instance->scratch.solver.chosen;
    for (int i = 0; i < chosen->met.count; i++) {
        chosen->free[i] = needs[chosen->met.rows[i]];
        chosen->lambda[i] = 0.0;
    }
    solve_chosen(instance->arena, chosen, NULL); /* the best that was found is a step forward, too */
    memset(pushes, 0, K * sizeof(double));
    for (int i = 0; i < chosen->met.count; i++) {
        pushes[chosen->met.rows[i]] = chosen->lambda[i];
    }
    stepped_respond(instance, pushes, changes);
}

/* A contact touches if its gap would be closed at the end of the step, or if it was closed before. Without the forces
   of this step a foot that rolls or turns leaves the ground by the curvature of its path, length^2/8 times an
   acceleration: this opens nothing, only the laws do. */
static void find_step_rows(Instance *instance, double length) {
    SolverScratch *scratch = &instance->scratch.solver;
    for (int row = 0; row < K; row++) {
        const int latch = row - FIRST_LATCH_ROW;
        scratch->active[row] = latch < 0 || row_active(&instance->state, FIRST_LATCH + latch);
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int row = CONTACT_ROWS[c];
        const double end = scratch->at.positions[row] + 0.5 * length * fmin(scratch->at.velocities[row], 0.0);
        const bool touches =
            contact_closed(&instance->state, c) || end <= AT_REST * scratch->at.sizes[row];
        for (int k = row; k < CONTACT_ROWS[c + 1]; k++) {
            scratch->active[k] = touches;
        }
    }
}

bool step_collides(const Instance *instance, int contact) {
    const SolverScratch *scratch = &instance->scratch.solver;
    const int row = CONTACT_ROWS[contact];
    return scratch->active[row] && !contact_closed(&instance->state, contact) &&
           scratch->at.velocities[row] < -least_speed(scratch, row);
}

/* reversals[]: the impulses that turn round the velocities along permanent constraints at the beginning, so that the
   mean of both ends of the step is 0 along them. Contacts see the velocities without that part: with it the edge of a
   turning body would grow longer, and could not rest on two points. */
static void find_reversals(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, bool, permanent, K);
    WORK(mark, double, changes, N);
    SolverScratch *scratch = &instance->scratch.solver;
    memset(permanent, true, N_PERMANENT * sizeof(bool));
    choose_rows(scratch, permanent);
    undo_chosen(instance, scratch->at.velocities, scratch->reversals, changes);
    for (int i = 0; i < scratch->met.count; i++) {
        const int row = scratch->met.rows[i];
        scratch->at.velocities[row] += stepped_along(&scratch->at, row, changes);
        scratch->reversals[row] *= 2.0;
    }
    arena_release(mark);
}

/* The forces of dry frictions under the present impulses; returns whether they are as they were. */
static bool find_dry(Instance *instance, double time, const double states[], double length) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    WORK(mark, double, along, SIZE_FRICTIONAL);
    WORK(mark, double, sliding, SIZE_FRICTIONS);
    WORK(mark, double, holding, SIZE_FRICTIONS);
    SolverScratch *scratch = &instance->scratch.solver;
    bool same = true;
    if (N_FRICTIONS == 0) {
        return arena_leave(mark, true);
    }
    unknowns_of(scratch->impulses, length, unknowns);
    mechanism_friction(time, states, inputs_at(instance, time), instance->state.parameters, unknowns, along, sliding,
                       holding);
    for (int i = 0; i < N_FRICTIONS; i++) {
        const double held = friction_sticks(&instance->state, i) ? holding[i] : 0.0;
        const double force = fmax(fmax(held, sliding[i]), 0.0);
        same = same && fabs(force - scratch->dry[i]) <= MET * fmax(force, scratch->dry[i]);
        scratch->dry[i] = force;
    }
    return arena_leave(mark, same);
}

/* part * restitution * min(v, 0) for the normal velocity v (m/s) of a contact before the step: what Moreau's law adds
   to the velocity after it. */
static double returned(const SolverScratch *scratch, int contact, double part) {
    return part * scratch->restitution[contact] * fmin(scratch->at.velocities[CONTACT_ROWS[contact]], 0.0);
}

/* The laws of the chosen rows, from the velocities before[] along all rows on. */
static void set_laws(Instance *instance, const double before[], double length, double part) {
    const State *state = &instance->state;
    SolverScratch *scratch = &instance->scratch.solver;
    ChosenRows *chosen = &scratch->chosen;
    for (int i = 0; i < chosen->met.count; i++) {
        const int row = chosen->met.rows[i];
        chosen->free[i] = before[row] + length * stepped_along(&scratch->at, row, scratch->accelerations);
        chosen->lambda[i] = scratch->impulses[row];
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int normal = chosen->met.index[CONTACT_ROWS[c]];
        if (normal < 0) {
            continue;
        }
        chosen->row[normal].law = ROW_UNILATERAL;
        chosen->free[normal] += returned(scratch, c, part);
        for (int i = normal + 1; i <= normal + CONTACT_ROWS[c + 1] - CONTACT_ROWS[c] - 1; i++) {
            if (chosen->lambda[normal] == 0.0 && contact_slides(state, c)) { /* the first step: against the slip */
                chosen->lambda[i] = -SOLVED * scratch->at.velocities[chosen->met.rows[i]];
            }
            chosen->row[i] = (Row){.law = ROW_TANGENTIAL,
                                   .normal = normal,
                                   .friction = scratch->friction[c],
                                   .holds = contact_sticks(state, c)};
        }
    }
    for (int k = 0; k < N_FRICTIONS; k++) {
        const int i = chosen->met.index[FIRST_DRY_ROW + k];
        chosen->row[i] = (Row){.law = ROW_BOUNDED,
                               .normal = i,
                               .friction = length * scratch->dry[k],
                               .holds = friction_sticks(state, k)};
    }
}

/* supports[]: the impulses that rows would bear in a step from rest if nothing held what collides in this one. Without
   them bodies that lie on one another fall alike, and nothing seems to press on the contacts between them. */
static void find_supports(Instance *instance, double length, double supports[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, still, N_CONSTRAINTS);
    WORK(mark, bool, supported, N_CONSTRAINTS);
    SolverScratch *scratch = &instance->scratch.solver;
    ChosenRows *chosen = &scratch->chosen;
    memcpy(supported, scratch->active, sizeof scratch->active);
    for (int c = 0; c < N_UNILATERALS; c++) {
        const bool collides = step_collides(instance, c);
        for (int row = CONTACT_ROWS[c]; row < CONTACT_ROWS[c + 1]; row++) {
            supported[row] = supported[row] && !collides;
        }
    }
    choose_rows(scratch, supported);
    set_laws(instance, still, length, 0.0);
    const bool solved = chosen->met.count > 0 && solve_chosen(instance->arena, chosen, chosen->w);
    for (int i = 0; i < chosen->met.count && solved; i++) {
        supports[chosen->met.rows[i]] = chosen->lambda[i];
    }
    arena_release(mark);
}

/* The acceleration (m/s^2) that presses on a contact whose bodies others support, by impulses supports[] in a step of
   this length (s). */
static double pressure(const SolverScratch *scratch, int row, const double supports[], double length) {
    const RowsMet *met = &scratch->met;
    double opening = length * stepped_along(&scratch->at, row, scratch->accelerations);
    for (int e = met->start[met->index[row]]; e < met->start[met->index[row] + 1]; e++) {
        opening += met->value[e] * supports[met->rows[met->column[e]]];
    }
    return fmax(-opening / length, 0.0);
}

/* The restitution of a contact that collides. It costs energy to correct a gap that has closed too far; the rebound
   gets less by this energy. If a rebound would end within two steps, the restitution is 0: the contact closes. */
static double rebound(const SolverScratch *scratch, int row, double restitution, double pressed, double length) {
    const double approach = -scratch->at.velocities[row];
    const double depth = fmax(-scratch->at.positions[row] - 0.5 * length * restitution * approach, 0.0);
    const double square = restitution * restitution - 2.0 * pressed * depth / (approach * approach);
    const double left = sqrt(fmax(square, 0.0));
    return left * approach > pressed * length ? left : 0.0;
}

/* The restitution of the contacts that collide in this step, with the velocities at its beginning. Returns false, with
   instance->failure, if one is not between 0 and 1. */
static bool find_rebounds(Instance *instance, double time, const double states[], double length) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, restitution, SIZE_UNILATERALS);
    WORK_ZEROS(mark, double, supports, N_CONSTRAINTS);
    SolverScratch *scratch = &instance->scratch.solver;
    bool known = false, supported = false;
    memset(scratch->restitution, 0, sizeof scratch->restitution);
    for (int c = 0; c < N_UNILATERALS; c++) {
        const int row = CONTACT_ROWS[c];
        if (!step_collides(instance, c)) {
            continue;
        }
        if (!known) {
            mechanism_restitution(time, states, inputs_at(instance, time), instance->state.parameters, restitution);
            known = true;
        }
        if (!coefficient_returns(restitution[c])) {
            return arena_leave(
                mark, report_constraint(instance, FAILURE_RESTITUTION, time, ROW_PLACES[c], restitution[c]));
        }
        if (restitution[c] > 0.0) {
            if (!supported) {
                find_supports(instance, length, supports);
                supported = true;
            }
            const double pressed = pressure(scratch, row, supports, length);
            scratch->restitution[c] = rebound(scratch, row, fmin(restitution[c], 1.0), pressed, length);
        }
    }
    return arena_leave(mark, true);
}

bool step_coefficients(Instance *instance, double time, const double states[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, holding, SIZE_UNILATERALS);
    SolverScratch *scratch = &instance->scratch.solver;
    const State *state = &instance->state;
    mechanism_contacts(time, states, inputs_at(instance, time), state->parameters, scratch->friction, holding);
    for (int c = 0; c < N_UNILATERALS; c++) {
        const double friction = scratch->friction[c];
        if (scratch->active[CONTACT_ROWS[c]] && !coefficient_rubs(friction)) {
            return arena_leave(mark, report_constraint(instance, FAILURE_FRICTION, time, ROW_PLACES[c], friction));
        }
        scratch->friction[c] = fmax(contact_sticks(state, c) ? fmax(holding[c], friction) : friction, 0.0);
    }
    return arena_leave(mark, true);
}

/* Solves all laws at once, with `part` times each coefficient of restitution. */
static bool solve_step_laws(Instance *instance, double length, double part) {
    SolverScratch *scratch = &instance->scratch.solver;
    ChosenRows *chosen = &scratch->chosen;
    choose_rows(scratch, scratch->active);
    set_laws(instance, scratch->at.velocities, length, part);
    const bool solved = chosen->met.count == 0 || solve_chosen(instance->arena, chosen, chosen->w);
    scratch->unsolved = scratch->unsolved || !solved || chosen->yielding;
    if (!solved && !REAL_TIME) {
        return false;
    }
    memset(scratch->impulses, 0, sizeof scratch->impulses);
    memset(scratch->after, 0, sizeof scratch->after);
    for (int i = 0; i < chosen->met.count; i++) {
        scratch->impulses[chosen->met.rows[i]] = chosen->lambda[i];
        scratch->after[chosen->met.rows[i]] = chosen->w[i];
    }
    for (int row = 0; row < N_PERMANENT; row++) {
        scratch->impulses[row] += scratch->reversals[row];
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        scratch->after[CONTACT_ROWS[c]] -= scratch->active[CONTACT_ROWS[c]] ? returned(scratch, c, part) : 0.0;
    }
    return true;
}

/* Solves the laws again and again until the forces of dry frictions agree with the loads that they depend on. */
static bool solve_loads(Instance *instance, double time, const double states[], double length, double part) {
    instance->scratch.solver.unsolved = false;
    for (int i = 0; i < MOST_LOADS; i++) {
        if (!solve_step_laws(instance, length, part)) {
            return false;
        }
        if (find_dry(instance, time, states, length)) {
            break;
        }
    }
    return true;
}

/* Do the rows take energy from the motion, or give it none beyond rounding? */
static bool dissipating(const SolverScratch *scratch) {
    double lost = 0.0, terms = 0.0;
    for (int row = N_PERMANENT; row < FIRST_LATCH_ROW; row++) {
        const double before = scratch->at.velocities[row], after = scratch->after[row];
        lost -= scratch->impulses[row] * (before + after);
        terms += fabs(scratch->impulses[row]) * (fabs(before) + fabs(after));
    }
    return lost >= -MET * terms;
}

static bool fail_step(Instance *instance, double time) {
    instance->failure.kind = FAILURE_MODES;
    instance->failure.time = time;
    return false;
}

/* The greatest part of the restitution that does not make the energy grow; without any it never does. */
static bool reduce_loads(Instance *instance, double time, const double states[], double length) {
    double least = 0.0, most = 1.0;
    for (int i = 0; i < LOAD_BISECTIONS; i++) {
        const double middle = 0.5 * (least + most);
        const bool good = solve_loads(instance, time, states, length, middle) && dissipating(&instance->scratch.solver);
        *(good ? &least : &most) = middle;
    }
    return solve_loads(instance, time, states, length, least);
}

bool step_begin(Instance *instance, double time, const double states[], double length) {
    SolverScratch *scratch = &instance->scratch.solver;
    scratch->pace = states_pace(&instance->state);
    find_step_rows(instance, length);
    stepped_meet(instance);
    if (N_PERMANENT > 0) {
        find_reversals(instance);
    }
    for (int row = 0; row < K; row++) {
        scratch->impulses[row] = length * instance->state.solver.forces[row];
    }
    memset(scratch->dry, 0, sizeof scratch->dry);
    if (!step_coefficients(instance, time, states) || !find_rebounds(instance, time, states, length)) {
        return false;
    }
    find_dry(instance, time, states, length);
    return true;
}

/* The impulses, with no more of the restitution than keeps the energy from growing. */
static bool find_impulses(Instance *instance, double time, const double states[], double length) {
    const SolverScratch *scratch = &instance->scratch.solver;
    if (!solve_loads(instance, time, states, length, 1.0)) {
        return fail_step(instance, time);
    }
    for (int c = 0; c < N_UNILATERALS; c++) {
        if (scratch->restitution[c] > 0.0 && !dissipating(scratch)) {
            give_notice(instance, NOTICE_REDUCED, 0.0, N_SWITCHES + 2 * c);
            return reduce_loads(instance, time, states, length) || fail_step(instance, time);
        }
    }
    return true;
}

bool step_impulses(Instance *instance, double time, const double states[], double length) {
    if (!find_impulses(instance, time, states, length)) {
        return false;
    }
    if (instance->scratch.solver.unsolved) {
        give_notice(instance, NOTICE_UNSOLVED, length, 0);
    }
    return true;
}
