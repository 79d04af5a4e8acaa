/* The solver of M a = b on its own, for the 2 x 2 matrices of the double pendulum's size. */
#include <math.h>

#include "checks.h"
#include "host.h"
#include "linear_solve.h"

enum { UNUSED = 12345 }; /* stands above the diagonal, which must not be read */

void check_mass_solve(void) {
    static const struct {
        double mass[4];
        bool pivoted;
    } MATRICES[] = {
        {{2.0, UNUSED, 1.0, 3.0}, false},         /* positive definite */
        {{1e-30, UNUSED, 0.0, 1e+30}, false},     /* units far apart are no singularity */
        {{1e-30, UNUSED, 0.9, 1e+30}, false},
        {{0.0, UNUSED, 1.0, 0.0}, true},          /* regular, no pivot on the diagonal */
        {{0.0, UNUSED, 1e-20, 3.0}, true},
        {{1.0, UNUSED, 2.0, 1.0}, true},          /* indefinite */
        {{-2.0, UNUSED, 0.5, -1.0}, true},
    };
    for (size_t i = 0; i < sizeof MATRICES / sizeof MATRICES[0]; i++) {
        const double *m = MATRICES[i].mass;
        Factorization factorization;
        bool concerned[2] = {false, false};
        double work[2];
        const double expected[2] = {3.0, -7.0};
        double a[2] = {m[0] * 3.0 - m[2] * 7.0, m[2] * 3.0 - m[3] * 7.0};
        CHECK(mass_factorize(m, &factorization, concerned) == MASS_REGULAR);
        CHECK(factorization.pivoted == MATRICES[i].pivoted && !concerned[0] && !concerned[1]);
        mass_solve(&factorization, a, work);
        const double error[2] = {a[0] - expected[0], a[1] - expected[1]}; /* M error is small, row by row */
        CHECK(fabs(m[0] * error[0] + m[2] * error[1]) <= 1e-14 * (fabs(m[0]) + fabs(m[2])));
        CHECK(fabs(m[2] * error[0] + m[3] * error[1]) <= 1e-14 * (fabs(m[2]) + fabs(m[3])));
    }
}

void check_mass_refusals(void) {
    static const struct {
        double mass[4];
        MassOutcome outcome;
        bool first, second;
    } MATRICES[] = {
        {{1.0, UNUSED, 1.0, 1.0}, MASS_SINGULAR, true, true}, /* both take part in the null vector */
        {{1.0, UNUSED, 0.0, 0.0}, MASS_SINGULAR, false, true},
        {{0.0, UNUSED, 0.0, 1.0}, MASS_SINGULAR, true, false},
        {{0.0, UNUSED, 0.0, 0.0}, MASS_SINGULAR, true, true},
        {{1e-30, UNUSED, 1.0, 1e+30}, MASS_SINGULAR, true, true}, /* whatever the units */
        {{1.0, UNUSED, 0.0, NAN}, MASS_NOT_FINITE, false, true},
        {{HUGE_VAL, UNUSED, 0.0, 1.0}, MASS_NOT_FINITE, true, false},
        {{1.0, UNUSED, NAN, 1.0}, MASS_NOT_FINITE, true, true},
    };
    for (size_t i = 0; i < sizeof MATRICES / sizeof MATRICES[0]; i++) {
        Factorization factorization;
        bool concerned[2] = {false, false};
        CHECK(mass_factorize(MATRICES[i].mass, &factorization, concerned) == MATRICES[i].outcome);
        CHECK(concerned[0] == MATRICES[i].first && concerned[1] == MATRICES[i].second);
    }
}
