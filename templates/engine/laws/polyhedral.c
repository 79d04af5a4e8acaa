/* Contacts in the plane and bounded rows as one linear complementarity problem. For a row of friction its x is the
   difference of two variables >= 0, one for each direction; a third one, the slip, is positive where they reach the
   limit: Stewart, Trinkle 1996. The matrix is copositive unless rows slide. */
#include "polyhedral.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "lemke.h"
#include "scale.h"

/* More choices are not tried one by one when a solution is looked for. */
static const double MOST_CHOICES = 4096.0;

/* More choices are not tried one by one when another solution is looked for, which happens at each event. */
static const double MOST_OTHERS = 81.0;

/* A variable of the complementarity problem is: x of a row with a sign, or a slip (sign 0). */
typedef struct {
    int count;
    int row[LCP_SIZE];
    double sign[LCP_SIZE];
    int slip[LCP_SIZE]; /* of a direction: its slip variable, else -1 */
    int first[MOST_ACTIVE];  /* row -> its first variable */
} Layout;

static void add(Layout *layout, int row, double sign, int slip) {
    const int v = layout->count++;
    layout->row[v] = row;
    layout->sign[v] = sign;
    layout->slip[v] = slip;
}

static void lay_out(const Laws *laws, Layout *layout) {
    layout->count = 0;
    for (int k = 0; k < laws->size; k++) {
        layout->first[k] = layout->count;
        const int width = laws->width[k];
        if (width == 0) {
            add(layout, k, 1.0, -1);
            continue;
        }
        const int slip = layout->count + 2 * width;
        for (int i = 0; i < width; i++) {
            layout->first[k + i] = layout->count;
            add(layout, k + i, 1.0, slip);
            add(layout, k + i, -1.0, slip);
        }
        add(layout, k, 0.0, -1);
        k += width - 1;
    }
}

/* The row of the slip: limit - the sum of both directions >= 0. */
static void fill_limit(const Laws *laws, const Layout *layout, int v, Lcp *lcp) {
    const int k = layout->row[v];
    double *entries = lcp->matrix + v * lcp->size;
    lcp->offset[v] = laws->base[k];
    for (int j = 0; j < lcp->size; j++) {
        entries[j] = layout->slip[j] == v ? -1.0 : 0.0;
    }
    if (laws->normal[k] >= 0) {
        entries[layout->first[laws->normal[k]]] = laws->slope[k];
    }
}

static void fill(const Laws *laws, const Layout *layout, Lcp *lcp) {
    lcp->size = layout->count;
    for (int v = 0; v < lcp->size; v++) {
        const int k = layout->row[v];
        if (layout->sign[v] == 0.0) {
            fill_limit(laws, layout, v, lcp);
            continue;
        }
        lcp->offset[v] = layout->sign[v] * laws->offset[k];
        for (int j = 0; j < lcp->size; j++) {
            const double entry = laws->matrix[k * laws->size + layout->row[j]];
            lcp->matrix[v * lcp->size + j] = layout->sign[v] * layout->sign[j] * entry;
        }
        if (layout->slip[v] >= 0) {
            lcp->matrix[v * lcp->size + layout->slip[v]] = 1.0;
        }
    }
}

/* x of a row of friction is its limit, on this side. */
static void put_limit(const Laws *laws, int k, double side, Choice *choice) {
    choice->value[k] = side * laws->base[k];
    choice->slope[k] = laws->normal[k] >= 0 ? side * laws->slope[k] : 0.0;
}

/* The equations of the variables that are positive. */
static void choose(const Laws *laws, const Layout *layout, const bool positive[], Choice *choice) {
    memset(choice, 0, sizeof *choice);
    for (int k = 0; k < laws->size; k++) {
        const int v = layout->first[k];
        if (laws->width[k] == 0) {
            choice->held[k] = positive[v];
            continue;
        }
        const bool forward = positive[v], backward = positive[v + 1];
        const double side = (forward ? 1.0 : 0.0) - (backward ? 1.0 : 0.0);
        choice->held[k] = !positive[layout->slip[v]] || (forward && backward);
        put_limit(laws, k, side, choice);
    }
}

/* One equation after the other for each row, the last row turning fastest: open, held; held, backward, forward. False
   when all were had. */
static bool next_choice(const Laws *laws, int digit[]) {
    for (int k = laws->size - 1; k >= 0; k--) {
        digit[k] = (digit[k] + 1) % (laws->width[k] == 0 ? 2 : 3);
        if (digit[k] > 0) {
            return true;
        }
    }
    return false;
}

static double count_choices(const Laws *laws) {
    double choices = 1.0;
    for (int k = 0; k < laws->size; k++) {
        choices *= laws->width[k] == 0 ? 2.0 : 3.0;
    }
    return choices;
}

/* The first row whose accelerations differ, where these are `own` for the one and w of x for the other; -1: none. */
static int moved_row(const Laws *laws, const double own[], const double x[]) {
    double w[MOST_ACTIVE], greatest = 0.0, terms = 0.0;
    laws_evaluate(laws, x, w);
    for (int k = 0; k < laws->size; k++) {
        greatest = fmax(greatest, fmax(fabs(own[k]), fabs(w[k])));
        terms = fmax(terms, laws_terms(laws, x, k));
    }
    for (int k = 0; k < laws->size; k++) {
        if (fabs(w[k] - own[k]) > fmax(LOCATED * greatest, TOLERATED * terms)) {
            return k;
        }
    }
    return -1;
}

/* Tries all choices in turn; with accelerations that are known, those of another motion. */
static bool enumerate(const Laws *laws, const double known[], double x[]) {
    int digit[MOST_ACTIVE] = {0};
    bool solved = false;
    for (bool more = true; more && !solved; more = next_choice(laws, digit)) {
        Choice choice;
        memset(&choice, 0, sizeof choice);
        for (int k = 0; k < laws->size; k++) {
            const bool unilateral = laws->width[k] == 0;
            const double side = digit[k] == 0 ? 0.0 : digit[k] == 1 ? -1.0 : 1.0;
            choice.held[k] = digit[k] == (unilateral ? 1 : 0);
            put_limit(laws, k, unilateral ? 0.0 : side, &choice);
        }
        memset(x, 0, (size_t)laws->size * sizeof(double));
        solved = laws_try(laws, &choice, x) && (known == NULL || moved_row(laws, known, x) >= 0);
    }
    return solved;
}

int polyhedral_other(const Laws *laws, const double x[]) {
    double other[MOST_ACTIVE], own[MOST_ACTIVE];
    laws_evaluate(laws, x, own);
    const bool found = count_choices(laws) <= MOST_OTHERS && enumerate(laws, own, other);
    return found ? moved_row(laws, own, other) : -1;
}

static bool approximate(const Laws *laws, Choice *choice, double x[]) {
    Layout layout;
    Lcp lcp;
    double z[LCP_SIZE];
    bool positive[LCP_SIZE];
    lay_out(laws, &layout);
    fill(laws, &layout, &lcp);
    const bool solved = lemke_solve(&lcp, z, positive);
    memset(x, 0, (size_t)laws->size * sizeof(double));
    for (int v = 0; v < lcp.size; v++) {
        x[layout.row[v]] += layout.sign[v] * z[v];
    }
    choose(laws, &layout, positive, choice);
    return solved;
}

void polyhedral_approximate(const Laws *laws, double x[]) {
    Choice choice;
    approximate(laws, &choice, x);
}

bool polyhedral_solve(const Laws *laws, double x[]) {
    Choice choice;
    return (approximate(laws, &choice, x) && laws_try(laws, &choice, x)) ||
           (count_choices(laws) <= MOST_CHOICES && enumerate(laws, NULL, x));
}
