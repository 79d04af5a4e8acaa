/* Newton's method as in newton.c, without the care that many rows ask for. Where the equations of the last step and of
   the next one are the same, its factors serve again. */
#include "few_rows.h"

#include <math.h>
#include <string.h>

#include "scale.h"
#include "vector_length.h"

/* Bound of Newton's steps; and the most contacts of which all 2^n - 1 ways to rest are tried. */
enum { MOST_FEW_STEPS = 12, MOST_RESTING = 4 };

/* --- the laws */

static int rows_from(const FewRows *few, int k) {
    return few->width[k] == 2 ? 2 : 1;
}

/* The place of a row, or -1. */
static int place_of(int count, const int rows[], int row) {
    int place = count - 1;
    for (; place >= 0 && rows[place] != row; place--) {
    }
    return place;
}

static void take_law(FewRows *few, const SparseProblem *problem, const int rows[], int i) {
    const Row *row = &problem->row[rows[i]];
    const bool rubs = row->law == ROW_TANGENTIAL, second = rubs && row->normal < rows[i] - 1;
    few->law[i] = row->law;
    few->width[i] = row->law == ROW_UNILATERAL ? 0 : second ? -1 : 1;
    few->normal[i] = rubs ? (second ? few->normal[i - 1] : i - 1) : -1;
    few->contacts += row->law == ROW_UNILATERAL;
    few->coulomb = few->coulomb || rubs;
    few->round = few->round || second;
    few->dry = few->dry || row->law == ROW_BOUNDED;
    few->linear = few->linear && row->law == ROW_BILATERAL;
    if (second) {
        few->width[i - 1] = 2;
    }
}

/* Are these all rows of the problem, one after the other? */
static bool rows_in_order(int count, const int rows[], int all) {
    bool in_order = count == all;
    for (int i = 0; i < count; i++) {
        in_order = in_order && rows[i] == i;
    }
    return in_order;
}

/* False: a row does not move by its own force. */
static bool take_matrix(FewRows *few, const SparseProblem *problem, const int rows[]) {
    const Sparse *delassus = &problem->delassus;
    const bool in_order = rows_in_order(few->size, rows, delassus->rows);
    bool regular = true;
    if (delassus->start[delassus->rows] != few->size * few->size) {
        memset(few->matrix, 0, (size_t)few->size * sizeof few->matrix[0]);
    }
    for (int i = 0; i < few->size; i++) {
        for (int e = delassus->start[rows[i]]; e < delassus->start[rows[i] + 1]; e++) {
            const int column = delassus->column[e], place = in_order ? column : place_of(few->size, rows, column);
            few->matrix[i][place] = delassus->value[e];
        }
        regular = regular && few->matrix[i][i] > 0.0;
    }
    return regular;
}

/* Both rows of a cone have one scale. */
static void scale_few(FewRows *few) {
    for (int k = 0; k < few->size; k += rows_from(few, k)) {
        const int rows = rows_from(few, k);
        const double own = rows == 2 ? 0.5 * (few->matrix[k][k] + few->matrix[k + 1][k + 1]) : few->matrix[k][k];
        const double more = rows == 2 ? fabs(few->matrix[k][k] - own) + fabs(few->matrix[k][k + 1]) : 0.0;
        for (int i = k; i < k + rows; i++) {
            few->scale[i] = 1.0 / sqrt(own);
            few->rate[i] = own / (own + more);
        }
    }
    for (int i = 0; i < few->size; i++) {
        for (int j = 0; j < few->size; j++) {
            few->matrix[i][j] *= few->scale[i] * few->scale[j];
        }
    }
}

/* The operator and the kinds of laws. */
static bool take_operator(FewRows *few, const SparseProblem *problem, int count, const int rows[]) {
    few->size = count;
    few->contacts = 0;
    few->coulomb = few->round = few->dry = few->given = false;
    few->linear = true;
    memset(few->state, 0, sizeof few->state);
    memset(few->along, 0, sizeof few->along);
    if (!take_matrix(few, problem, rows)) {
        return false;
    }
    for (int i = 0; i < count; i++) {
        take_law(few, problem, rows, i);
    }
    scale_few(few);
    return true;
}

/* The free motion, the forces to begin with, and coefficients. */
static void take_motion(FewRows *few, const SparseProblem *problem, const int rows[], const double lambda[]) {
    few->usual = 0.0;
    for (int i = 0; i < few->size; i++) {
        const Row *row = &problem->row[rows[i]];
        const double scale = few->scale[i], bound = row->law == ROW_BOUNDED ? row->friction : 0.0;
        few->offset[i] = problem->free[rows[i]] * scale;
        few->usual = fabs(few->offset[i]) > few->usual ? fabs(few->offset[i]) : few->usual;
        few->x[i] = lambda[rows[i]] / scale;
        few->base[i] = (row->law == ROW_BILATERAL ? HUGE_VAL : bound) / scale;
        few->slope[i] = few->normal[i] >= 0 ? row->friction * (few->scale[few->normal[i]] / scale) : 0.0;
        few->holds[i] = row->holds;
    }
}

/* Are rows of the same laws known? Those of a known operator are the same rows. */
static bool few_known(const FewRows *few, const SparseProblem *problem, int count, const int rows[]) {
    bool known = few->known && few->size == count;
    for (int i = 0; i < count && known; i++) {
        known = problem->row[rows[i]].law == few->law[i];
    }
    return known;
}

static bool take_few(FewRows *few, const SparseProblem *problem, int count, const int rows[], const double lambda[]) {
    if (!few_known(few, problem, count, rows)) {
        few->factored = false;
        few->known = take_operator(few, problem, count, rows);
    }
    if (few->known) {
        take_motion(few, problem, rows, lambda);
    }
    few->factored = few->factored && !few->given && few->damping == 0.0;
    few->given = few->unsure = false;
    few->damping = 0.0;
    few->redundant = 0;
    few->left_out = -1;
    return few->known;
}

static double few_limit(const FewRows *few, int k) {
    const int normal = few->normal[k];
    return few->base[k] + (normal >= 0 && few->x[normal] > 0.0 ? few->slope[k] * few->x[normal] : 0.0);
}

/* --- steps */

static void find_w(FewRows *few) {
    for (int i = 0; i < few->size; i++) {
        double w = few->offset[i];
        for (int j = 0; j < few->size; j++) {
            w += few->matrix[i][j] * few->x[j];
        }
        few->w[i] = w;
    }
}

/* Chooses the state of a row or cone at x: held, open or sliding. Returns whether its equations change. */
static bool choose_state(FewRows *few, int k) {
    const int rows = rows_from(few, k), width = few->width[k];
    const FewState before = few->state[k];
    const double limit = width > 0 ? few_limit(few, k) : 0.0, was = few->along[k];
    double trial[2] = {0.0, 0.0};
    for (int i = 0; i < rows; i++) {
        trial[i] = few->x[k + i] - few->rate[k] * few->w[k + i];
    }
    const double length = rows == 2 ? vector_length(trial, 2) : fabs(trial[0]);
    const bool held = width == 0 ? trial[0] > 0.0 : length <= limit && limit > 0.0;
    few->length[k] = length;
    few->state[k] = held ? STATE_HELD : width > 0 && length > 0.0 ? STATE_SLIDING : STATE_OPEN;
    for (int i = 0; i < rows; i++) {
        few->state[k + i] = few->state[k];
        few->along[k + i] = few->state[k] == STATE_SLIDING ? trial[i] / length : 0.0;
    }
    return few->state[k] != before || few->along[k] != was || (rows == 2 && few->state[k] == STATE_SLIDING);
}

static void put_right(FewRows *few, int k) {
    const double limit = few->state[k] == STATE_SLIDING ? few_limit(few, k) : 0.0;
    few->right[k] = few->state[k] == STATE_HELD ? -few->rate[k] * few->w[k] : limit * few->along[k] - few->x[k];
}

/* Rows k and k + 1 of a cone slide: its force turns with its slip. */
static void put_turn(FewRows *few, int k) {
    const double rate = few_limit(few, k) / few->length[k];
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) {
            const double turn = rate * ((i == j ? 1.0 : 0.0) - few->along[k + i] * few->along[k + j]);
            few->factors[k + i][k + j] -= turn;
            for (int column = 0; column < few->size; column++) {
                few->factors[k + i][column] += turn * few->rate[k] * few->matrix[k + j][column];
            }
        }
    }
}

/* The equations of the states. */
static void put_equations(FewRows *few) {
    const size_t bytes = (size_t)few->size * sizeof(double);
    for (int k = 0; k < few->size; k++) {
        const int normal = few->normal[k];
        const bool held = few->state[k] == STATE_HELD;
        if (held) {
            for (int j = 0; j < few->size; j++) {
                few->factors[k][j] = few->rate[k] * few->matrix[k][j];
            }
        } else {
            memset(few->factors[k], 0, bytes);
        }
        few->factors[k][k] += held ? few->damping : 1.0;
        if (few->state[k] == STATE_SLIDING && normal >= 0 && few->x[normal] >= 0.0) {
            few->factors[k][normal] -= few->slope[k] * few->along[k];
        }
    }
    for (int k = 0; k < few->size; k++) {
        if (few->state[k] == STATE_SLIDING && few->width[k] == 2) {
            put_turn(few, k);
        }
    }
}

/* Overwrites the equations by L and U; L has a diagonal of 1. Returns how many pivots are less than least: those rows
   are left out. The last of them is *which. */
static int factorize_few(FewRows *few, double least, int *which) {
    int small = 0;
    for (int i = 0; i < few->size; i++) {
        double *row = few->factors[i];
        for (int j = 0; j < i; j++) {
            const double *other = few->factors[j];
            if (row[j] == 0.0 || !(fabs(other[j]) >= least)) {
                continue;
            }
            row[j] /= other[j];
            const double factor = row[j];
            for (int k = few->size - 1; k > j; k--) {
                row[k] -= factor * other[k];
            }
        }
        if (!(fabs(row[i]) >= least)) {
            small++;
            *which = i;
        }
    }
    return small;
}

/* without[size]: forces that move nothing, from the factors in which row `which` is redundant. */
static void find_without(FewRows *few, int which) {
    double *without = few->without;
    memset(without, 0, sizeof few->without);
    without[which] = 1.0;
    for (int i = which - 1; i >= 0; i--) {
        for (int j = i + 1; j <= which; j++) {
            without[i] -= few->factors[i][j] * without[j];
        }
        without[i] /= few->factors[i][i];
    }
}

/* Puts the equation "no change" in place of that of row `which`. */
static void leave_out(FewRows *few, int which) {
    memset(few->factors[which], 0, sizeof few->factors[which]);
    few->factors[which][which] = 1.0;
    few->left_out = which;
}

/* The factors of the equations. Where rows are redundant, those that are held are damped as in newton.c; a single one
   is left out where the way of sharing forces is chosen later. */
static bool find_factors(FewRows *few) {
    int which = 0;
    put_equations(few);
    if (few->damping == 0.0) {
        few->redundant = factorize_few(few, REDUNDANT, &which);
        if (few->redundant == 0) {
            return true;
        }
        if (few->given && few->redundant == 1 && !few->round && !few->dry) {
            find_without(few, which);
            leave_out(few, which);
            return true;
        }
        few->damping = DAMPING;
        put_equations(few);
    }
    return factorize_few(few, SOLVED, &which) == 0;
}

/* x += the solution of the equations for the right side, which is overwritten. */
static void step_few(FewRows *few) {
    double *change = few->right;
    if (few->left_out >= 0) {
        change[few->left_out] = 0.0;
    }
    for (int i = 0; i < few->size; i++) {
        double rest = change[i];
        for (int j = 0; j < i; j++) {
            rest -= few->factors[i][j] * change[j];
        }
        change[i] = rest;
    }
    for (int i = few->size - 1; i >= 0; i--) {
        double rest = change[i];
        for (int j = i + 1; j < few->size; j++) {
            rest -= few->factors[i][j] * change[j];
        }
        change[i] = rest / few->factors[i][i];
        few->x[i] += change[i];
    }
}

/* Finds w and the right side. Do the equations hold that the states choose? */
static bool few_met(FewRows *few) {
    double rest = 0.0, size = 0.0;
    for (int k = 0; k < few->size; k++) {
        const double force = fabs(few->x[k]);
        put_right(few, k);
        rest += fabs(few->right[k]);
        size = force > size ? force : size;
    }
    return rest <= SOLVED * few->usual + NOISE * size;
}

/* Chooses the states of all rows at x. Returns whether equations change. */
static bool choose_states(FewRows *few) {
    bool others = false;
    for (int k = 0; k < few->size; k += rows_from(few, k)) {
        if (!few->given || (few->width[k] != 0 && few->normal[k] < 0)) {
            others = choose_state(few, k) || others;
        }
    }
    return others;
}

/* From x on. Equations that are linear are solved by one step. */
static bool iterate_few(FewRows *few) {
    bool solved = false, regular = true;
    for (int step = 0; step < MOST_FEW_STEPS && regular && !solved; step++) {
        find_w(few);
        const bool others = choose_states(few) || !few->factored;
        solved = few_met(few);
        few->factored = !others;
        if (!solved) {
            if (others) {
                regular = few->factored = find_factors(few);
            }
            step_few(few);
            solved = regular && few->linear && few->damping == 0.0;
        }
    }
    return solved;
}

/* --- rest */

static bool few_at_rest(const FewRows *few, int k) {
    double terms = fabs(few->offset[k]);
    for (int j = 0; j < few->size; j++) {
        terms += fabs(few->matrix[k][j] * few->x[j]);
    }
    return fabs(few->w[k]) <= ACCEPTED * terms;
}

static bool rows_rest(const FewRows *few, int k) {
    return few->state[k] == STATE_HELD || (few_at_rest(few, k) && (few->width[k] == 1 || few_at_rest(few, k + 1)));
}

/* Does a row of friction move that held at the start, or rub another way than there? Not beside a contact that slides
   on by friction which follows how redundant rows share a load: they share it by least norm, and hold no more. */
static bool few_slip_anew(const FewRows *few, const double start[]) {
    bool anew = false, on = false;
    for (int k = 0; k < few->size && !on; k++) {
        const int width = few->width[k];
        if (width <= 0 || rows_rest(few, k)) {
            continue;
        }
        const double along = few->x[k] * start[k] + (width == 2 ? few->x[k + 1] * start[k + 1] : 0.0);
        on = along > 0.0 && !few->holds[k] && few->normal[k] >= 0 && few->damping > 0.0;
        anew = anew || few->holds[k] || (few_limit(few, k) > 0.0 && !(along > 0.0));
    }
    return anew && !on;
}

/* Does this contact obey its law: closed within its cone, or open and leaving at a greater angle than that of its cone?
   The latter is what the convex program of cones.h asks for. */
static bool obeys_at_rest(const FewRows *few, int k) {
    const bool rubs = k + 1 < few->size && few->normal[k + 1] == k;
    const bool closed = few->state[k] == STATE_HELD;
    const double *along = closed ? few->x : few->w, *across = closed ? few->x : few->w;
    const double size = rubs ? vector_length(across + k + 1, few->width[k + 1]) : 0.0;
    const double limit = !rubs ? HUGE_VAL : closed ? few_limit(few, k + 1) : along[k];
    return along[k] >= 0.0 && size * (rubs && !closed ? few->slope[k + 1] : 1.0) <= limit;
}

static bool all_obey_at_rest(const FewRows *few) {
    bool obey = true;
    for (int k = 0; k < few->size && obey; k++) {
        obey = few->width[k] != 0 || obeys_at_rest(few, k);
    }
    return obey;
}

/* Narrows the interval of parts t with a + t b >= 0. */
static void narrow(double a, double b, double *least, double *most) {
    if (b > 0.0) {
        *least = fmax(*least, -a / b);
    } else if (b < 0.0 || a < 0.0) {
        *most = b < 0.0 ? fmin(*most, -a / b) : -HUGE_VAL;
    }
}

/* Shares the forces of closed contacts in the plane: x + t without obeys the laws for t in an interval, and t becomes
   its middle. Where the interval has one end only, as with bodies that are wedged, t becomes twice that end. */
static void share_few(FewRows *few) {
    double least = -HUGE_VAL, most = HUGE_VAL;
    for (int k = 0; k < few->size; k++) {
        if (few->width[k] != 0 || few->state[k] != STATE_HELD) {
            continue;
        }
        const bool rubs = k + 1 < few->size && few->normal[k + 1] == k;
        const double *x = few->x + k, *change = few->without + k;
        narrow(x[0], change[0], &least, &most);
        for (double way = -1.0; way <= 1.0 && rubs; way += 2.0) {
            const double slope = few->slope[k + 1];
            narrow(slope * x[0] + way * x[1], slope * change[0] + way * change[1], &least, &most);
        }
    }
    const double part = most >= HUGE_VAL ? 2.0 * least : least <= -HUGE_VAL ? 2.0 * most : 0.5 * (least + most);
    for (int k = 0; k < few->size && least <= most && isfinite(part); k++) {
        few->x[k] += part * few->without[k];
    }
}

/* Is there a state of rest in which just these contacts are closed? Contact i has the bit i + 1. */
static bool rest_on(FewRows *few, unsigned closed) {
    int contact = 0;
    few->factored = false;
    few->damping = 0.0;
    few->redundant = 0;
    few->left_out = -1;
    for (int k = 0; k < few->size; k++) {
        contact += few->width[k] == 0;
        few->state[k] = (closed >> contact & 1U) != 0 ? STATE_HELD : STATE_OPEN;
        few->x[k] = 0.0;
    }
    if (!iterate_few(few)) {
        return false;
    }
    bool rests = all_obey_at_rest(few);
    if (!rests && few->left_out >= 0) {
        share_few(few);
        rests = all_obey_at_rest(few);
    }
    few->unsure = few->unsure || (!rests && few->damping > 0.0);
    return rests;
}

static bool rest_few(FewRows *few) {
    bool rests = false;
    few->given = true;
    for (unsigned closed = (1U << few->contacts) - 1U; closed > 0 && !rests; closed--) {
        rests = rest_on(few, closed << 1);
    }
    return rests;
}

/* Does a contact slip whose friction follows how redundant rows share a load? Notes which rows of friction rest. */
static bool sharing_matters(const FewRows *few, bool rests[]) {
    bool matters = false;
    for (int k = 0; k < few->size; k++) {
        rests[k] = few->width[k] > 0 && rows_rest(few, k);
        matters = matters || (few->width[k] > 0 && !rests[k] && few->normal[k] >= 0 && few_limit(few, k) > 0.0);
    }
    return matters;
}

/* Contacts that touch and bear nothing take part in sharing; returns whether there are any. */
static bool hold_idle(FewRows *few) {
    bool any = false;
    for (int k = 0; k < few->size; k++) {
        if (few->width[k] == 0 && few->state[k] == STATE_OPEN && few_at_rest(few, k)) {
            few->state[k] = STATE_HELD;
            any = true;
        }
    }
    few->factored = few->factored && !any;
    return any;
}

/* Takes from x what moves nothing, so that it has the least norm wherever it came from. */
static void centre_few(FewRows *few) {
    if (!find_factors(few)) {
        return;
    }
    for (int k = 0; k < few->size; k++) {
        few->right[k] = few->state[k] == STATE_HELD ? -few->damping * few->x[k] : 0.0;
    }
    step_few(few);
    few->factored = false;
}

/* Rows share a load by least norm where friction follows it. What rests is kept, or may slip then. */
static void even_few(FewRows *few, bool kept) {
    double found[MOST_FEW_ROWS];
    bool rests[MOST_FEW_ROWS];
    if ((!hold_idle(few) && few->damping == 0.0) || !sharing_matters(few, rests)) {
        return;
    }
    memcpy(found, few->x, sizeof found);
    centre_few(few);
    bool even = iterate_few(few);
    for (int k = 0; k < few->size && even; k++) {
        even = !kept || !rests[k] || rows_rest(few, k);
    }
    if (!even) {
        memcpy(few->x, found, sizeof found);
    }
}

/* Without Coulomb's law the motion has one solution. */
static bool solve_few(FewRows *few) {
    double start[MOST_FEW_ROWS], found[MOST_FEW_ROWS];
    const size_t bytes = (size_t)few->size * sizeof(double);
    memcpy(start, few->x, bytes);
    const bool few_ways = few->contacts <= MOST_RESTING;
    const bool solved = iterate_few(few);
    const double damping = few->damping;
    if (solved && !(few->coulomb && few_slip_anew(few, start))) {
        even_few(few, false);
        return true;
    }
    memcpy(found, few->x, bytes);
    if (!few_ways || rest_few(few)) {
        return few_ways;
    }
    memcpy(few->x, found, bytes);
    if (!solved || few->unsure) {
        return false;
    }
    few->given = false;
    few->damping = damping;
    find_w(few);
    choose_states(few);
    even_few(few, true);
    return true;
}

bool few_rows(const SparseProblem *problem, int count, const int rows[], FewRows *few, double lambda[]) {
    if (count > MOST_FEW_ROWS || !take_few(few, problem, count, rows, lambda) || !solve_few(few)) {
        return false;
    }
    for (int i = 0; i < count; i++) {
        lambda[rows[i]] = few->scale[i] * few->x[i];
    }
    return true;
}
