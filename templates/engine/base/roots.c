#include "roots.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The halvings of [0, 1] after which roots in one part count as one: 2^-48 is 16 roundings of theta. */
enum { DEGREE = ROOT_DEGREE, DEEPEST = 48 };

const double ROOT_PLACES[ROOT_NODES] = {
    0.0, 0.095491502812526287, 0.34549150281252629, 0.65450849718747371, 0.90450849718747371, 1.0,
};

/* A part of the greatest value: the nodes resolve a function if the last two coefficients of its Chebyshev series are
   smaller. Coefficient k is the sum of the values i times 2/5 cos(pi i k/5), half of that at both ends. */
static const double RESOLVED = 0.02;
static const double LAST_BUT_ONE[ROOT_NODES] = {
    0.2, -0.32360679774997897, 0.12360679774997897, 0.12360679774997897, -0.32360679774997897, 0.2,
};
static const double LAST[ROOT_NODES] = {0.2, -0.4, 0.4, -0.4, 0.4, -0.2};

/* The inner coefficients in Bernstein's basis by the values at the nodes: rows of the inverse of the matrix of
   Bernstein's polynomials at the nodes. The outer ones are the outer values. */
static const double FITTED[ROOT_NODES - 2][ROOT_NODES] = {
    {-2.4, 4.188854381999832, -1.1577708763999663, 0.6111456180001682, -0.44222912360003364, 0.2},
    {2.52, -5.294427190999916, 5.8499689437998486, -3.505572809000084, 2.6300310562001514, -1.2},
    {-1.2, 2.6300310562001514, -3.505572809000084, 5.8499689437998486, -5.294427190999916, 2.52},
    {0.2, -0.44222912360003364, 0.6111456180001682, -1.1577708763999663, 4.188854381999832, -2.4},
};

void roots_fit(const double values[], double bernstein[]) {
    bernstein[0] = values[0];
    bernstein[DEGREE] = values[DEGREE];
    for (int j = 1; j < DEGREE; j++) {
        bernstein[j] = 0.0;
        for (int i = 0; i <= DEGREE; i++) {
            bernstein[j] += FITTED[j - 1][i] * values[i];
        }
    }
}

bool roots_resolved(const double values[]) {
    double greatest = 0.0, last[2] = {0.0};
    for (int i = 0; i <= DEGREE; i++) {
        greatest = fabs(values[i]) > greatest ? fabs(values[i]) : greatest;
        last[0] += LAST_BUT_ONE[i] * values[i];
        last[1] += LAST[i] * values[i];
    }
    return fabs(last[0]) <= RESOLVED * greatest && fabs(last[1]) <= RESOLVED * greatest;
}

/* The value of a polynomial of this degree, 1 at least, and its slope, by de Casteljau's scheme. */
static double value_at(const double bernstein[], int degree, double theta, double *slope) {
    double work[ROOT_NODES];
    memcpy(work, bernstein, ((size_t)degree + 1) * sizeof(double));
    for (int k = degree; k > 1; k--) {
        for (int i = 0; i < k; i++) {
            work[i] += theta * (work[i + 1] - work[i]);
        }
    }
    *slope = (double)degree * (work[1] - work[0]);
    return work[0] + theta * (work[1] - work[0]);
}

double roots_slope(const double bernstein[ROOT_NODES], double theta) {
    double slope;
    value_at(bernstein, DEGREE, theta, &slope);
    return slope;
}

static int sign_changes(const double b[], int degree) {
    int changes = 0;
    for (int i = 1; i <= degree; i++) {
        changes += (b[i - 1] > 0.0) != (b[i] > 0.0);
    }
    return changes;
}

/* left[] and right[] are the polynomial b[] on the left and on the right half of its interval, by de Casteljau's
   scheme. */
static void halve(const double b[], int degree, double left[], double right[]) {
    memcpy(right, b, ((size_t)degree + 1) * sizeof(double));
    for (int k = 0; k <= degree; k++) {
        left[k] = right[0];
        for (int i = 0; i < degree - k; i++) {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
    }
}

/* The root of a polynomial that is positive at 0, not at 1, and has one root between: by bisection with Newton's steps
   where they stay inside. */
static double single_root(const double b[], int degree) {
    double low = 0.0, high = 1.0, theta = 0.5, slope;
    for (int i = 0; i < 100 && low < theta && theta < high; i++) {
        const double value = value_at(b, degree, theta, &slope);
        const double next = theta - value / slope;
        if (fabs(next - theta) <= DBL_EPSILON * theta) {
            return theta;
        }
        if (value > 0.0) {
            low = theta;
        } else {
            high = theta;
        }
        theta = next > low && next < high ? next : 0.5 * (low + high);
    }
    return high;
}

/* The first descent in [0, 1], looked for in left halves first; right halves wait until those have none. Roots that lie
   so near together that halving does not part them are one place of descent if the sign changes over them, and none if
   it does not. */
static double first_descent(const double polynomial[], int degree) {
    double waiting[DEEPEST + 2][ROOT_NODES], starts[DEEPEST + 2];
    int depths[DEEPEST + 2], count = 1;
    starts[0] = 0.0;
    depths[0] = 0;
    memcpy(waiting[0], polynomial, (size_t)(degree + 1) * sizeof(double));
    while (count > 0) {
        double b[ROOT_NODES];
        const int depth = depths[--count];
        const double start = starts[count], width = ldexp(1.0, -depth);
        memcpy(b, waiting[count], (size_t)(degree + 1) * sizeof(double));
        const int changes = sign_changes(b, degree);
        if (changes == 1 && b[0] > 0.0) {
            return start + width * single_root(b, degree);
        }
        if (changes > 1 && depth == DEEPEST && b[0] > 0.0 && !(b[degree] > 0.0)) {
            return start + width;
        }
        if (changes > 1 && depth < DEEPEST) {
            halve(b, degree, waiting[count + 1], waiting[count]);
            starts[count + 1] = start;
            starts[count] = start + 0.5 * width;
            depths[count] = depths[count + 1] = depth + 1;
            count += 2;
        }
    }
    return NO_ROOT;
}

/* A polynomial is 0 at 0, up to the noise, and behaves there as theta^k q with q < 0. Does it fall beyond the noise
   before it rises? If not, it leaves 0 slowly upwards, and only a small error of the fit lets it fall at first. */
static bool falls(const double bernstein[], const double q[], int degree, double noise) {
    double raised[ROOT_NODES], negated[ROOT_NODES];
    for (int i = 0; i <= DEGREE; i++) {
        raised[i] = bernstein[i] + 2.0 * noise;
    }
    for (int i = 0; i <= degree; i++) {
        negated[i] = -q[i];
    }
    return first_descent(raised, DEGREE) < first_descent(negated, degree);
}

double roots_first_descent(const double bernstein[ROOT_NODES], double noise) {
    double b[ROOT_NODES];
    int degree = DEGREE;
    memcpy(b, bernstein, sizeof b);
    while (fabs(b[0]) <= noise) { /* counts as 0: p = theta times a polynomial of lesser degree */
        if (degree == 0) {
            return NO_ROOT;
        }
        for (int i = 0; i < degree; i++) {
            b[i] = fabs(b[i + 1]) <= noise ? 0.0 : b[i + 1] * (double)degree / (double)(i + 1);
        }
        degree--;
    }
    if (b[0] < 0.0 && (!(fabs(bernstein[0]) <= noise) || falls(bernstein, b, degree, noise))) {
        return 0.0;
    }
    return first_descent(b, degree);
}
