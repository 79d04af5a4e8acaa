/* Units by breadth-first search, neighbours with few entries first. */
#include "sparse_rows.h"

static void find_units(const SparseProblem *problem, Units *units) {
    units->count = 0;
    for (int k = 0; k < problem->rows; k++) {
        const bool follows = k > 0 && problem->row[k].law == ROW_TANGENTIAL &&
                             problem->row[k].normal == units->start[units->count - 1];
        if (!follows) {
            units->start[units->count] = k;
            units->degree[units->count++] = 0;
        }
        units->unit[k] = units->count - 1;
        units->degree[units->count - 1] += problem->start[k + 1] - problem->start[k];
        units->order[k] = -1;
        units->place[k] = -1;
    }
    units->start[units->count] = problem->rows;
}

/* Appends the neighbours of a unit that are not yet in the order, by degree; place[u] >= 0 flags those that are. */
static int append_neighbours(const SparseProblem *problem, Units *units, int unit, int placed) {
    const int before = placed;
    for (int e = problem->start[units->start[unit]]; e < problem->start[units->start[unit + 1]]; e++) {
        const int other = units->unit[problem->column[e]];
        if (units->place[other] >= 0) {
            continue;
        }
        int at = placed++;
        for (; at > before && units->degree[units->order[at - 1]] > units->degree[other]; at--) {
            units->order[at] = units->order[at - 1];
        }
        units->order[at] = other;
        units->place[other] = 0;
    }
    return placed;
}

/* The unit to begin with: the last one that a search from the first free one finds. place is left as it was. */
static int far_unit(const SparseProblem *problem, Units *units, int placed) {
    int first = 0;
    while (units->place[first] >= 0) {
        first++;
    }
    int end = placed;
    units->order[end++] = first;
    units->place[first] = 0;
    for (int done = placed; done < end; done++) {
        end = append_neighbours(problem, units, units->order[done], end);
    }
    for (int i = placed; i < end; i++) {
        units->place[units->order[i]] = -1;
    }
    return units->order[end - 1];
}

static void search_units(const SparseProblem *problem, Units *units) {
    int placed = 0;
    for (int done = 0; done < units->count; done++) {
        if (done == placed) {
            const int unit = far_unit(problem, units, placed);
            units->order[placed++] = unit;
            units->place[unit] = 0;
        }
        placed = append_neighbours(problem, units, units->order[done], placed);
    }
    for (int i = 0, j = units->count - 1; i < j; i++, j--) {
        const int unit = units->order[i];
        units->order[i] = units->order[j];
        units->order[j] = unit;
    }
}

int units_order(const SparseProblem *problem, Units *units) {
    int place = 0, entries = 0;
    find_units(problem, units);
    search_units(problem, units);
    for (int i = 0; i < units->count; i++) {
        const int unit = units->order[i];
        for (int k = units->start[unit]; k < units->start[unit + 1]; k++) {
            units->place[k] = place++;
        }
    }
    for (int u = 0; u < units->count; u++) {
        int first = units->place[units->start[u]];
        for (int e = problem->start[units->start[u]]; e < problem->start[units->start[u + 1]]; e++) {
            const int other = units->place[units->start[units->unit[problem->column[e]]]];
            first = other < first ? other : first;
        }
        for (int k = units->start[u]; k < units->start[u + 1]; k++) {
            units->first[units->place[k]] = first;
        }
    }
    for (int i = 0; i < problem->rows; i++) {
        units->offset[i] = entries - units->first[i];
        entries += i + 1 - units->first[i];
    }
    return entries;
}
