/* Start and range of what is remembered of the elements. */
#include "elements.h"

#include <string.h>

void elements_start(Elements *elements) {
    memset(elements, 0, sizeof *elements);
    for (int i = 0; i < N_ELEMENTS; i++) {
        elements->modes[i] = i < N_UNILATERALS ? ELEMENT_OPEN : ELEMENT_STICKS;
    }
}

bool elements_in_range(const Elements *elements) {
    for (int i = 0; i < N_ELEMENTS; i++) {
        const int64_t least = i < N_UNILATERALS ? ELEMENT_OPEN : ELEMENT_STICKS;
        if (elements->modes[i] < least || elements->modes[i] > ELEMENT_SLIDES_BACKWARD) {
            return false;
        }
    }
    for (int i = 0; i < N_UNILATERALS; i++) {
        if (elements->impacts[i] < 0 || elements->impacts[i] > INT64_MAX / 2) { /* no run counts so far */
            return false;
        }
    }
    return true;
}
