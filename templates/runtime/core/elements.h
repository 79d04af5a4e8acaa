/* What the laws of contact remember of the elements: first the unilaterals (contacts and stops), then the dry
   frictions. */
#ifndef ELEMENTS_H
#define ELEMENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "element_sizes.h"

/* How an element holds; the values of the FMU's enumeration. Only a unilateral is ever open. Where the slip is one
   number, forward is the positive direction of its velocity. */
typedef enum {
    ELEMENT_OPEN = 1,
    ELEMENT_STICKS,
    ELEMENT_SLIDES, /* in space, or without friction */
    ELEMENT_SLIDES_FORWARD,
    ELEMENT_SLIDES_BACKWARD
} ElementMode;

/* Part of the State. */
typedef struct {
    int64_t modes[SIZE_ELEMENTS];      /* ElementMode */
    int64_t impacts[SIZE_UNILATERALS]; /* since the start */
    double impulses[SIZE_UNILATERALS]; /* normal, of the last impact; N s, or N m s where the gap is an angle */
} Elements;

/* Before anything is decided: unilaterals are open and frictions stick, without an impact so far. */
void elements_start(Elements *elements);

/* Are all modes those that the elements may have, and the counts no negative numbers? */
bool elements_in_range(const Elements *elements);

#endif
