/* Connected components of the graph whose edges are the entries of the Delassus operator that are not 0, and the pairs
   of a row of friction and its normal. Each row is visited once, and then looks at all others. */
#include "islands.h"

#include <string.h>

static bool has_normal(const Row *row) {
    return row->law == ROW_TANGENTIAL || row->law == ROW_SLIDING;
}

/* A free row has no force: it acts on no other row, and is seen only by the friction that it is the normal of. */
static bool connected(const Problem *problem, int i, int j) {
    const Row *a = &problem->row[i], *b = &problem->row[j];
    return (a->law != ROW_FREE && b->law != ROW_FREE && problem->delassus[i * problem->rows + j] != 0.0) ||
           (has_normal(a) && a->normal == j) || (has_normal(b) && b->normal == i);
}

/* Gives all rows that are connected to this one its island; waiting[rows] is memory. */
static void visit(const Problem *problem, Islands *islands, int first, int waiting[]) {
    int begin = 0, end = 1;
    waiting[0] = first;
    islands->island[first] = islands->count;
    while (begin < end) {
        const int row = waiting[begin++];
        for (int k = 0; k < problem->rows; k++) {
            if (islands->island[k] < 0 && connected(problem, row, k)) {
                islands->island[k] = islands->count;
                waiting[end++] = k;
            }
        }
    }
    islands->count++;
}

bool islands_find(const Problem *problem, Islands *islands) {
    const size_t bytes = (size_t)problem->rows * sizeof(int);
    if (!arena_reserve(problem->arena, 2 * arena_bytes(bytes, 1))) {
        return false;
    }
    islands->island = (int *)arena_take(problem->arena, bytes);
    const ArenaMark mark = arena_mark(problem->arena);
    int *waiting = (int *)arena_take(problem->arena, bytes);
    islands->count = 0;
    memset(islands->island, -1, bytes);
    for (int k = 0; k < problem->rows; k++) {
        if (problem->row[k].law != ROW_FREE && islands->island[k] < 0) {
            visit(problem, islands, k, waiting);
        }
    }
    return arena_leave(mark, true);
}

static void copy_rows(const Problem *problem, const Island *island, const int place[], double delassus[],
                      double free_motion[], Row rows[]) {
    const int n = island->problem.rows;
    for (int a = 0; a < n; a++) {
        const int i = island->row[a];
        rows[a] = problem->row[i];
        rows[a].normal = has_normal(&rows[a]) ? place[rows[a].normal] : 0;
        free_motion[a] = problem->free[i];
        for (int b = 0; b < n; b++) {
            delassus[a * n + b] = problem->delassus[i * problem->rows + island->row[b]];
        }
    }
}

bool island_take(const Problem *problem, const Islands *islands, int which, Island *island) {
    Arena *arena = problem->arena;
    const size_t rows = (size_t)problem->rows;
    size_t n = 0;
    for (size_t k = 0; k < rows; k++) {
        n += islands->island[k] == which;
    }
    const size_t bytes = arena_bytes(n * n + n, sizeof(double)) + arena_bytes(n, sizeof(Row)) +
                         arena_bytes(n, sizeof(int)) + arena_bytes(rows, sizeof(int)) + arena_bytes(n, sizeof(bool));
    if (!arena_reserve(arena, bytes)) {
        return false;
    }
    double *delassus = (double *)arena_take(arena, (n * n + n) * sizeof(double)), *free_motion = delassus + n * n;
    Row *row = (Row *)arena_take(arena, n * sizeof(Row));
    bool *determined = (bool *)arena_take(arena, n * sizeof(bool));
    island->row = (int *)arena_take(arena, n * sizeof(int));
    const ArenaMark mark = arena_mark(arena);
    int *place = (int *)arena_take(arena, rows * sizeof(int));
    for (int k = 0, next = 0; k < problem->rows; k++) {
        if (islands->island[k] == which) {
            place[k] = next;
            island->row[next++] = k;
        }
    }
    island->problem = (Problem){.arena = arena,
                                .rows = (int)n,
                                .delassus = delassus,
                                .free = free_motion,
                                .row = row,
                                .determined = problem->determined == NULL ? NULL : determined};
    copy_rows(problem, island, place, delassus, free_motion, row);
    arena_release(mark);
    return true;
}
