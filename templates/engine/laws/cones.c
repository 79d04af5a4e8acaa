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

/* More choices of equations are not tried one by one. */
static const double MOST_CHOICES = 4096.0;

/* Ways of the central path that are tried in turn: contacts that give way more and more, and more and more through the
   middle of the cones. */
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

/* Rows of friction without any limit have no force, and no place[size] in the program; returns how many do. */
static int place_rows(const Laws *laws, int place[], int *cones) {
    int count = 0;
    *cones = 0;
    for (int k = 0; k < laws->size; k++) {
        const int first = laws->width[k] < 0 ? k - 1 : k;
        place[k] = laws->width[k] == 0 || may_rub(laws, first) ? count++ : -1;
        *cones += laws->width[k] == 0 ? !is_framed(laws, k) : may_rub(laws, k);
    }
    return count;
}

static void put_cones_of(const Laws *laws, const int place[], ConeProgram *program) {
    const int n = program->size;
    for (int k = 0, c = 0; k < laws->size; k++) {
        double *row = program->map + 3 * c * n;
        if (laws->width[k] == 0 && !is_framed(laws, k)) {
            row[place[k]] = 1.0;
            c++;
        } else if (may_rub(laws, k)) {
            program->shift[3 * c] = laws->base[k];
            if (laws->normal[k] >= 0) {
                row[place[laws->normal[k]]] = laws->slope[k];
            }
            for (int i = 0; i < laws->width[k]; i++) {
                row[(1 + i) * n + place[k + i]] = 1.0;
            }
            c++;
        }
    }
}

static void put_operator(const Laws *laws, const int place[], ConeProgram *program) {
    for (int i = 0; i < laws->size; i++) {
        for (int j = 0; place[i] >= 0 && j < laws->size; j++) {
            if (place[j] >= 0) {
                program->matrix[place[i] * program->size + place[j]] = laws->matrix[i * laws->size + j];
            }
        }
        if (place[i] >= 0) {
            program->offset[place[i]] = laws->offset[i];
        }
    }
}

/* Newton's method from the end of a central path. */
static bool solve_along(const Laws *laws, const ConeProgram *program, const int place[], PathOptions options,
                        double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    const size_t bytes = (size_t)laws->size * sizeof(double);
    if (!arena_reserve(laws->arena, 2 * arena_bytes(bytes, 1))) {
        return arena_leave(mark, false);
    }
    double *y = (double *)arena_take(laws->arena, bytes), *start = (double *)arena_take(laws->arena, bytes);
    if (!central_path(program, options, y)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < laws->size; k++) {
        start[k] = place[k] >= 0 ? y[place[k]] : 0.0;
    }
    return arena_leave(mark, newton_solve(laws, start, x));
}

/* Rows that slide make the operator asymmetric: friction may press a contact to its support. */
static bool is_asymmetric(const Laws *laws) {
    bool found = false;
    for (int i = 0; i < laws->size; i++) {
        for (int j = 0; j < i; j++) {
            const double a = laws->matrix[i * laws->size + j], b = laws->matrix[j * laws->size + i];
            found = found || fabs(a - b) > OBEYED * fmax(fabs(a), fabs(b));
        }
    }
    return found;
}

/* The convex program, and then the ways of Coulomb's law. */
static bool solve_by_paths(const Laws *laws, double x[]) {
    const ArenaMark mark = arena_mark(laws->arena);
    ConeProgram program;
    int *place = (int *)arena_take(laws->arena, (size_t)laws->size * sizeof(int)), cones;
    const int size = place_rows(laws, place, &cones);
    if (!cone_program_take(laws->arena, size, cones, &program)) {
        return arena_leave(mark, false);
    }
    put_operator(laws, place, &program);
    put_cones_of(laws, place, &program);
    bool solved = solve_along(laws, &program, place, (PathOptions){0.0, DAMPING, 0.0}, x);
    for (double weight = YIELDS; weight < 2.0 && !solved; weight *= SOFTER) {
        for (int i = 0; i < 3 && !solved; i++) {
            solved = solve_along(laws, &program, place, (PathOptions){1.0, weight, CENTRINGS[i]}, x);
        }
    }
    return arena_leave(mark, solved);
}

bool cones_solve(const Laws *laws, double x[]) {
    const bool few = choices_count(laws) <= MOST_CHOICES;
    if (is_asymmetric(laws) && few) {
        return choices_solve(laws, NULL, x);
    }
    return solve_by_paths(laws, x) || (few && choices_solve(laws, NULL, x));
}
