/* Rounds of impacts, their laws and their balance of energy. */
#include "impacts.h"

#include <math.h>
#include <string.h>

#include "complementarity.h"
#include "scale.h"

/* Bounds of the rounds: MOST_IMPACT_ROUNDS, and MORE_ROUNDS for each contact; an impact of all contacts without
   restitution is the last one. Bisections: 60 bring an interval of 1 to rounding. */
enum { MOST_IMPACT_ROUNDS = 5000, MORE_ROUNDS = 100, IMPACT_BISECTIONS = 60 };

/* An impact that takes place at once. */
typedef struct {
    const ImpactProblem *problem;
    double before[SIZE_ROWS];
    bool takes_part[SIZE_CONTACTS];
    double restitution[SIZE_CONTACTS];
    double impulses[SIZE_ROWS];
    double after[SIZE_ROWS];
} Round;

Problem impacts_describe(const ImpactProblem *problem, const double velocities[], Row rows[]) {
    for (int k = 0; k < problem->rows; k++) {
        memset(&rows[k], 0, sizeof rows[k]);
        rows[k].law = problem->bilateral[k] ? ROW_BILATERAL : ROW_FREE;
    }
    return (Problem){.arena = problem->arena,
                     .rows = problem->rows,
                     .delassus = problem->delassus,
                     .free = velocities,
                     .row = rows};
}

void impacts_add(const ImpactContact *contact, double least, Row rows[]) {
    rows[contact->normal].law = ROW_UNILATERAL;
    rows[contact->normal].value = least;
    for (int k = contact->slip; k < contact->slip + contact->slips; k++) {
        rows[k].law = ROW_TANGENTIAL;
        rows[k].normal = contact->normal;
        rows[k].friction = contact->friction;
        rows[k].holding = contact->friction;
    }
}

/* Newton's law. */
static bool newton(Round *round) {
    const ArenaMark mark = arena_mark(round->problem->arena);
    WORK(mark, Row, rows, SIZE_ROWS);
    WORK(mark, double, free, SIZE_ROWS);
    WORK(mark, double, w, SIZE_ROWS);
    const ImpactProblem *problem = round->problem;
    memcpy(free, round->before, SIZE_ROWS * sizeof(double));
    const Problem laws = impacts_describe(problem, free, rows);
    for (int c = 0; c < problem->contacts; c++) {
        if (round->takes_part[c]) {
            const int k = problem->contact[c].normal;
            impacts_add(&problem->contact[c], 0.0, rows);
            free[k] += round->restitution[c] * fmin(round->before[k], 0.0);
        }
    }
    if (!complementarity_solve(&laws, round->impulses, w)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < problem->rows; k++) {
        round->after[k] = w[k] - (free[k] - round->before[k]);
    }
    return arena_leave(mark, true);
}

/* Poisson's law with `part` times each coefficient of restitution: at the end of compression the normal velocities are
   0 or more; expansion then returns at least part * restitution of the normal impulse of compression. Pfeiffer,
   Glocker, Multibody Dynamics with Unilateral Contacts, 1996, chapter 8. */
static bool poisson(Round *round, double part) {
    const ArenaMark mark = arena_mark(round->problem->arena);
    WORK(mark, Row, rows, SIZE_ROWS);
    WORK(mark, double, compression, SIZE_ROWS);
    WORK(mark, double, middle, SIZE_ROWS);
    const ImpactProblem *problem = round->problem;
    Problem laws = impacts_describe(problem, round->before, rows);
    for (int phase = 0; phase < 2; phase++) {
        for (int c = 0; c < problem->contacts; c++) {
            const ImpactContact *contact = &problem->contact[c];
            const double least = phase == 0 ? 0.0 : part * round->restitution[c] * compression[contact->normal];
            if (round->takes_part[c]) {
                impacts_add(contact, least, rows);
            }
        }
        laws.free = phase == 0 ? round->before : middle;
        if (!complementarity_solve(&laws, phase == 0 ? compression : round->impulses,
                                   phase == 0 ? middle : round->after)) {
            return arena_leave(mark, false);
        }
    }
    for (int k = 0; k < problem->rows; k++) {
        round->impulses[k] += compression[k];
    }
    return arena_leave(mark, true);
}

/* The kinetic energy that is lost, and the sum of the absolute terms that it follows from. */
static double lost_energy(const Round *round, double *terms) {
    const int n = round->problem->rows;
    double lost = 0.0;
    *terms = 0.0;
    for (int k = 0; k < n; k++) {
        const double impulse = round->impulses[k];
        lost -= 0.5 * impulse * (round->before[k] + round->after[k]);
        *terms += fabs(impulse * round->before[k]);
        for (int j = 0; j < n; j++) {
            *terms += fabs(impulse * round->problem->delassus[k * n + j] * round->impulses[j]);
        }
    }
    return lost;
}

static bool dissipates(const Round *round) {
    double terms;
    return lost_energy(round, &terms) >= -MET * terms;
}

/* Poisson's law with the greatest part of the restitution that does not make the kinetic energy grow; part 0 never
   does. */
static bool reduce(Round *round) {
    double least = 0.0, most = 1.0;
    for (int i = 0; i < IMPACT_BISECTIONS; i++) {
        const double middle = 0.5 * (least + most);
        *(poisson(round, middle) && dissipates(round) ? &least : &most) = middle;
    }
    return poisson(round, least);
}

/* One impact of the contacts that take part. */
static bool collide(Round *round, ImpactResult *result) {
    if (!newton(round) || !dissipates(round)) {
        result->poisson = true;
        if (!poisson(round, 1.0)) {
            return false;
        }
        if (!dissipates(round)) {
            result->reduced = true;
            if (!reduce(round)) {
                return false;
            }
        }
    }
    double terms;
    result->lost += lost_energy(round, &terms);
    result->rounds++;
    for (int k = 0; k < round->problem->rows; k++) {
        result->impulses[k] += round->impulses[k];
    }
    memcpy(round->before, round->after, sizeof round->before);
    return true;
}

static void start(const ImpactProblem *problem, Round *round) {
    memset(round, 0, sizeof *round);
    round->problem = problem;
    memcpy(round->before, problem->velocities, (size_t)problem->rows * sizeof(double));
}

/* slow[rows]: the velocity along each row up to which the row is at rest. It is MET of the fastest one, each over the
   square root of its diagonal entry of the Delassus operator, and along a normal no less than contact->slow. */
static void find_slow(const ImpactProblem *problem, double slow[]) {
    const ArenaMark mark = arena_mark(problem->arena);
    WORK(mark, bool, counts, SIZE_ROWS);
    double fastest = 0.0;
    memcpy(counts, problem->bilateral, (size_t)problem->rows * sizeof(bool));
    for (int c = 0; c < problem->contacts; c++) {
        const ImpactContact *contact = &problem->contact[c];
        counts[contact->normal] = true;
        for (int k = contact->slip; k < contact->slip + contact->slips; k++) {
            counts[k] = true;
        }
    }
    for (int k = 0; k < problem->rows; k++) {
        slow[k] = sqrt(fmax(problem->delassus[k * problem->rows + k], 0.0));
        fastest = counts[k] && slow[k] > 0.0 ? fmax(fastest, fabs(problem->velocities[k]) / slow[k]) : fastest;
    }
    for (int k = 0; k < problem->rows; k++) {
        slow[k] *= MET * fastest;
    }
    for (int c = 0; c < problem->contacts; c++) {
        const ImpactContact *contact = &problem->contact[c];
        slow[contact->normal] = fmax(contact->slow, slow[contact->normal]);
    }
    arena_release(mark);
}

/* Does a bilateral row still move, as one does that begins to hold? */
static bool is_caught(const Round *round, const double slow[]) {
    bool any = false;
    for (int k = 0; k < round->problem->rows; k++) {
        any = any || (round->problem->bilateral[k] && fabs(round->before[k]) > slow[k]);
    }
    return any;
}

/* Does a contact approach that rebounds; or, if it need not rebound, any? */
static bool any_approaches(const Round *round, const double slow[], bool rebounds) {
    bool any = false;
    for (int c = 0; c < round->problem->contacts; c++) {
        const ImpactContact *contact = &round->problem->contact[c];
        const bool counts = !rebounds || contact->restitution > 0.0;
        any = any || (counts && round->before[contact->normal] < -slow[contact->normal]);
    }
    return any;
}

/* Chooses who takes part in the next round; returns whether any contact approaches. Where none of them rebounds, those
   take part that an earlier round has stopped: in turn they would come to the same velocities in rounds without end. */
static bool next_round(Round *round, const double slow[], ImpactResult *result) {
    const bool plastic = !any_approaches(round, slow, true);
    for (int c = 0; c < round->problem->contacts; c++) {
        const ImpactContact *contact = &round->problem->contact[c];
        const int normal = contact->normal;
        const double velocity = round->before[normal];
        const bool approaches = velocity < -slow[normal];
        const bool stopped = plastic && contact->restitution == 0.0 && result->impulses[normal] > 0.0;
        round->takes_part[c] = approaches || ((contact->loaded || stopped) && velocity <= slow[normal]);
        round->restitution[c] = approaches ? contact->restitution : 0.0;
        result->counts[c] += approaches ? 1 : 0;
    }
    return any_approaches(round, slow, false);
}

/* Does the next round depend on whether a contact is under load that has come to rest by its impulse? */
static bool lacks_loads(const Round *round, const double slow[]) {
    bool any = false;
    if (!any_approaches(round, slow, true)) {
        return false;
    }
    for (int c = 0; c < round->problem->contacts; c++) {
        const ImpactContact *contact = &round->problem->contact[c];
        any = any || (round->takes_part[c] && !contact->loaded && round->impulses[contact->normal] > 0.0 &&
                      fabs(round->before[contact->normal]) <= slow[contact->normal]);
    }
    return any;
}

static bool solve_in_turn(Round *round, const double slow[], ImpactResult *result) {
    const ImpactProblem *problem = round->problem;
    const int most = MOST_IMPACT_ROUNDS + MORE_ROUNDS * problem->contacts;
    while (next_round(round, slow, result) || (result->rounds == 0 && is_caught(round, slow))) {
        result->closed = result->rounds >= most;
        for (int c = 0; c < problem->contacts && result->closed; c++) {
            round->takes_part[c] = true;
            round->restitution[c] = 0.0;
        }
        if (!collide(round, result)) {
            return false;
        }
        if (result->closed || problem->one_round || lacks_loads(round, slow)) {
            break;
        }
    }
    return true;
}

static bool solve_at_once(Round *round, const double slow[], ImpactResult *result) {
    if (!next_round(round, slow, result) && !is_caught(round, slow)) {
        return true;
    }
    for (int c = 0; c < round->problem->contacts; c++) {
        round->takes_part[c] = true;
    }
    return collide(round, result);
}

bool impacts_solve(const ImpactProblem *problem, ImpactOrder order, ImpactResult *result) {
    const ArenaMark mark = arena_mark(problem->arena);
    WORK_OF(mark, Round, round);
    WORK(mark, double, slow, SIZE_ROWS);
    start(problem, round);
    find_slow(problem, slow);
    const bool solved = order == IMPACTS_SEQUENTIAL ? solve_in_turn(round, slow, result)
                                                    : solve_at_once(round, slow, result);
    memcpy(result->velocities, round->before, sizeof result->velocities);
    return arena_leave(mark, solved);
}
