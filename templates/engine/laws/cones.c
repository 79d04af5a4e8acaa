/* The order in which solutions are looked for decides on which of several is found. The convex program comes first. Its
   solution rests if there is any way to rest, and shows else where Newton's method for Coulomb's law has to begin.
   Where that leads to no solution, Coulomb's law has a path of its own. Rows that slide make the operator asymmetric;
   then all choices of equations are tried, because friction that presses a contact to its support leaves several
   solutions or none (Painleve's paradox). */
#include "cones.h"

#include <math.h>

#include "central_path.h"
#include "choices.h"
#include "newton.h"
#include "scale.h"

/* The most choices of equations that are tried one by one. */
static const double MOST_CHOICES = 4096.0;

/* Central paths that are tried in turn. The weight grows by the factor SOFTER, and contacts give way more; with each
   weight CENTRINGS lead the path more and more through the middle of the cones. */
static const double SOFTER = 10.0, CENTRINGS[] = {0.0, 0.3, 0.8};

static bool may_rub(const Laws *laws, int k) {
    return laws->width[k] > 0 && (laws->base[k] > 0.0 || laws->slope[k] > 0.0);
}

/* Does a friction cone bound the normal force of this row? */
static bool is_framed(const Laws *laws, int k) {
    bool framed = false;
    for (int i = 0; i < laws->size; i++) {
        framed = framed || (may_rub(laws, i) && laws->normal[i] == k && laws->base[i] == 0.0);
    }
    return framed;
}

/* Row k begins a cone: that of a lone unilateral row, or of friction with a limit. */
static bool begins_cone(const Laws *laws, int k) {
    return laws->width[k] == 0 ? !is_framed(laws, k) : may_rub(laws, k) && laws->base[k] < HUGE_VAL;
}

/* Begins the next row of the map. */
static void begin_row(Sparse *map) {
    map->rows++;
    map->start[map->rows] = map->start[map->rows - 1];
}

/* The next entry of the last row of the map. */
static void put_entry(Sparse *map, int column, double value) {
    map->column[map->start[map->rows]] = column;
    map->value[map->start[map->rows]++] = value;
}

static void put_cones_of(const Laws *laws, ConeProgram *program) {
    Sparse *map = &program->map;
    map->rows = 0;
    map->start[0] = 0;
    for (int k = 0; k < laws->size; k++) {
        if (!begins_cone(laws, k)) {
            continue;
        }
        const int width = laws->width[k], normal = width == 0 ? k : laws->normal[k];
        program->shift[map->rows] = width == 0 ? 0.0 : laws->base[k];
        begin_row(map);
        if (normal >= 0) {
            put_entry(map, normal, width == 0 ? 1.0 : laws->slope[k]);
        }
        for (int i = 0; i < 2; i++) {
            program->shift[map->rows] = 0.0;
            begin_row(map);
            if (i < width) {
                put_entry(map, k + i, 1.0);
            }
        }
    }
    program->cones = map->rows / 3;
}

/* Rows of friction without any limit have no force: nothing acts on or by them. */
static bool acts(const Laws *laws, int k) {
    return laws->width[k] == 0 || may_rub(laws, laws->width[k] < 0 ? k - 1 : k);
}

static void put_operator(const Laws *laws, ConeProgram *program) {
    Sparse *matrix = &program->matrix;
    for (int i = 0; i < laws->size; i++) {
        matrix->start[i + 1] = laws->matrix.start[i + 1];
        for (int e = matrix->start[i]; e < matrix->start[i + 1]; e++) {
            const int j = laws->matrix.column[e];
            matrix->column[e] = j;
            matrix->value[e] = acts(laws, i) && acts(laws, j) ? laws->matrix.value[e] : i == j ? 1.0 : 0.0;
        }
        program->offset[i] = acts(laws, i) ? laws->offset[i] : 0.0;
    }
}

/* The program of the laws, of the arena. False: there is no memory. */
static bool take_program(const Laws *laws, ConeProgram *program) {
    const int n = laws->size, entries = laws->matrix.start[n];
    const size_t rows = 3 * (size_t)n;
    if (!arena_reserve(laws->arena, sparse_bytes((size_t)n, (size_t)entries) + sparse_bytes(rows, rows) +
                                        arena_bytes((size_t)n, sizeof(double)) + arena_bytes(rows, sizeof(double)))) {
        return false;
    }
    *program = (ConeProgram){.arena = laws->arena,
                             .size = n,
                             .matrix = sparse_take(laws->arena, n, entries),
                             .offset = (double *)arena_take(laws->arena, (size_t)n * sizeof(double)),
                             .map = sparse_take(laws->arena, 3 * n, 3 * n),
                             .shift = (double *)arena_take(laws->arena, rows * sizeof(double)),
                             .first = laws->first};
    put_operator(laws, program);
    put_cones_of(laws, program);
    return true;
}

/* Newton's method from the end of a central path. */
static bool solve_along(const Laws *laws, const ConeProgram *program, PathOptions options, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!arena_reserve(laws->arena, arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *start = (double *)arena_take(laws->arena, bytes);
    return arena_leave(mark, central_path(program, options, start) && newton_solve(laws, start, x));
}

/* Rows that slide make the operator asymmetric: friction may press a contact to its support. */
static bool is_asymmetric(const Laws *laws) {
    bool found = false;
    for (int i = 0; i < laws->size; i++) {
        for (int j = 0; j < i; j++) {
            const double a = laws->matrix.value[i * laws->size + j], b = laws->matrix.value[j * laws->size + i];
            found = found || fabs(a - b) > OBEYED * fmax(fabs(a), fabs(b));
        }
    }
    return found;
}

bool cones_rest(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    ConeProgram program;
    return arena_leave(mark, take_program(laws, &program) &&
                                 solve_along(laws, &program, (PathOptions){0.0, DAMPING, 0.0}, x));
}

bool cones_slide(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    ConeProgram program;
    bool solved = false;
    if (!take_program(laws, &program)) {
        return arena_leave(mark, false);
    }
    for (double weight = YIELDS; weight < 2.0 && !solved; weight *= SOFTER) {
        for (int i = 0; i < 3 && !solved; i++) {
            solved = solve_along(laws, &program, (PathOptions){1.0, weight, CENTRINGS[i]}, x);
        }
    }
    return arena_leave(mark, solved);
}

/* Where rows slide, their friction depends on how redundant rows share a load, and so does the motion. They share it
   here as rows do that give way alike, because the forces of the motion are found so, too: DAMPING lets them give way.
   Newton's method then finishes the solution without it. */
static bool solve_evenly(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!arena_reserve(laws->arena, 2 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *start = (double *)arena_take(laws->arena, bytes), *kept = (double *)arena_take(laws->arena, bytes);
    for (int k = 0; k < laws->size; k++) {
        double *own = &laws->matrix.value[k * laws->size + k];
        kept[k] = *own;
        *own += DAMPING;
    }
    const bool found = cones_rest(laws, start) || cones_slide(laws, start);
    for (int k = 0; k < laws->size; k++) {
        laws->matrix.value[k * laws->size + k] = kept[k];
    }
    return arena_leave(mark, found && newton_solve(laws, start, x));
}

bool cones_solve(const Laws *laws, double x[]) {
    const bool few = choices_count(laws) <= MOST_CHOICES;
    const bool slides = is_asymmetric(laws);
    if (slides && few) {
        return choices_solve(laws, NULL, x);
    }
    if (slides && solve_evenly(laws, x)) {
        return true;
    }
    return cones_rest(laws, x) || cones_slide(laws, x) || (few && choices_solve(laws, NULL, x));
}
