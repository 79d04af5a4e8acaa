/* Rounds of impacts, their laws and their balance of energy. */
#include "impacts.h"

#include <math.h>
#include <string.h>

#include "complementarity.h"

enum { MOST_ROUNDS = 5000, MORE_ROUNDS = 100, BISECTIONS = 60 };

/* Velocities of this part of the greatest one, each in units of its row, are rounding errors; so is such a part of the
   terms of the kinetic energy. */
static const double ROUNDING = 1e-12;

/* An impact that takes place at once. */
typedef struct {
    const ImpactProblem *problem;
    double before[SIZE_ROWS];
    bool takes_part[SIZE_CONTACTS];
    double restitution[SIZE_CONTACTS];
    double impulses[SIZE_ROWS];
    double after[SIZE_ROWS];
} Round;

/* Rows that bear no impulse but bilateral ones. The velocities are those to start from. */
static Problem describe(const ImpactProblem *problem, const double velocities[], Row rows[]) {
    for (int k = 0; k < problem->rows; k++) {
        memset(&rows[k], 0, sizeof rows[k]);
        rows[k].law = problem->bilateral[k] ? ROW_BILATERAL : ROW_FREE;
    }
    return (Problem){problem->rows, problem->delassus, velocities, rows};
}

/* A contact that takes part, with this least normal impulse. */
static void add_contact(const Round *round, int c, double least, Row rows[]) {
    const ImpactContact *contact = &round->problem->contact[c];
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
    Row rows[SIZE_ROWS];
    double free[SIZE_ROWS], w[SIZE_ROWS];
    const ImpactProblem *problem = round->problem;
    memcpy(free, round->before, sizeof free);
    const Problem laws = describe(problem, free, rows);
    for (int c = 0; c < problem->contacts; c++) {
        if (round->takes_part[c]) {
            const int k = problem->contact[c].normal;
            add_contact(round, c, 0.0, rows);
            free[k] += round->restitution[c] * fmin(round->before[k], 0.0);
        }
    }
    if (!complementarity_solve(&laws, round->impulses, w)) {
        return false;
    }
    for (int k = 0; k < problem->rows; k++) {
        round->after[k] = w[k] - (free[k] - round->before[k]);
    }
    return true;
}

/* Poisson's law with this part of the restitution: after a phase of compression, of which the velocities at its end
   are 0 or more, the expansion returns at least the restitution's part of each normal impulse. Pfeiffer, Glocker,
   Multibody Dynamics with Unilateral Contacts, 1996, chapter 8. */
static bool poisson(Round *round, double part) {
    Row rows[SIZE_ROWS];
    double compression[SIZE_ROWS], middle[SIZE_ROWS];
    const ImpactProblem *problem = round->problem;
    Problem laws = describe(problem, round->before, rows);
    for (int phase = 0; phase < 2; phase++) {
        for (int c = 0; c < problem->contacts; c++) {
            const double returned = part * round->restitution[c];
            if (round->takes_part[c]) {
                add_contact(round, c, phase == 0 ? 0.0 : returned * compression[problem->contact[c].normal], rows);
            }
        }
        laws.free = phase == 0 ? round->before : middle;
        if (!complementarity_solve(&laws, phase == 0 ? compression : round->impulses,
                                   phase == 0 ? middle : round->after)) {
            return false;
        }
    }
    for (int k = 0; k < problem->rows; k++) {
        round->impulses[k] += compression[k];
    }
    return true;
}

/* The kinetic energy that is lost, and the sum of its absolute terms. */
static double lost_energy(const Round *round, double *terms) {
    double lost = 0.0;
    *terms = 0.0;
    for (int k = 0; k < round->problem->rows; k++) {
        lost -= 0.5 * round->impulses[k] * (round->before[k] + round->after[k]);
        *terms += 0.5 * fabs(round->impulses[k]) * (fabs(round->before[k]) + fabs(round->after[k]));
    }
    return lost;
}

static bool dissipates(const Round *round) {
    double terms;
    return lost_energy(round, &terms) >= -ROUNDING * terms;
}

/* The greatest part of the restitution with which Poisson's law does not make the energy grow. Without restitution it
   never does. */
static bool reduce(Round *round) {
    double least = 0.0, most = 1.0;
    for (int i = 0; i < BISECTIONS; i++) {
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

static void start(const ImpactProblem *problem, Round *round, ImpactResult *result) {
    memset(round, 0, sizeof *round);
    memset(result, 0, sizeof *result);
    round->problem = problem;
    memcpy(round->before, problem->velocities, (size_t)problem->rows * sizeof(double));
}

/* Normal velocities of the contacts up to these are rest. */
static void find_slow(const ImpactProblem *problem, double slow[]) {
    double fastest = 0.0;
    for (int c = 0; c < problem->contacts; c++) {
        const int first = problem->contact[c].slip, end = first + problem->contact[c].slips;
        for (int i = first - 1; i < end; i++) {
            const int k = i < first ? problem->contact[c].normal : i;
            const double inverse_mass = problem->delassus[k * problem->rows + k];
            const double speed = fabs(problem->velocities[k]);
            fastest = inverse_mass > 0.0 ? fmax(fastest, speed / sqrt(inverse_mass)) : fastest;
        }
    }
    for (int c = 0; c < problem->contacts; c++) {
        const int k = problem->contact[c].normal;
        const double rounding = ROUNDING * fastest * sqrt(fmax(problem->delassus[k * problem->rows + k], 0.0));
        slow[c] = fmax(problem->contact[c].slow, rounding);
    }
}

/* Chooses who takes part in the next round; returns whether any contact approaches. */
static bool next_round(Round *round, const double slow[], const bool loaded[], int counts[]) {
    bool any = false;
    for (int c = 0; c < round->problem->contacts; c++) {
        const double velocity = round->before[round->problem->contact[c].normal];
        const bool approaches = velocity < -slow[c];
        round->takes_part[c] = approaches || (loaded[c] && velocity <= slow[c]);
        round->restitution[c] = approaches ? round->problem->contact[c].restitution : 0.0;
        counts[c] += approaches ? 1 : 0;
        any = any || approaches;
    }
    return any;
}

static bool solve_in_turn(Round *round, const double slow[], ImpactResult *result) {
    const ImpactProblem *problem = round->problem;
    const int most = MOST_ROUNDS + MORE_ROUNDS * problem->contacts;
    bool loaded[SIZE_CONTACTS];
    for (int c = 0; c < problem->contacts; c++) {
        loaded[c] = problem->contact[c].loaded;
    }
    while (next_round(round, slow, loaded, result->counts)) {
        result->closed = result->rounds == most;
        for (int c = 0; c < problem->contacts && result->closed; c++) {
            round->takes_part[c] = true;
            round->restitution[c] = 0.0;
        }
        if (!collide(round, result)) {
            return false;
        }
        if (result->closed) {
            break;
        }
        for (int c = 0; c < problem->contacts; c++) {
            loaded[c] = loaded[c] || (round->takes_part[c] && round->impulses[problem->contact[c].normal] > 0.0);
        }
    }
    return true;
}

/* Without an approach nothing happens. */
static bool solve_at_once(Round *round, const double slow[], ImpactResult *result) {
    const bool loaded[SIZE_CONTACTS] = {false};
    if (!next_round(round, slow, loaded, result->counts)) {
        return true;
    }
    for (int c = 0; c < round->problem->contacts; c++) {
        round->takes_part[c] = true;
    }
    return collide(round, result);
}

bool impacts_solve(const ImpactProblem *problem, ImpactOrder order, ImpactResult *result) {
    Round round;
    double slow[SIZE_CONTACTS];
    start(problem, &round, result);
    find_slow(problem, slow);
    const bool solved = order == IMPACTS_SEQUENTIAL ? solve_in_turn(&round, slow, result)
                                                    : solve_at_once(&round, slow, result);
    memcpy(result->velocities, round.before, sizeof result->velocities);
    return solved;
}
