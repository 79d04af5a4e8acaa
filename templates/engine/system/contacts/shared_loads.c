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

/* A part: of the greatest load, beyond which a margin is wide enough and sharing raises it no further; and of the
   greatest force with which a margin bars the level from rising, below which a margin does not bar it. */
static const double NO_MATTER = 0.01;

typedef struct {
    const Sharing *sharing;
    int loads;
    double *load[K + 1]; /* each [m]; orthonormal, in units of the scaled rows; behind them memory for another one */
    double scaled[K];    /* the scaled multipliers, those of least norm at first */
    double greatest;     /* of those of least norm */
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

/* Memory of `count` doubles; NULL: there is none. */
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

/* The margin offset + factor[0] l[row[0]] + bears l - |(factor[1] l[row[1]], ...)| of scaled multipliers l; factors are
   0 where there is no row. */
typedef struct {
    double factor[3];
    int row[3];
    double offset;
    const double *bears; /* NULL, or of each multiplier, in units of row[0] */
    bool held; /* it has come to the level that no loads exceed; what is left of it may not become negative */
} Margin;

static Margin contact_margin(const Shares *p, int contact) {
    const int normal = ROW_PLACES[contact], first = SLIP_ROWS[contact];
    const double holding = p->sharing->holding[contact];
    const bool sticks = contact_sticks(p->sharing->state, contact) && holding > 0.0;
    Margin margin = {.factor = {sticks ? holding : 1.0, 0.0, 0.0}, .row = {normal, normal, normal}, .held = false};
    for (int i = 0; sticks && first + i < SLIP_ROWS[contact + 1]; i++) {
        margin.row[1 + i] = ROW_PLACES[first + i];
        margin.factor[1 + i] = scale_of(p, margin.row[1 + i]) / scale_of(p, normal);
    }
    return margin;
}

static Margin friction_margin(const Shares *p, int friction) {
    const int row = ROW_PLACES[FIRST_FRICTION + friction];
    const double capacity = p->sharing->capacity[friction] / scale_of(p, row), *bears = p->sharing->bears;
    return (Margin){.factor = {0.0, 1.0, 0.0},
                    .row = {row, row, row},
                    .offset = capacity,
                    .bears = bears != NULL ? bears + friction * K : NULL};
}

/* The part i of a margin that is linear in the scaled multipliers l[K]. */
static double part_of(const Shares *p, const Margin *margin, int i, const double l[]) {
    double sum = margin->factor[i] * l[margin->row[i]];
    for (int k = 0; i == 0 && margin->bears != NULL && k < K; k++) {
        sum += margin->bears[k] * scale_of(p, k) / scale_of(p, margin->row[0]) * l[k];
    }
    return sum;
}

static double margin_of(const Shares *p, const Margin *margin) {
    double s[3];
    for (int i = 0; i < 3; i++) {
        s[i] = part_of(p, margin, i, p->scaled);
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

/* The loads of least norm for multipliers[m]. */
static void begin_sharing(const Sharing *sharing, const double multipliers[], Shares *p) {
    memset(p, 0, sizeof *p);
    p->sharing = sharing;
    memcpy(p->scaled, multipliers, sizeof p->scaled);
    constraints_spread(sharing->arena, sharing->constraints, p->scaled);
    for (int k = 0; k < K; k++) {
        p->scaled[k] = scale_of(p, k) > 0.0 ? p->scaled[k] / scale_of(p, k) : 0.0;
        p->greatest = fmax(p->greatest, fabs(p->scaled[k]));
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

/* What a unit of the load j changes of the part i of a margin. */
static double part_change(const Shares *p, const Margin *margin, int i, int j) {
    return part_of(p, margin, i, p->load[j]);
}

/* Keeps the margins that loads change, in their order; returns how many. */
static int find_shared_margins(const Shares *p, Margin margin[], int count) {
    int shared = 0;
    for (int c = 0; c < count; c++) {
        double most = 0.0;
        for (int k = 0; k < 3 * p->loads; k++) {
            most = fmax(most, fabs(part_change(p, &margin[c], k % 3, k / 3)));
        }
        margin[shared] = margin[c];
        shared += most > OBEYED ? 1 : 0;
    }
    return shared;
}

/* Adds the cone of a margin. */
static void put_margin(const Shares *p, const Margin *margin, ConeProgram *program) {
    for (int i = 0; i < 3; i++) {
        const int row = 3 * program->cones + i;
        for (int j = 0; j < p->loads; j++) {
            program->map.value[row * program->size + j] = part_change(p, margin, i, j);
        }
        program->shift[row] = (i == 0 ? margin->offset : 0.0) + part_of(p, margin, i, p->scaled);
    }
    program->cones++;
}

/* The program whose unknowns are the loads' weights and `further` more, with the cones of all margins and room for one
   more. False: there is no memory. */
static bool take_shares_program(const Shares *p, const Margin margin[], int count, int further, ConeProgram *program) {
    Arena *arena = p->sharing->arena;
    const size_t n = (size_t)(p->loads + further), rows = 3 * (size_t)count + 3;
    if (!arena_reserve(arena, sparse_bytes(n, n * n) + sparse_bytes(rows, rows * n) +
                                  arena_bytes(2 * n + 2 * rows, sizeof(double)))) {
        return false;
    }
    double *vectors = (double *)arena_take(arena, 2 * (n + rows) * sizeof(double));
    memset(vectors, 0, 2 * (n + rows) * sizeof(double));
    *program = (ConeProgram){.arena = arena,
                             .size = (int)n,
                             .matrix = sparse_full(arena, (int)n, (int)n),
                             .offset = vectors,
                             .map = sparse_full(arena, (int)rows, (int)n),
                             .shift = vectors + n,
                             .forces = vectors + n + rows};
    for (int c = 0; c < count; c++) {
        put_margin(p, &margin[c], program);
    }
    program->map.rows = 3 * count;
    return true;
}

static double least_margin(const Shares *p, const Margin margin[], int count) {
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++) {
        least = fmin(least, margin_of(p, &margin[i]));
    }
    return least;
}

/* Adds all loads, with the weights x[loads], to the multipliers. */
static void add_loads(Shares *p, const double x[]) {
    for (int j = 0; j < p->loads; j++) {
        for (int k = 0; k < K; k++) {
            p->scaled[k] += x[j] * p->load[j][k];
        }
    }
}

/* Keeps the sum of part[i] times the parts of a margin: a reflection of the loads leaves one alone, the last, that
   changes this sum, and that load is given up. */
static void hold_part(Shares *p, const Margin *margin, const double part[]) {
    const ArenaMark mark = arena_mark(p->sharing->arena);
    WORK(mark, double, normal, K + 1);
    for (int j = 0; j < p->loads; j++) {
        normal[j] = 0.0;
        for (int i = 0; i < 3; i++) {
            normal[j] += part[i] * part_change(p, margin, i, j);
        }
    }
    const double length = vector_length(normal, p->loads);
    if (length > OBEYED) {
        p->loads--;
        normal[p->loads] += normal[p->loads] < 0.0 ? -length : length;
        const double square = shares_product(normal, normal, p->loads + 1);
        for (int k = 0; k < K; k++) {
            double sum = 0.0;
            for (int j = 0; j <= p->loads; j++) {
                sum += normal[j] * p->load[j][k];
            }
            for (int j = 0; j < p->loads; j++) {
                p->load[j][k] -= 2.0 * sum / square * normal[j];
            }
        }
    }
    arena_release(mark);
}

/* Do loads change what the row bears together with the other one? */
static bool share_with(const Shares *p, int row, int other) {
    double product = 0.0;
    for (int j = 0; j < p->loads; j++) {
        product += p->load[j][row] * p->load[j][other];
    }
    return fabs(product) > OBEYED;
}

/* Does the contact share its normal force with one that slides by friction? Another share would change what slides. */
static bool presses_alike(const Shares *p, int contact) {
    bool found = false;
    for (int i = 0; i < N_UNILATERALS && !found; i++) {
        found = takes_part(p, i) && shared_contact_slides(p, i) && share_with(p, ROW_PLACES[i], ROW_PLACES[contact]);
    }
    return found;
}

/* Finds the loads; returns whether there are any. Those that change normal forces by which a contact slides are given
   up: these forces are of least norm. */
static bool may_share(Shares *p) {
    const double normal[3] = {1.0, 0.0, 0.0};
    const bool found = find_shared_loads(p) && p->greatest > 0.0;
    const ArenaMark mark = arena_mark(p->sharing->arena); /* behind the loads */
    WORK_ZEROS(mark, bool, kept, SIZE_UNILATERALS);
    for (int i = 0; i < N_UNILATERALS && found; i++) {
        kept[i] = takes_part(p, i) && presses_alike(p, i);
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (kept[i]) {
            const int row = ROW_PLACES[i];
            const Margin own = {.factor = {1.0, 0.0, 0.0}, .row = {row, row, row}, .held = false};
            hold_part(p, &own, normal);
        }
    }
    arena_release(mark);
    return found && p->loads > 0;
}

/* Holds the margins that bar the level from rising, by their forces[3 * count] at the end of the program. From then on
   loads change only along the edge of the cone of such a margin, and not at all where it is at the tip. */
static void hold_margins(Shares *p, Margin margin[], int count, double level, const double forces[]) {
    double greatest = 0.0;
    for (int c = 0; c < count; c++) {
        greatest = fmax(greatest, margin[c].held ? 0.0 : forces[3 * c]);
    }
    for (int c = 0; c < count; c++) {
        const double *z = forces + 3 * c;
        if (margin[c].held || z[0] <= NO_MATTER * greatest) {
            continue;
        }
        const bool tip = vector_length(z + 1, 2) < (1.0 - NO_MATTER) * z[0];
        const double force[3] = {1.0, z[1] / z[0], z[2] / z[0]}, last[3] = {0.0, 0.0, tip ? 1.0 : 0.0};
        const double across[3] = {0.0, tip ? 1.0 : -force[2], tip ? 0.0 : force[1]};
        hold_part(p, &margin[c], force);
        hold_part(p, &margin[c], across);
        hold_part(p, &margin[c], last);
        margin[c].factor[1] = margin[c].factor[2] = 0.0;
        margin[c].offset -= level;
        margin[c].held = true;
    }
}

/* Adds the loads of least norm with which no margin is negative, or, if a level is asked for, those whose least margin,
   but for those held, is greatest. The level is one more unknown then, which all margins exceed, up to the most that
   matters; the norm has a weight that only decides on loads without a margin, and what bars the level is held. False:
   no margin depends on the loads, or there is no memory. */
static bool spread_loads(Shares *p, Margin margin[], int count, double most, double *level) {
    const ArenaMark mark = arena_mark(p->sharing->arena);
    const int last = p->loads;
    ConeProgram program;
    if (count == 0 || !take_shares_program(p, margin, count, level != NULL ? 1 : 0, &program)) {
        return arena_leave(mark, false);
    }
    double *x = program.forces + 3 * count + 3;
    for (int i = 0; i < last; i++) {
        program.matrix.value[i * program.size + i] = level != NULL ? YIELDS : 1.0;
    }
    if (level != NULL) {
        program.offset[last] = -p->greatest;
        for (int c = 0; c <= count; c++) {
            program.map.value[3 * c * program.size + last] = c < count && margin[c].held ? 0.0 : -1.0;
        }
        program.shift[3 * program.cones++] = most;
        program.map.rows = 3 * program.cones;
    }
    const bool found = central_path(&program, (PathOptions){0.0, 0.0, 0.0}, x);
    add_loads(p, x);
    if (level != NULL) {
        *level = x[last];
        hold_margins(p, margin, count, *level, program.forces);
    }
    return arena_leave(mark, found);
}

/* Raises the level of all margins, then that of those which did not bar it, and so on. Returns the level beyond which
   margins do not matter, HUGE_VAL where none depends on the loads. */
static double centre_loads(Shares *p, Margin margin[], int count) {
    double told = HUGE_VAL, level = 0.0;
    for (int loads = K + 1; p->loads < loads && level < (1.0 - YIELDS) * told;) {
        loads = p->loads;
        count = find_shared_margins(p, margin, count);
        if (!spread_loads(p, margin, count, fmin(told, p->greatest), &level)) {
            break;
        }
        told = fmin(told, fmin(p->greatest, fmax(level, 0.0) + NO_MATTER * p->greatest));
    }
    return told;
}

/* Sets multipliers[m]; those without a row are kept. */
static void unscale(const Shares *p, double multipliers[]) {
    for (int k = 0; k < K; k++) {
        multipliers[k] = scale_of(p, k) > 0.0 ? scale_of(p, k) * p->scaled[k] : multipliers[k];
    }
}

double loads_centre(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    begin_sharing(sharing, multipliers, p);
    double told = HUGE_VAL;
    if (may_share(p)) {
        told = centre_loads(p, margin, find_margins(p, margin));
        unscale(p, multipliers);
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
    return !slides && least_margin(p, margin, count) > NO_MATTER * p->greatest;
}

bool loads_least(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    begin_sharing(sharing, multipliers, p);
    unscale(p, multipliers);
    return arena_leave(mark, all_hold_well(p, margin, find_margins(p, margin)));
}

/* Makes the loads those of least norm whose margins are not negative; returns whether there are any. */
static bool obey_by_least_norm(Shares *p, Margin margin[], int count) {
    count = find_shared_margins(p, margin, count);
    return spread_loads(p, margin, count, 0.0, NULL) && least_margin(p, margin, count) >= -OBEYED * p->greatest;
}

/* At the end of a mode the margins of all ways to share come down to 0 together. The last way is the one with the
   greatest least margin. */
void loads_obey(const Sharing *sharing, double multipliers[]) {
    const ArenaMark mark = arena_mark(sharing->arena);
    WORK_OF(mark, Shares, p);
    WORK(mark, Margin, margin, MOST_MARGINS);
    begin_sharing(sharing, multipliers, p);
    const bool shared = least_margin(p, margin, find_margins(p, margin)) < 0.0 && may_share(p);
    bool obey = shared && obey_by_least_norm(p, margin, find_margins(p, margin));
    if (shared && !obey) {
        begin_sharing(sharing, multipliers, p);
        may_share(p);
        centre_loads(p, margin, find_margins(p, margin));
        obey = least_margin(p, margin, find_margins(p, margin)) >= -YIELDS * p->greatest;
    }
    if (obey) {
        const double rounding = OBEYED * p->greatest;
        unscale(p, multipliers);
        for (int i = 0; i < N_UNILATERALS; i++) {
            double *force = &multipliers[ROW_PLACES[i]];
            *force = *force < 0.0 && *force >= -rounding * scale_of(p, ROW_PLACES[i]) ? 0.0 : *force;
        }
    }
    arena_release(mark);
}
