#include "listing.h"

#include <math.h>

/* The result of each operation of a run, which begins at next, is this value of its operands a and b. */
#define EACH(value)                                  \
    for (; next < end; next += 3) {                  \
        const double a = s[next[1]], b = s[next[2]]; \
        s[next[0]] = (value);                        \
        (void)b;                                     \
    }                                                \
    break

void listing_run(const unsigned short listing[], int runs, double s[]) {
    const unsigned short *next = listing;
    for (int i = 0; i < runs; i++) {
        const unsigned short sign = next[0], *end = next + 2 + 3 * next[1];
        next += 2;
        switch (sign) {
        case '+': EACH(a + b);
        case '-': EACH(a - b);
        case '*': EACH(a * b);
        case '/': EACH(a / b);
        case '~': EACH(-a);
        case 'r': EACH(sqrt(a));
        case 's': EACH(sin(a));
        default: EACH(cos(a));
        }
    }
}

void listing_read(const int places[], int count, const double s[], double result[]) {
    for (int i = 0; i < count; i++) {
        result[places[2 * i]] = s[places[2 * i + 1]];
    }
}
