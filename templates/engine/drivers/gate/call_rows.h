/* Tables of legal calls as rows of text. A column is a mode of the instance, a row is a function, so that a row can be
   held against the row of the standard:

       x   legal
       d   legal for debugging only (the values may be of little use)
       o   beyond the standard's table, but importers do it and it is harmless: accepted, noted once in category logAll
       .   illegal: an error */
#ifndef CALL_ROWS_H
#define CALL_ROWS_H

typedef enum { VERDICT_ILLEGAL = '.', VERDICT_LEGAL = 'x', VERDICT_DEBUG = 'd', VERDICT_TOLERATED = 'o' } Verdict;

typedef enum { MODEL_EXCHANGE, CO_SIMULATION } InterfaceType;

/* A character for each mode, at even positions, for the two types of instance. */
typedef struct {
    const char *name;
    const char *model_exchange;
    const char *co_simulation;
} CallRow;

/* A mode's name and its column in the rows, for the two types of instance; -1 where the type has no such mode. */
typedef struct {
    const char *name;
    int model_exchange, co_simulation;
} ModeColumns;

#endif
