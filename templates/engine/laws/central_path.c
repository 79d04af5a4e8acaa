/* A primal-dual interior-point method: the scaling of Nesterov and Todd, Mehrotra's predictor and corrector. Its
   products are those of the Jordan algebra of second-order cones: Alizadeh, Goldfarb, Second-order cone programming,
   Math. Program. 2003; Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010, sections 4 and 5. */
#include "central_path.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "step_matrix.h"
#include "scale.h"
#include "vector_length.h"

/* Bounds: of all steps, and of steps in turn that do not halve the residual. */
enum { MOST_PATH_STEPS = 80, MOST_STALLS = 12 };

/* The part of the way to the boundary of the first cone that a step would leave, at which the step ends. At 1 the
   scaling of Nesterov and Todd is singular; a smaller part leaves more of the gap after each step. */
static const double INSIDE = 0.995;

/* The greatest |y|, in units of the offset: where it grows beyond, the program has no solution. */
static const double MOST_PATH_GROWTH = 1e13;

/* W = factor (2 v v' - J) with J = diag(1, -1, -1): W z = W^-1 s. */
typedef struct {
    double factor;
    double v[3];
} ConeScaling;

typedef struct {
    const ConeProgram *program;
    PathOptions options;
    double scale;               /* the greatest entry of the offset and of the shift, in whose units all is */
    double *y, *dy, *right;     /* [size] */
    double *dual;               /* [size]: the residual of the equation for y */
    StepMatrix matrix;           /* of a step */
    double *s, *z, *ds, *dz;    /* [3 * cones] */
    double *primal;             /* [3 * cones]: map y + shift - s */
    double *middle;             /* [3 * cones]: W z = W^-1 s */
    double *target;             /* [3 * cones]: of W^-1 ds + W dz */
    ConeScaling *scaling;           /* [cones] */
} Path;

/* v_0^2 - v_1^2 - v_2^2 */
static double cone_determinant(const double v[]) {
    const double r = vector_length(v + 1, 2);
    return (v[0] - r) * (v[0] + r);
}

static double cone_dot(const double a[], const double b[]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* a o b */
static void cone_product(const double a[], const double b[], double product[]) {
    const double first = cone_dot(a, b);
    for (int i = 1; i < 3; i++) {
        product[i] = a[0] * b[i] + b[0] * a[i];
    }
    product[0] = first;
}

/* x with a o x = b, which it overwrites. */
static void cone_quotient(const double a[], double b[]) {
    const double first = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) / cone_determinant(a);
    for (int i = 1; i < 3; i++) {
        b[i] = (b[i] - first * a[i]) / a[0];
    }
    b[0] = first;
}

/* W x, or W^-1 x. */
static void scale_by(const ConeScaling *scaling, bool inverse, const double x[], double scaled[]) {
    const double sign = inverse ? -1.0 : 1.0, factor = inverse ? 1.0 / scaling->factor : scaling->factor;
    const double v[3] = {scaling->v[0], sign * scaling->v[1], sign * scaling->v[2]};
    const double along = 2.0 * cone_dot(v, x);
    const double first = factor * (along * v[0] - x[0]);
    for (int i = 1; i < 3; i++) {
        scaled[i] = factor * (along * v[i] + x[i]);
    }
    scaled[0] = first;
}

/* The scaling of Nesterov and Todd: w lies between s and z, scaled to the hyperbola of determinant 1, and W^2 z = s. */
static void find_scaling(const double s[], const double z[], ConeScaling *scaling) {
    const double of_s = sqrt(fmax(cone_determinant(s), DBL_MIN)), of_z = sqrt(fmax(cone_determinant(z), DBL_MIN));
    double w[3] = {s[0] / of_s + z[0] / of_z, s[1] / of_s - z[1] / of_z, s[2] / of_s - z[2] / of_z};
    const double gamma = sqrt(fmax(0.5 * (1.0 + cone_dot(s, z) / (of_s * of_z)), DBL_MIN));
    for (int i = 0; i < 3; i++) {
        w[i] /= 2.0 * gamma;
    }
    const double length = sqrt(2.0 * (w[0] + 1.0));
    w[0] += 1.0;
    for (int i = 0; i < 3; i++) {
        scaling->v[i] = w[i] / length;
    }
    scaling->factor = sqrt(of_s / of_z);
}

/* The greatest part of dv, at most 1, up to which v + part dv stays in the cone. */
static double cone_reach(const double v[], const double dv[]) {
    const double a = cone_determinant(dv), b = v[0] * dv[0] - v[1] * dv[1] - v[2] * dv[2];
    const double c = fmax(cone_determinant(v), 0.0), root = sqrt(fmax(b * b - a * c, 0.0));
    const double q = -(b + (b >= 0.0 ? root : -root)), ways[3] = {q / a, c / q, -v[0] / dv[0]};
    double part = 1.0;
    for (int i = 0; i < 3; i++) {
        part = ways[i] > 0.0 && ways[i] < part ? ways[i] : part;
    }
    return part;
}

/* felt = B z for the cone at this row. B is the correction by de Saxce: options.slip times the slip, along its present
   direction, is taken from the first component. */
static void correct(const Path *path, int row, const double z[], double felt[]) {
    const double *now = path->z + row, length = vector_length(now + 1, 2);
    memcpy(felt, z, 3 * sizeof(double));
    felt[0] -= length > 0.0 ? path->options.slip * (now[1] * z[1] + now[2] * z[2]) / length : 0.0;
}

/* to[size] += sign map' B z, where B is the correction */
static void map_back(const Path *path, double sign, const double z[], double to[]) {
    const Sparse *map = &path->program->map;
    for (int row = 0; row < map->rows; row += 3) {
        double felt[3];
        correct(path, row, z + row, felt);
        for (int i = 0; i < 3; i++) {
            for (int e = map->start[row + i]; e < map->start[row + i + 1]; e++) {
                to[map->column[e]] += sign * map->value[e] * felt[i];
            }
        }
    }
}

/* The residuals; returns how far y, s and z are from a solution, relative to y. */
static double find_residuals(Path *path, double *gap, double *size) {
    const ConeProgram *program = path->program;
    const int n = program->size, rows = 3 * program->cones;
    sparse_multiply(&program->matrix, path->y, path->dual);
    for (int i = 0; i < n; i++) {
        path->dual[i] += program->offset[i] / path->scale + path->options.weight * path->y[i];
    }
    map_back(path, -1.0, path->z, path->dual);
    sparse_multiply(&program->map, path->y, path->primal);
    *gap = 0.0;
    for (int i = 0; i < rows; i++) {
        path->primal[i] += program->shift[i] / path->scale - path->s[i];
        *gap += path->s[i] * path->z[i] / (double)program->cones;
    }
    *size = 1.0 + vector_greatest(path->y, n);
    const double rest = fmax(vector_greatest(path->dual, n), vector_greatest(path->primal, rows)) / *size;
    return fmax(rest, *gap / (*size * *size));
}

/* Adds map' B W^-2 map of one cone to the matrix of a step, for the entry e of the map in its row i. */
static void add_entry_of(const Path *path, int row, int i, int e) {
    const Sparse *map = &path->program->map;
    const ConeScaling *scaling = &path->scaling[row / 3];
    double entry[3] = {0.0, 0.0, 0.0}, felt[3];
    entry[i] = map->value[e];
    scale_by(scaling, true, entry, entry);
    scale_by(scaling, true, entry, entry);
    correct(path, row, entry, felt);
    for (int j = 0; j < 3; j++) {
        for (int f = map->start[row + j]; f < map->start[row + j + 1]; f++) {
            *step_matrix_entry(&path->matrix, map->column[f], map->column[e]) += map->value[f] * felt[j];
        }
    }
}

/* The matrix of a step: that of the program, and map' B W^-2 map. */
static bool factorize_path(Path *path) {
    const Sparse *matrix = &path->program->matrix, *map = &path->program->map;
    step_matrix_clear(&path->matrix);
    for (int i = 0; i < matrix->rows; i++) {
        for (int e = matrix->start[i]; e < matrix->start[i + 1]; e++) {
            *step_matrix_entry(&path->matrix, i, matrix->column[e]) += matrix->value[e];
        }
        *step_matrix_entry(&path->matrix, i, i) += path->options.weight;
    }
    for (int row = 0; row < map->rows; row++) {
        for (int e = map->start[row]; e < map->start[row + 1]; e++) {
            add_entry_of(path, row - row % 3, row % 3, e);
        }
    }
    return step_matrix_factorize(&path->matrix, DBL_MIN);
}

/* dz of the cone at this row for its ds, as the target of W^-1 ds + W dz wants it. */
static void find_dz(const Path *path, int row, const double ds[], double dz[]) {
    const ConeScaling *scaling = &path->scaling[row / 3];
    double rest[3];
    scale_by(scaling, true, ds, rest);
    for (int i = 0; i < 3; i++) {
        rest[i] = path->target[row + i] - rest[i];
    }
    scale_by(scaling, true, rest, dz);
}

/* The change of y, s and z for the targets of all cones. */
static void solve_step(Path *path) {
    const ConeProgram *program = path->program;
    const int rows = 3 * program->cones;
    for (int row = 0; row < rows; row += 3) {
        find_dz(path, row, path->primal + row, path->dz + row);
    }
    for (int i = 0; i < program->size; i++) {
        path->right[i] = -path->dual[i];
    }
    map_back(path, 1.0, path->dz, path->right);
    step_matrix_solve(&path->matrix, path->right, path->dy);
    sparse_multiply(&program->map, path->dy, path->ds);
    for (int row = 0; row < rows; row++) {
        path->ds[row] += path->primal[row];
    }
    for (int row = 0; row < rows; row += 3) {
        find_dz(path, row, path->ds + row, path->dz + row);
    }
}

static double reach_of_all(const Path *path) {
    double part = 1.0;
    for (int c = 0; c < 3 * path->program->cones; c += 3) {
        part = fmin(part, fmin(cone_reach(path->s + c, path->ds + c), cone_reach(path->z + c, path->dz + c)));
    }
    return part;
}

/* The target of the corrector, which leads towards the centre as far as the predictor did not come. */
static void aim(Path *path, double gap, double centre) {
    for (int c = 0; c < 3 * path->program->cones; c += 3) {
        const ConeScaling *scaling = &path->scaling[c / 3];
        double square[3], ds[3], dz[3], cross[3] = {0.0, 0.0, 0.0};
        cone_product(path->middle + c, path->middle + c, square);
        if (path->options.centring == 0.0) {
            scale_by(scaling, true, path->ds + c, ds);
            scale_by(scaling, false, path->dz + c, dz);
            cone_product(ds, dz, cross);
        }
        for (int i = 0; i < 3; i++) {
            path->target[c + i] = (i == 0 ? centre * gap : 0.0) - square[i] - cross[i];
        }
        cone_quotient(path->middle + c, path->target + c);
    }
}

/* v + part dv, inside its cone in spite of rounding. */
static void advance(double part, const double dv[], double v[]) {
    for (int i = 0; i < 3; i++) {
        v[i] += part * dv[i];
    }
    v[0] = fmax(v[0], vector_length(v + 1, 2) * (1.0 + 4.0 * DBL_EPSILON) + DBL_MIN);
}

static bool path_step(Path *path, double gap) {
    const ConeProgram *program = path->program;
    for (int c = 0; c < 3 * program->cones; c += 3) {
        find_scaling(path->s + c, path->z + c, &path->scaling[c / 3]);
        scale_by(&path->scaling[c / 3], false, path->z + c, path->middle + c);
        for (int i = 0; i < 3; i++) {
            path->target[c + i] = -path->middle[c + i];
        }
    }
    if (!factorize_path(path)) {
        return false;
    }
    solve_step(path);
    const double left = 1.0 - reach_of_all(path);
    aim(path, gap, fmin(1.0, fmax(left * left * left, path->options.centring)));
    solve_step(path);
    const double part = fmin(1.0, INSIDE * reach_of_all(path));
    for (int i = 0; i < program->size; i++) {
        path->y[i] += part * path->dy[i];
    }
    for (int c = 0; c < 3 * program->cones; c += 3) {
        advance(part, path->ds + c, path->s + c);
        advance(part, path->dz + c, path->z + c);
    }
    return true;
}

static double *take_doubles(Arena *arena, int count) {
    return (double *)arena_take(arena, (size_t)count * sizeof(double));
}

/* The beginning of the path, y = 0. False: there is no memory. */
static bool begin_path(Arena *arena, const ConeProgram *program, PathOptions options, Path *path) {
    const int n = program->size, rows = 3 * program->cones;
    const size_t doubles = (size_t)(4 * n + 7 * rows + 4 * program->cones);
    if (!arena_reserve(arena, doubles * sizeof(double) + 16 * ARENA_UNIT + step_matrix_bytes(n, program->first))) {
        return false;
    }
    double **vectors[] = {&path->y, &path->dy, &path->right, &path->dual};
    double **cones[] = {&path->s,      &path->z,      &path->ds,     &path->dz,
                        &path->primal, &path->middle, &path->target};
    path->program = program;
    path->options = options;
    path->scale = fmax(fmax(vector_greatest(program->offset, n), vector_greatest(program->shift, rows)), DBL_MIN);
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        *vectors[i] = take_doubles(arena, n);
    }
    for (size_t i = 0; i < sizeof cones / sizeof *cones; i++) {
        *cones[i] = take_doubles(arena, rows);
    }
    path->matrix = step_matrix_take(arena, n, program->first);
    path->scaling = (ConeScaling *)arena_take(arena, (size_t)program->cones * sizeof(ConeScaling));
    memset(path->y, 0, (size_t)n * sizeof(double));
    for (int i = 0; i < rows; i++) {
        path->s[i] = i % 3 == 0 ? 1.0 : 0.0;
        path->z[i] = path->s[i];
    }
    return true;
}

bool central_path(const ConeProgram *program, PathOptions options, double y[]) {
    const ArenaMark mark = arena_mark(program->arena);
    const size_t bytes = (size_t)program->size * sizeof(double);
    Path path;
    double best = HUGE_VAL, gap, size;
    memset(y, 0, bytes);
    if (!begin_path(program->arena, program, options, &path)) {
        return arena_leave(mark, false);
    }
    for (int i = 0, stalls = 0; i < MOST_PATH_STEPS && stalls <= MOST_STALLS && best > SOLVED; i++) {
        const double rest = find_residuals(&path, &gap, &size);
        stalls = rest < 0.5 * best ? 0 : stalls + 1;
        if (rest < best) {
            best = rest;
            memcpy(y, path.y, bytes);
            if (program->forces != NULL) {
                memcpy(program->forces, path.z, 3 * (size_t)program->cones * sizeof(double));
            }
        }
        if (!(rest < HUGE_VAL) || size > MOST_PATH_GROWTH || best <= SOLVED || !path_step(&path, gap)) {
            break;
        }
    }
    for (int i = 0; i < program->size; i++) {
        y[i] *= path.scale;
    }
    return arena_leave(mark, true);
}
