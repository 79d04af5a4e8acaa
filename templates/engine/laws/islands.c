/* Connected components of the graph whose edges are the entries of the Delassus operator that are not 0, and the pairs
   of a row of friction and its normal. Each row is visited once, and then looks at all others. */
#include "islands.h"

#include <math.h>
#include <string.h>

bool is_second(const Row row[], int k) {
    int before = 0;
    for (int i = k - 1; i >= 0 && row[i].law == ROW_TANGENTIAL && row[i].normal == row[k].normal; i--) {
        before++;
    }
    return row[k].law == ROW_TANGENTIAL && before % 2 == 1;
}

static double scale_for(double diagonal) {
    return diagonal > 0.0 ? 1.0 / sqrt(diagonal) : 1.0;
}

void find_scales(int rows, const Row row[], const double diagonal[], int apart, double scale[]) {
    for (int k = 0; k < rows; k++) {
        scale[k] = scale_for(diagonal[k * apart]);
        if (k > 0 && is_second(row, k)) {
            scale[k] = scale_for(0.5 * (diagonal[k * apart] + diagonal[(k - 1) * apart]));
            scale[k - 1] = scale[k];
        }
    }
}

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
    const size_t numbers = (size_t)problem->rows * sizeof(double);
    if (!arena_reserve(problem->arena, 2 * arena_bytes(bytes, 1) + arena_bytes(numbers, 1))) {
        return false;
    }
    islands->island = (int *)arena_take(problem->arena, bytes);
    islands->scale = (double *)arena_take(problem->arena, numbers);
    find_scales(problem->rows, problem->row, problem->delassus, problem->rows + 1, islands->scale);
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
