/* Units by breadth-first search, neighbours with few entries first. */
#include "sparse_rows.h"

/* Rows that belong together: those of a contact, or a single one. */
typedef struct {
    const SparseProblem *problem;
    int count;
    int *start;    /* unit -> its first row; start[count] = rows */
    int *unit;     /* row -> its unit */
    int *degree;   /* unit -> how many entries its rows have */
    int *order;    /* units in the order of the search */
    bool *placed;  /* unit -> is it in the order? */
    bool *begins;  /* unit -> did the search of an island begin with it? */
} Units;

static void find_units(Units *units) {
    const SparseProblem *problem = units->problem;
    const int *start = problem->delassus.start;
    units->count = 0;
    for (int k = 0; k < problem->delassus.rows; k++) {
        const bool follows = k > 0 && problem->row[k].law == ROW_TANGENTIAL &&
                             problem->row[k].normal == units->start[units->count - 1];
        if (!follows) {
            units->start[units->count] = k;
            units->placed[units->count] = units->begins[units->count] = false;
            units->degree[units->count++] = 0;
        }
        units->unit[k] = units->count - 1;
        units->degree[units->count - 1] += start[k + 1] - start[k];
    }
    units->start[units->count] = problem->delassus.rows;
}

/* Appends the neighbours of a unit that are not yet in the order, by degree; returns how many are in it. */
static int append_neighbours(const Units *units, int unit, int count) {
    const Sparse *delassus = &units->problem->delassus;
    const int before = count;
    for (int e = delassus->start[units->start[unit]]; e < delassus->start[units->start[unit + 1]]; e++) {
        const int other = units->unit[delassus->column[e]];
        if (units->placed[other]) {
            continue;
        }
        int at = count++;
        for (; at > before && units->degree[units->order[at - 1]] > units->degree[other]; at--) {
            units->order[at] = units->order[at - 1];
        }
        units->order[at] = other;
        units->placed[other] = true;
    }
    return count;
}

/* Appends what is connected to a unit, itself first; returns how many are in the order. */
static int append_island(const Units *units, int unit, int count) {
    int end = count;
    units->order[end++] = unit;
    units->placed[unit] = true;
    for (int done = count; done < end; done++) {
        end = append_neighbours(units, units->order[done], end);
    }
    return end;
}

/* Each island is searched from the last unit that a search from any of its units finds. */
static void search_units(const Units *units) {
    for (int unit = 0, count = 0; unit < units->count; unit++) {
        if (units->placed[unit]) {
            continue;
        }
        const int end = append_island(units, unit, count), far = units->order[end - 1];
        for (int i = count; i < end; i++) {
            units->placed[units->order[i]] = false;
        }
        units->begins[far] = true;
        count = append_island(units, far, count);
    }
}

static void place_rows(const Units *units, RowOrder *order) {
    int place = 0;
    order->islands = 0;
    order->island[0] = 0;
    for (int i = units->count - 1; i >= 0; i--) { /* reversed */
        const int unit = units->order[i];
        for (int k = units->start[unit]; k < units->start[unit + 1]; k++) {
            order->row[place] = k;
            order->place[k] = place++;
        }
        if (units->begins[unit]) {
            order->island[++order->islands] = place;
        }
    }
}

static void find_envelope(const Units *units, const RowOrder *order) {
    const Sparse *delassus = &units->problem->delassus;
    for (int u = 0; u < units->count; u++) {
        const int begin = units->start[u], end = units->start[u + 1];
        int first = order->place[begin];
        for (int e = delassus->start[begin]; e < delassus->start[end]; e++) {
            const int other = order->place[units->start[units->unit[delassus->column[e]]]];
            first = other < first ? other : first;
        }
        for (int k = begin; k < end; k++) {
            order->first[order->place[k]] = first;
        }
    }
}

bool rows_order(const SparseProblem *problem, RowOrder *order) {
    Arena *arena = problem->arena;
    const size_t n = (size_t)problem->delassus.rows, bytes = (n + 1) * sizeof(int);
    if (!arena_reserve(arena, 8 * arena_bytes(bytes, 1) + 2 * arena_bytes(n, sizeof(bool)))) {
        return false;
    }
    int **kept[] = {&order->row, &order->place, &order->first, &order->island};
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) {
        *kept[i] = (int *)arena_take(arena, bytes);
    }
    const ArenaMark mark = arena_mark(arena);
    Units units = {.problem = problem,
                   .start = (int *)arena_take(arena, bytes),
                   .unit = (int *)arena_take(arena, bytes),
                   .degree = (int *)arena_take(arena, bytes),
                   .order = (int *)arena_take(arena, bytes),
                   .placed = (bool *)arena_take(arena, n * sizeof(bool)),
                   .begins = (bool *)arena_take(arena, n * sizeof(bool))};
    find_units(&units);
    search_units(&units);
    place_rows(&units, order);
    find_envelope(&units, order);
    return arena_leave(mark, true);
}
