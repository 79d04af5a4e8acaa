/* What a random run knows of the instance that it drives: tries3.c has the arguments of the calls, random_calls3.c the
   states and the judgement. The host is compiled together with the sources of an FMU and reads its tables. */
#ifndef RANDOM_CALLS3_H
#define RANDOM_CALLS3_H

#include <stddef.h>
#include <stdint.h>

#include "prefix.h"

#include "fmi3Functions.h"
#include "standard_calls3.h"
#include "tables.h" /* of the FMU */

enum { MAX_BYTES = 1 << 16, MOST_ELEMENTS = 4096 };
enum { OK = 1 << fmi3OK, WARNED = 1 << fmi3Warning, DISCARDED = 1 << fmi3Discard, REFUSED = 1 << fmi3Error };

/* What belongs to a saved state. */
typedef struct {
    char mode; /* a letter of standard_calls3.h */
    int wild;  /* numbers were set that the mechanism may not bear, so that calculations may fail */
    double time;
} Model;

typedef struct {
    int co_simulation, events, early, follows; /* how the instance was made */
    fmi3Instance instance;                     /* NULL for a call that is made without one */
    Model model;
    uint64_t random;
    int errors, messages;
    char text[2048];
    fmi3FMUState slot; /* a saved state, or NULL, */
    Model slot_model;
    size_t size; /* and a serialized one, if any */
    Model bytes_model;
    fmi3Byte bytes[MAX_BYTES];
    int erred_inside; /* a wrong call was made in an intermediate update */
    int calling;      /* a call of the random sequence runs */
} Session;

/* A call that was made: what it returned, and what it may return if it is legal in the present state. */
typedef struct {
    fmi3Status status;
    unsigned allowed;
} Outcome;

/* A whole number from 0 to below n, and a number from low to high. */
unsigned below(Session *s, unsigned n);
double between(Session *s, double low, double high);

/* Is a mistake made? Seldom. */
int mistake(Session *s);

/* Ends the program with exit status 1 and this message unless the condition holds. */
void expect(int condition, const char *format, ...);

/* The letter of a port, see pick(). */
char letter_of(const Port *port);

/* A random port of a kind: x state, u input, p tunable, f fixed, c calculated real number, i count, m mode, k clock; a
   number beyond all ports if there is none. */
fmi3ValueReference pick(Session *s, char kind);

#define DECLARE(name, model_exchange, co_simulation) Outcome try_##name(Session *s);
STANDARD_CALLS(DECLARE)
#undef DECLARE

#endif
