/* The impulse on the contact that jams grows little by little: its friction turns and slows the slip, until the contact
   rises again (Routh, Dynamics of a System of Rigid Bodies, part I, 7th edition 1905, chapter 5). */
#include "impacts_without_collision.h"

#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "scale.h"
#include "vector_length.h"

/* Of increments of an impulse, and of bisections of the last one. */
enum { MOST_PRESSES = 4096, PRESS_BISECTIONS = 24 };

/* An increment changes the slip by this part of that before the impact. */
static const double TURN = 1.0 / 256.0;

/* An impact as it goes on. */
typedef struct {
    const ImpactProblem *problem;
    int contact;                /* that jams */
    double increment;           /* of its normal impulse */
    double freely;              /* what it would rise by for each unit of impulse without friction */
    double lever;               /* its rise at the beginning, in units of that */
    double impulses[SIZE_ROWS]; /* of the last increment, and the velocities behind it */
    double after[SIZE_ROWS];
    ImpactResult *result;       /* up to this increment */
} Press;

static double slip_speed(const ImpactContact *contact, const double velocities[]) {
    return vector_length(velocities + contact->slip, contact->slips);
}

/* What a unit of friction alone makes of a slip, m/s, at most; 0 where a motion prescribes it. */
static double mobility_of_slip(const ImpactProblem *problem, const ImpactContact *contact) {
    double greatest = 0.0;
    for (int k = contact->slip; k < contact->slip + contact->slips; k++) {
        greatest = fmax(greatest, problem->delassus[k * problem->rows + k]);
    }
    return greatest;
}

static bool impact_slides(const ImpactProblem *problem, int c) {
    const ImpactContact *contact = &problem->contact[c];
    return contact->loaded && contact->friction > 0.0 && slip_speed(contact, problem->velocities) > contact->slow &&
           mobility_of_slip(problem, contact) > 0.0;
}

/* The next increment, where the normal impulse is this one or, with the law ROW_UNILATERAL, what stops the contact. */
static bool press_contact(Press *it, RowLaw law, double increment, bool rubs) {
    const ArenaMark mark = arena_mark(it->problem->arena);
    WORK(mark, Row, rows, SIZE_ROWS);
    const ImpactContact *contact = &it->problem->contact[it->contact];
    const Problem laws = impacts_describe(it->problem, it->result->velocities, rows);
    for (int c = 0; c < it->problem->contacts; c++) {
        if (it->problem->contact[c].loaded) {
            impacts_add(&it->problem->contact[c], 0.0, rows);
        }
    }
    rows[contact->normal].law = law;
    rows[contact->normal].value = law == ROW_GIVEN ? increment : 0.0;
    for (int k = contact->slip; k < contact->slip + contact->slips && !rubs; k++) {
        rows[k].law = ROW_FREE;
    }
    return arena_leave(mark, complementarity_solve(&laws, it->impulses, it->after));
}

/* What the contact rises by with this increment, m/s for each unit of impulse. */
static double pressed_rise(Press *it, double increment, bool rubs) {
    const int k = it->problem->contact[it->contact].normal;
    const bool solved = press_contact(it, ROW_GIVEN, increment, rubs);
    return solved ? (it->after[k] - it->result->velocities[k]) / increment : HUGE_VAL;
}

/* The increment that was found takes place. */
static void keep_press(Press *it) {
    for (int k = 0; k < it->problem->rows; k++) {
        it->result->impulses[k] += it->impulses[k];
        it->result->velocities[k] = it->after[k];
    }
}

/* Begins to press a contact that slides. */
static void begin_press(Press *it, int c) {
    const ImpactProblem *problem = it->problem;
    const ImpactContact *contact = &problem->contact[c];
    const double mobility = mobility_of_slip(problem, contact);
    memset(it->result, 0, sizeof *it->result);
    memcpy(it->result->velocities, problem->velocities, (size_t)problem->rows * sizeof(double));
    it->contact = c;
    it->increment = TURN * slip_speed(contact, problem->velocities) / (mobility * contact->friction);
    it->freely = pressed_rise(it, it->increment, false);
    it->lever = it->freely > 0.0 ? pressed_rise(it, it->increment, true) / it->freely : HUGE_VAL;
}

/* Begins to press the contact that slides with the least lever; false: none slides. */
static bool begin_weakest(Press *it) {
    double least = HUGE_VAL;
    int which = -1;
    for (int c = 0; c < it->problem->contacts; c++) {
        if (impact_slides(it->problem, c)) {
            begin_press(it, c);
            which = it->lever < least ? c : which;
            least = fmin(least, it->lever);
        }
    }
    if (which >= 0) {
        begin_press(it, which);
    }
    return which >= 0;
}

/* The increment that would turn or slow the slip by TURN as the last one did, at most twice as much. */
static double next_increment(const Press *it) {
    const ImpactContact *contact = &it->problem->contact[it->contact];
    double change[2] = {0.0, 0.0};
    for (int i = 0; i < contact->slips; i++) {
        change[i] = it->after[contact->slip + i] - it->result->velocities[contact->slip + i];
    }
    const double most = TURN * slip_speed(contact, it->problem->velocities);
    const double changed = vector_length(change, contact->slips);
    return it->increment * (2.0 * changed <= most ? 2.0 : most / changed);
}

/* Presses for as long as the contact sinks in, or rises no more than at the beginning. */
static bool press_until_it_rises(Press *it) {
    const double most_rise = (fmax(it->lever, 0.0) + LOCATED) * it->freely;
    double least = 0.0;
    int presses = 0;
    while (presses < MOST_PRESSES && pressed_rise(it, it->increment, true) <= most_rise) {
        const double next = next_increment(it);
        keep_press(it);
        it->increment = next;
        presses++;
    }
    double most = it->increment;
    for (int i = 0; i < PRESS_BISECTIONS; i++) {
        const double middle = 0.5 * (least + most);
        *(pressed_rise(it, middle, true) <= most_rise ? &least : &most) = middle;
    }
    if (presses == MOST_PRESSES || !press_contact(it, ROW_GIVEN, most, true)) {
        return false;
    }
    keep_press(it);
    return true;
}

bool impacts_without_collision(const ImpactProblem *problem, double most_lever, ImpactResult *result) {
    const ArenaMark mark = arena_mark(problem->arena);
    WORK_OF(mark, Press, it);
    memset(result, 0, sizeof *result);
    memset(it, 0, sizeof *it);
    it->problem = problem;
    it->result = result;
    if (!begin_weakest(it) || !(it->lever <= most_lever) || !press_until_it_rises(it)) {
        return arena_leave(mark, false);
    }
    if (result->velocities[problem->contact[it->contact].normal] < 0.0) {
        if (!press_contact(it, ROW_UNILATERAL, 0.0, true)) {
            return arena_leave(mark, false);
        }
        keep_press(it);
    }
    result->counts[it->contact] = 1;
    result->rounds = 1;
    for (int k = 0; k < problem->rows; k++) {
        result->lost -= 0.5 * result->impulses[k] * (problem->velocities[k] + result->velocities[k]);
    }
    return arena_leave(mark, true);
}
