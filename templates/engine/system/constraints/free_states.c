#include "free_states.h"

#include <string.h>

#include "constraint_factorization.h"

static bool is_free(Level level, Freedom freedom, int i) {
    return freedom == ALL_STATES || !GIVEN_STATES[(level == POSITIONS ? 0 : N) + i];
}

void start_factorize(Arena *arena, ConstraintFactorization *work, const double jacobian[], Level level, Freedom freedom,
                     double damping) {
    memcpy(work->jacobian, jacobian, sizeof work->jacobian);
    for (int k = 0; k < rows_of(level); k++) {
        for (int i = 0; i < N; i++) {
            const double weight = is_free(level, freedom, i) ? NOMINAL_STATES[i] * NOMINAL_STATES[i] : 0.0;
            work->response[k * N + i] = weight * jacobian[k * N + i];
        }
    }
    constraints_factorize(arena, work, rows_of(level), NULL, damping);
}
