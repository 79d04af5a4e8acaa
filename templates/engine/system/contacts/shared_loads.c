/* The multipliers are those of least norm and a sum of loads that no motion feels. What the sum has to be is a convex
   program over the cones of the margins. */
#include "shared_loads.h"

#include <math.h>
#include <string.h>

#include "central_path.h"
#include "constraint_factorization.h"
#include "scale.h"
#include "vector_length.h"

enum { MOST_MARGINS = SIZE_UNILATERALS + SIZE_FRICTIONS };

/* Margins of this part of the greatest load are no matter of sharing. */
static const double NO_MATTER = 0.01;

typedef struct {
    const Sharing *sharing;
    int loads;
    double *load[K + 1]; /* each [m]; orthonormal, in units of the scaled rows; behind them memory for another one */
    double least[K];     /* the scaled multipliers of least norm */
    double greatest;     /* of them */
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
    const bool fits = arena_reserve(arena, arena_bytes(count, sizeof(double)));
    return fits ? (double *)arena_take(arena, count * sizeof(double)) : NULL;
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

/* The margin offset + factor[0] l[row[0]] - |(factor[1] l[row[1]], ...)| of scaled multipliers l; factors are 0 where
   there is no row. */
typedef struct {
    double factor[3];
    int row[3];
    double offset;
} Margin;

static Margin contact_margin(const Shares *p, int contact) {
    const int normal = ROW_PLACES[contact], first = SLIP_ROWS[contact];
    const double holding = p->sharing->holding[contact];
    const bool sticks = contact_sticks(p->sharing->state, contact) && holding > 0.0;
    Margin margin = {.factor = {sticks ? holding : 1.0, 0.0, 0.0}, .row = {normal, normal, normal}, .offset = 0.0};
    for (int i = 0; sticks && first + i < SLIP_ROWS[contact + 1]; i++) {
        margin.row[1 + i] = ROW_PLACES[first + i];
        margin.factor[1 + i] = scale_of(p, margin.row[1 + i]) / scale_of(p, normal);
    }
    return margin;
}

static Margin friction_margin(const Shares *p, int friction) {
    const int row = ROW_PLACES[FIRST_FRICTION + friction];
    const double capacity = p->sharing->capacity[friction] / scale_of(p, row);
    return (Margin){.factor = {0.0, 1.0, 0.0}, .row = {row, row, row}, .offset = capacity};
}

/* Of the scaled multipliers[m]. */
static double margin_of(const Margin *margin, const double multipliers[]) {
    double s[3];
    for (int i = 0; i < 3; i++) {
        s[i] = margin->factor[i] * multipliers[margin->row[i]];
    }
    return margin->offset + s[0] - vector_length(s + 1, 2);
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

/* All margins; returns how many. */
static int find_margins(const Shares *p, Margin margin[]) {
    const State *state = p->sharing->state;
    int count = 0;
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (takes_part(p, i)) {
            margin[count++] = contact_margin(p, i);
        }
    }
    for (int i = 0; i < N_FRICTIONS; i++) {
        if (friction_sticks(state, i)) {
            margin[count++] = friction_margin(p, i);
        }
    }
    return count;
}

/* Adds the cone of a margin, unless loads do not change it. */
static void put_margin(const Shares *p, const Margin *margin, ConeProgram *program) {
    double *map = program->map.value + 3 * program->cones * program->size, most = 0.0;
    for (int i = 0; i < 3; i++) {
        double *row = map + i * program->size;
        for (int j = 0; j < p->loads; j++) {
            row[j] = margin->factor[i] * p->load[j][margin->row[i]];
        }
        most = fmax(most, shares_product(row, row, p->loads));
        program->shift[3 * program->cones + i] =
            (i == 0 ? margin->offset : 0.0) + margin->factor[i] * p->least[margin->row[i]];
    }
    if (most > OBEYED * OBEYED) {
        program->cones++;
    } else {
        memset(map, 0, 3 * (size_t)program->size * sizeof(double));
        memset(program->shift + 3 * program->cones, 0, 3 * sizeof(double));
    }
}

/* A program with all entries, of which there are none yet. False: there is no memory. */
static bool take_full_program(Arena *arena, int size, int cones, ConeProgram *program) {
    const size_t n = (size_t)size, rows = 3 * (size_t)cones;
    if (!arena_reserve(arena, sparse_bytes(n, n * n) + sparse_bytes(rows, rows * n) +
                                  arena_bytes(n + rows, sizeof(double)))) {
        return false;
    }
    double *vectors = (double *)arena_take(arena, (n + rows) * sizeof(double));
    memset(vectors, 0, (n + rows) * sizeof(double));
    *program = (ConeProgram){.arena = arena,
                             .size = size,
                             .matrix = sparse_full(arena, size, size),
                             .offset = vectors,
                             .map = sparse_full(arena, 3 * cones, size),
                             .shift = vectors + size};
    return true;
}

/* Is there anything to share? No, where a contact slides whose friction would change. */
static bool may_share(Shares *p) {
    bool may = find_shared_loads(p) && p->greatest > 0.0;
    for (int i = 0; i < N_UNILATERALS && may; i++) {
        may = !takes_part(p, i) || !rubs(p, i);
    }
    return may;
}

/* Adds the weights x[loads] of the loads to the multipliers of least norm. */
static void combine(const Shares *p, const double x[], double scaled[]) {
    for (int k = 0; k < K; k++) {
        scaled[k] = p->least[k];
        for (int i = 0; i < p->loads; i++) {
            scaled[k] += x[i] * p->load[i][k];
        }
    }
}

static double least_margin(const Margin margin[], int count, const double scaled[]) {
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++) {
        least = fmin(least, margin_of(&margin[i], scaled));
    }
    return least;
}

/* The scaled multipliers[m] of least norm within all margins, or those whose least margin is greatest: that is then one
   more unknown t, which all margins exceed, up to the greatest load; the norm has a weight that only decides on loads
   without a margin. False: no margin depends on the loads, or there is no memory. */
static bool spread_loads(const Shares *p, const Margin margin[], int count, bool centre, double scaled[]) {
    const ArenaMark mark = arena_mark(p->sharing->arena);
    const int size = p->loads + (centre ? 1 : 0);
    ConeProgram program;
    if (!take_full_program(p->sharing->arena, size, count + 1, &program)) {
        return arena_leave(mark, false);
    }
    double *x = take_shares(p, (size_t)size);
    if (x == NULL) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < count; i++) {
        put_margin(p, &margin[i], &program);
    }
    if (program.cones == 0) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < p->loads; i++) {
        program.matrix.value[i * size + i] = centre ? YIELDS : 1.0;
    }
    if (centre) {
        program.offset[p->loads] = -p->greatest;
        for (int c = 0; c < program.cones; c++) {
            program.map.value[3 * c * size + p->loads] = -1.0;
        }
        program.map.value[3 * program.cones * size + p->loads] = -1.0;
        program.shift[3 * program.cones++] = p->greatest;
    }
    program.map.rows = 3 * program.cones;
    const bool found = central_path(&program, (PathOptions){0.0, 0.0, 0.0}, x);
    combine(p, x, scaled);
    return arena_leave(mark, found);
}

/* multipliers[m] for scaled ones; those without a row are kept. */
static void unscale(const Shares *p, const double scaled[], double multipliers[]) {
    for (int k = 0; k < K; k++) {
        multipliers[k] = scale_of(p, k) > 0.0 ? scale_of(p, k) * scaled[k] : multipliers[k];
    }
}

double loads_centre(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    WORK(mark, double, scaled, K);
    begin_sharing(sharing, multipliers, p);
    double told = HUGE_VAL;
    const int count = find_margins(p, margin);
    if (may_share(p) && spread_loads(p, margin, count, true, scaled)) {
        unscale(p, scaled, multipliers);
        told = fmax(least_margin(margin, count, scaled), 0.0) + NO_MATTER * p->greatest;
    }
    arena_release(mark);
    return told;
}

/* Do all hold well with the loads of least norm? That is soon found, and then no other loads are looked for. */
static bool all_hold_well(const Shares *p, const Margin margin[], int count) {
    bool slides = false;
    for (int i = 0; i < N_UNILATERALS; i++) {
        slides = slides || (takes_part(p, i) && shared_contact_slides(p, i));
    }
    return !slides && least_margin(margin, count, p->least) > NO_MATTER * p->greatest;
}

bool loads_least(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    begin_sharing(sharing, multipliers, p);
    unscale(p, p->least, multipliers);
    return arena_leave(mark, all_hold_well(p, margin, find_margins(p, margin)));
}

void loads_obey(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    WORK(mark, double, scaled, K);
    begin_sharing(sharing, multipliers, p);
    const int count = find_margins(p, margin);
    const double least = least_margin(margin, count, p->least), met = -YIELDS * p->greatest;
    bool obey = least < 0.0 && may_share(p) && spread_loads(p, margin, count, false, scaled);
    if (obey && least_margin(margin, count, scaled) < met) {
        obey = spread_loads(p, margin, count, true, scaled) && least_margin(margin, count, scaled) > met;
    }
    if (obey) {
        unscale(p, scaled, multipliers);
        for (int i = 0; i < N_UNILATERALS; i++) {
            multipliers[ROW_PLACES[i]] = fmax(multipliers[ROW_PLACES[i]], 0.0);
        }
    }
    arena_release(mark);
}
