/* Which contacts have to stop is found by trial: first each that slides alone, then all of them together. */
#include "impacts_without_collision.h"

#include <string.h>

#include "complementarity.h"
#include "scale.h"
#include "vector_length.h"

static bool impact_slides(const ImpactProblem *problem, int c) {
    const ImpactContact *contact = &problem->contact[c];
    const double slip = vector_length(problem->velocities + contact->slip, contact->slips);
    return contact->loaded && contact->friction > 0.0 && slip > 0.0;
}

/* Is the impulse that stops a contact within its friction cone? */
static bool possible(const ImpactContact *contact, const double impulses[]) {
    const double normal = impulses[contact->normal];
    const double friction = vector_length(impulses + contact->slip, contact->slips);
    return normal > 0.0 && friction <= (1.0 + OBEYED) * contact->friction * normal;
}

/* Stops one contact, or all that slide for -1. */
static bool stop(const ImpactProblem *problem, int only, ImpactResult *result) {
    const ArenaMark mark = arena_mark(problem->arena);
    WORK(mark, Row, rows, SIZE_ROWS);
    const Problem laws = impacts_describe(problem, problem->velocities, rows);
    for (int c = 0; c < problem->contacts; c++) {
        result->counts[c] = impact_slides(problem, c) && (only < 0 || c == only) ? 1 : 0;
        if (problem->contact[c].loaded) {
            impacts_add(&problem->contact[c], result->counts[c] > 0, 0.0, rows);
        }
    }
    bool stopped = false;
    bool solved = complementarity_solve(&laws, result->impulses, result->velocities);
    for (int c = 0; c < problem->contacts && solved; c++) {
        stopped = stopped || result->counts[c] > 0;
        solved = result->counts[c] == 0 || possible(&problem->contact[c], result->impulses);
    }
    return arena_leave(mark, solved && stopped);
}

bool impacts_without_collision(const ImpactProblem *problem, ImpactResult *result) {
    bool solved = false;
    memset(result, 0, sizeof *result);
    for (int c = 0; c < problem->contacts && !solved; c++) {
        solved = impact_slides(problem, c) && stop(problem, c, result);
    }
    solved = solved || stop(problem, -1, result);
    result->rounds = 1;
    for (int k = 0; k < problem->rows; k++) {
        result->lost -= 0.5 * result->impulses[k] * (problem->velocities[k] + result->velocities[k]);
    }
    return solved;
}
