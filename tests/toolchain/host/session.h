/* What a random run knows of the instance that it drives, and the calls it can make: session_*.c have the arguments,
   random_calls.c has the states and the judgement. */
#ifndef SESSION_H
#define SESSION_H

#include "importer.h"

/* Statuses as a set. */
enum { OK = 1 << fmi2OK, WARNED = 1 << fmi2Warning, DISCARDED = 1 << fmi2Discard, REFUSED = 1 << fmi2Error };

/* What belongs to a saved state. */
typedef struct {
    char mode; /* a letter of standard_calls.h */
    int wild;  /* numbers were set that the mechanism may not bear, so that calculations may fail */
    double time, stop;
} Model;

typedef struct {
    const Fmu *fmu;
    fmi2Type type;
    fmi2Component component; /* NULL for a call that is made without an instance */
    Model model;
    uint64_t random;
    int logging; /* a sentence is due for every status but fmi2OK, ... */
    int silent;  /* ... unless there is no logger */
    Log log;

    fmi2FMUstate slot; /* a saved state, or NULL, */
    Model slot_model;
    size_t size; /* and a serialized one, if any */
    Model bytes_model;
    fmi2Byte bytes[MAX_BYTES];
    fmi2Byte fresh[MAX_BYTES]; /* the state of a new instance */
    size_t foreign_size;
    fmi2Byte foreign[MAX_BYTES]; /* that of an instance of the other type */
} Session;

/* A call that was made: what it returned, and what it may return if it is legal in the present state. */
typedef struct {
    fmi2Status status;
    unsigned allowed;
} Outcome;

/* A whole number from 0 to below n, and a number from low to high. */
unsigned below(Session *s, unsigned n);
double between(Session *s, double low, double high);
double not_finite(Session *s);

/* Which mistake is made: seldom one of 0 to below kinds, mostly none, then it returns kinds. */
unsigned mistake(Session *s, unsigned kinds);

/* A random variable of one of these kinds. */
const Variable *pick(Session *s, const char *kinds);

/* The statuses of a calculation with right arguments. */
unsigned calculation(const Session *s);

#define DECLARE(name, model_exchange, co_simulation) Outcome try_##name(Session *s);
#include "standard_calls.h"
STANDARD_CALLS(DECLARE)
#undef DECLARE

#endif
