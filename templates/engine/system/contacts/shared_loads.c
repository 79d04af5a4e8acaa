/* The multipliers are those of least norm and a sum of loads that no motion feels. What the sum has to be follows by an
   interior-point method: each margin is a cone with a logarithmic barrier, whose weight tau tends to 0. Steps are those
   of Newton's method, damped as for self-concordant functions. Boyd, Vandenberghe, Convex Optimization, 2004, sections
   9.6 and 11.6. */
#include "shared_loads.h"

#include <math.h>
#include <string.h>

#include "constraint_factorization.h"
#include "lu.h"
#include "scale.h"
#include "vector_length.h"

enum { MOST_CONES = SIZE_UNILATERALS + SIZE_FRICTIONS, MOST_SHARING_STEPS = 50 };

/* Relative to the load: what no motion feels but for rounding, and a margin that has no bound. */
static const double UNBOUNDED = 1e3;

/* Margins of this part of the greatest load are no matter of sharing. */
static const double NO_MATTER = 0.01;

/* tau falls by this factor to its last value, MET. That of the greatest margin is TOLERATED, because its matrices have
   entries of 1/tau^2 beside those of 1 that decide on the loads which do not matter to the margin. */
static const double FALL = 0.1;

/* s = offset + slope x > |t|, t = force + tangent x, for the weights x of the loads; there are width entries of t. */
typedef struct {
    int width;
    int room; /* entries of slope and of each row of tangent: at least those of the loads, and one more */
    double offset, *slope;
    double force[2], *tangent[2];
} Cone;

typedef struct {
    const Sharing *sharing;
    int loads, cones, size; /* of x: the weights of the loads, then the least margin if it is asked for */
    double *load[K + 1];    /* each [m]; orthonormal, in units of the scaled rows; behind them memory for another one */
    double least[K];        /* the scaled multipliers of least norm */
    double greatest;        /* of them */
    Cone cone[MOST_CONES];
    double x[K + 1];
} Shares;

static double shares_product(const double a[], const double b[], int size) {
    double sum = 0.0;
    for (int i = 0; i < size; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static double scale_of(const Shares *p, int row) {
    return p->sharing->constraints->scale[row];
}

/* unfelt[m] = what no motion feels of a unit of the scaled row. */
static void project_row(const Shares *p, int row, double unfelt[]) {
    const ArenaMark mark = arena_mark(p->sharing->arena);
    WORK_ZEROS(mark, double, felt, K);
    felt[row] = scale_of(p, row);
    constraints_spread(p->sharing->arena, p->sharing->constraints, felt);
    for (int k = 0; k < K; k++) {
        unfelt[k] = scale_of(p, k) > 0.0 ? (k == row ? 1.0 : 0.0) - felt[k] / scale_of(p, k) : 0.0;
    }
    arena_release(mark);
}

/* So many doubles; NULL where there is no memory. */
static double *take_shares(const Shares *p, size_t count) {
    Arena *arena = p->sharing->arena;
    return arena_reserve(arena, arena_bytes(count, sizeof(double))) ? arena_take(arena, count * sizeof(double)) : NULL;
}

/* By the method of Gram and Schmidt, twice for the sake of rounding. False: there is no memory. */
static bool find_shared_loads(Shares *p) {
    for (int row = 0; row < K; row++) {
        if (!(scale_of(p, row) > 0.0)) {
            continue;
        }
        if (p->load[p->loads] == NULL) {
            p->load[p->loads] = take_shares(p, K);
        }
        double *own = p->load[p->loads];
        if (own == NULL) {
            return false;
        }
        project_row(p, row, own);
        for (int i = 0; i < 2 * p->loads; i++) {
            const double *other = p->load[i % p->loads], part = shares_product(own, other, K);
            for (int k = 0; k < K; k++) {
                own[k] -= part * other[k];
            }
        }
        const double length = sqrt(shares_product(own, own, K));
        if (length > 1e3 * OBEYED) {
            for (int k = 0; k < K; k++) {
                own[k] /= length;
            }
            p->loads++;
        }
    }
    return true;
}

/* factor times the scaled row as a function of x: its constant part, and its slope by the loads, and
   0 behind them. */
static double part_of(const Shares *p, int row, double factor, double slope[]) {
    for (int i = 0; i < p->loads; i++) {
        slope[i] = factor * p->load[i][row];
    }
    slope[p->loads] = 0.0;
    return factor * p->least[row];
}

/* The cone that may be added, with memory; NULL where there is none. */
static Cone *next_cone(Shares *p) {
    Cone *cone = &p->cone[p->cones];
    const int room = p->loads + 1;
    if (cone->room < room) {
        double *entries = take_shares(p, 3 * (size_t)room);
        if (entries == NULL) {
            return NULL;
        }
        cone->room = room;
        cone->slope = entries;
        cone->tangent[0] = entries + room;
        cone->tangent[1] = entries + 2 * room;
    }
    return cone;
}

/* Adds the cone, unless x does not change it. */
static void keep_shares(Shares *p) {
    Cone *cone = &p->cone[p->cones];
    double most = shares_product(cone->slope, cone->slope, p->loads);
    for (int i = 0; i < cone->width; i++) {
        most = fmax(most, shares_product(cone->tangent[i], cone->tangent[i], p->loads));
    }
    if (most > OBEYED * OBEYED) {
        cone->slope[p->loads] = p->size > p->loads ? -1.0 : 0.0;
        p->cones++;
    }
}

static bool share_contact(Shares *p, int contact) {
    Cone *cone = next_cone(p);
    if (cone == NULL) {
        return false;
    }
    const int normal = ROW_PLACES[contact], first = SLIP_ROWS[contact];
    const double holding = p->sharing->holding[contact];
    const bool sticks = contact_sticks(p->sharing->state, contact) && holding > 0.0;
    cone->width = sticks ? SLIP_ROWS[contact + 1] - first : 0;
    cone->offset = part_of(p, normal, sticks ? holding : 1.0, cone->slope);
    for (int i = 0; i < cone->width; i++) {
        const int row = ROW_PLACES[first + i];
        cone->force[i] = part_of(p, row, scale_of(p, row) / scale_of(p, normal), cone->tangent[i]);
    }
    return true;
}

static bool share_friction(Shares *p, int friction) {
    Cone *cone = next_cone(p);
    if (cone == NULL) {
        return false;
    }
    const int row = ROW_PLACES[FIRST_FRICTION + friction];
    cone->width = 1;
    cone->force[0] = part_of(p, row, 1.0, cone->tangent[0]);
    (void)part_of(p, row, 0.0, cone->slope);
    cone->offset = p->sharing->capacity[friction] / scale_of(p, row);
    return true;
}

static bool takes_part(const Shares *p, int contact) {
    return contact_closed(p->sharing->state, contact) && scale_of(p, ROW_PLACES[contact]) > 0.0;
}

static bool shared_contact_slides(const Shares *p, int contact) {
    return !contact_sticks(p->sharing->state, contact) && SLIP_ROWS[contact + 1] > SLIP_ROWS[contact] &&
           p->sharing->holding[contact] > 0.0;
}

/* Does the contact slide by friction that another sharing would change? */
static bool rubs(const Shares *p, int contact) {
    double square = 0.0;
    for (int i = 0; i < p->loads; i++) {
        square += p->load[i][ROW_PLACES[contact]] * p->load[i][ROW_PLACES[contact]];
    }
    return shared_contact_slides(p, contact) && sqrt(square) > OBEYED;
}

/* The loads of least norm for multipliers[m]. */
static void begin_sharing(const Sharing *sharing, const double multipliers[], Shares *p) {
    memset(p, 0, sizeof *p);
    p->sharing = sharing;
    memcpy(p->least, multipliers, sizeof p->least);
    constraints_spread(sharing->arena, sharing->constraints, p->least);
    for (int k = 0; k < K; k++) {
        p->least[k] = scale_of(p, k) > 0.0 ? p->least[k] / scale_of(p, k) : 0.0;
        p->greatest = fmax(p->greatest, fabs(p->least[k]));
    }
}

/* The problem, with the least margin in x or without. Returns false where nothing is shared, or there is no memory. */
static bool pose(bool centre, Shares *p) {
    if (!find_shared_loads(p)) {
        return false;
    }
    p->size = p->loads + (centre ? 1 : 0);
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (takes_part(p, i)) {
            if (rubs(p, i) || !share_contact(p, i)) {
                return false;
            }
            keep_shares(p);
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        if (friction_sticks(p->sharing->state, i)) {
            if (!share_friction(p, i)) {
                return false;
            }
            keep_shares(p);
        }
    }
    return p->cones > 0 && p->greatest > 0.0;
}

/* s, and t[2]. */
static double evaluate_cone(const Shares *p, const Cone *cone, double t[]) {
    for (int i = 0; i < cone->width; i++) {
        t[i] = cone->force[i] + shares_product(cone->tangent[i], p->x, p->size);
    }
    return cone->offset + shares_product(cone->slope, p->x, p->size);
}

/* s - |t|. */
static double margin(const Shares *p, const Cone *cone) {
    double t[2] = {0.0};
    const double s = evaluate_cone(p, cone, t);
    return s - vector_length(t, cone->width);
}

static double least_margin(const Shares *p) {
    double least = HUGE_VAL;
    for (int i = 0; i < p->cones; i++) {
        least = fmin(least, margin(p, &p->cone[i]));
    }
    return least;
}

/* Do all hold well with the loads of least norm? That is soon found, and then no other loads are looked for. */
static bool all_hold_well(Shares *p) {
    const double least = NO_MATTER * p->greatest;
    bool well = true;
    for (int i = 0; i < N_UNILATERALS && well; i++) {
        if (takes_part(p, i)) {
            well = share_contact(p, i) && !shared_contact_slides(p, i) && margin(p, p->cone) > least;
        }
    }
    for (int i = 0; i < N_FRICTIONS && well; i++) {
        if (friction_sticks(p->sharing->state, i)) {
            well = share_friction(p, i) && margin(p, p->cone) > least;
        }
    }
    return well;
}

/* Adds the derivatives of -log(s^2 - t^2), half of it without t: gradient[size] and matrix[size * size]; v[size] is
   memory. */
static void add_barrier(const Shares *p, const Cone *cone, double gradient[], double matrix[], double v[]) {
    double t[2] = {0.0};
    const double s = evaluate_cone(p, cone, t), r = cone->width == 0 ? s * s : s * s - t[0] * t[0] - t[1] * t[1];
    for (int i = 0; i < p->size; i++) {
        v[i] = s * cone->slope[i];
        for (int k = 0; k < cone->width; k++) {
            v[i] -= t[k] * cone->tangent[k][i];
        }
    }
    for (int i = 0; i < p->size; i++) {
        gradient[i] -= 2.0 * v[i] / r;
        for (int j = 0; j < p->size; j++) {
            double curvature = -cone->slope[i] * cone->slope[j];
            for (int k = 0; k < cone->width; k++) {
                curvature += cone->tangent[k][i] * cone->tangent[k][j];
            }
            matrix[i * p->size + j] += 4.0 * v[i] * v[j] / (r * r) + 2.0 * curvature / r;
        }
    }
}

/* Goes this part of the way to x - change[size], or less, so that x stays inside of all cones: where the matrix of a
   step is singular to rounding, its solution leads anywhere. Returns false where no way leads on. before[m + 1] is
   memory. */
static bool go_inside(Shares *p, const double change[], double part, double before[]) {
    memcpy(before, p->x, sizeof p->x);
    for (int i = 0; i < MOST_SHARING_STEPS; i++) {
        for (int k = 0; k < p->size; k++) {
            p->x[k] = before[k] - part * change[k];
        }
        if (least_margin(p) > 0.0) {
            return true;
        }
        part *= 0.5;
    }
    memcpy(p->x, before, sizeof p->x);
    return false;
}

/* The memory of a step. */
typedef struct {
    double *gradient, *change, *other; /* [m + 1], of which p->size entries are used */
    double *matrix;                    /* [p->size * p->size] */
    int *order;                        /* [p->size] */
} StepWork;

/* One step for the weight tau. Returns false where there is nothing left to improve. */
static bool step(Shares *p, double tau, const StepWork *work) {
    double *gradient = work->gradient, *matrix = work->matrix;
    const bool centre = p->size > p->loads;
    const double weight = centre ? YIELDS / (p->greatest * p->greatest) : 1.0 / (tau * p->greatest);
    memset(gradient, 0, (size_t)p->size * sizeof(double));
    memset(matrix, 0, (size_t)(p->size * p->size) * sizeof(double));
    for (int i = 0; i < p->loads; i++) {
        gradient[i] = weight * p->x[i];
        matrix[i * p->size + i] = weight;
    }
    if (centre) {
        gradient[p->loads] = -1.0 / tau;
    }
    for (int i = 0; i < p->cones; i++) {
        add_barrier(p, &p->cone[i], gradient, matrix, work->other);
    }
    if (!lu_factorize(matrix, work->order, p->size)) {
        return false;
    }
    lu_solve(matrix, work->order, p->size, gradient, work->change);
    const double square = shares_product(gradient, work->change, p->size);
    if (!(square > MET)) {
        return false;
    }
    return go_inside(p, work->change, square > 0.0625 ? 1.0 / (1.0 + sqrt(square)) : 1.0, work->other);
}

/* From inside of all cones. Margins without a bound are followed only so far. */
static void follow_path(Shares *p, const StepWork *work) {
    const bool centre = p->size > p->loads;
    for (double tau = 1.0; tau >= (centre ? TOLERATED : MET); tau *= FALL) {
        for (int i = 0; i < MOST_SHARING_STEPS && step(p, tau * p->greatest, work); i++) {
            if (centre && p->x[p->loads] > UNBOUNDED * p->greatest) {
                return;
            }
        }
    }
}

static void solve_shares(Shares *p) {
    Arena *arena = p->sharing->arena;
    const ArenaMark mark = arena_mark(arena);
    const size_t size = (size_t)p->size, vector = (K + 1) * sizeof(double);
    if (arena_reserve(arena, (4 * (K + 2) + size * (size + 1) + 4) * sizeof(double))) {
        const StepWork work = {.gradient = arena_take(arena, vector),
                               .change = arena_take(arena, vector),
                               .other = arena_take(arena, vector),
                               .matrix = arena_take(arena, size * size * sizeof(double)),
                               .order = arena_take(arena, size * sizeof(int))};
        follow_path(p, &work);
    }
    arena_release(mark);
}

static void combine(const Shares *p, double multipliers[]) {
    for (int k = 0; k < K; k++) {
        double sum = p->least[k];
        for (int i = 0; i < p->loads; i++) {
            sum += p->x[i] * p->load[i][k];
        }
        multipliers[k] = scale_of(p, k) > 0.0 ? scale_of(p, k) * sum : multipliers[k];
    }
}

static void centre_within(Shares *p) {
    p->x[p->loads] = least_margin(p) - p->greatest;
    solve_shares(p);
}

void loads_centre(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    begin_sharing(sharing, multipliers, p);
    if (pose(true, p)) {
        centre_within(p);
        combine(p, multipliers);
    }
    arena_release(mark);
}

bool loads_least(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    begin_sharing(sharing, multipliers, p);
    combine(p, multipliers);
    return arena_leave(mark, all_hold_well(p));
}

/* Moves the loads p, which do not obey the laws, inside, where `inside` begins as p did; false if that goes nowhere. */
static bool move_inside(Shares *p, Shares *inside) {
    if (!pose(true, inside)) {
        return false;
    }
    centre_within(inside);
    memcpy(p->x, inside->x, (size_t)p->loads * sizeof(double));
    const double least = least_margin(p);
    if (least <= -YIELDS * p->greatest) {
        return false;
    }
    if (least > 0.0) {
        solve_shares(p);
    }
    return true;
}

void loads_obey(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK_OF(mark, Shares, inside);
    begin_sharing(sharing, multipliers, p);
    *inside = *p;
    if (!all_hold_well(p) && pose(false, p) && least_margin(p) < 0.0 && move_inside(p, inside)) {
        combine(p, multipliers);
        for (int i = 0; i < N_UNILATERALS; i++) {
            multipliers[ROW_PLACES[i]] = fmax(multipliers[ROW_PLACES[i]], 0.0);
        }
    }
    arena_release(mark);
}
