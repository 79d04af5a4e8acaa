/* What calls of a component have in memory, by the Component Model's canonical ABI, and what it calls itself. */
#ifndef WASM_H
#define WASM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "version.h"

/* A list, or a string in UTF-8. */
typedef struct {
    const void *items;
    size_t count;
} List;

typedef struct {
    uint8_t some;
    fmi3Instance instance;
} Option;

typedef struct {
    uint8_t needed, terminates, nominals_changed, values_changed, next_defined;
    double next;
} DiscreteStates;

typedef struct {
    double last;
    uint8_t event, terminates, early;
} StepEnd;

typedef struct {
    uint8_t event, terminates;
} CompletedStep;

/* Results of calls: a value, or the status of a call that failed. */
typedef struct {
    uint8_t failed;
    union {
        List list;
        uint8_t status;
    } of;
} ListResult;

typedef struct {
    uint8_t failed;
    union {
        uint64_t count;
        uint8_t status;
    } of;
} CountResult;

typedef struct {
    uint8_t failed;
    union {
        DiscreteStates states;
        uint8_t status;
    } of;
} DiscreteResult;

typedef struct {
    uint8_t failed;
    union {
        StepEnd step;
        uint8_t status;
    } of;
} StepResult;

typedef struct {
    uint8_t failed;
    union {
        CompletedStep completed;
        uint8_t status;
    } of;
} CompletedResult;

/* A derivative of a variable, of this order. */
typedef struct {
    uint32_t reference, order;
} Request;

typedef struct {
    uint32_t dependent, element_of_dependent, independent, element_of_independent;
    uint8_t kind; /* 0: dependent, 1: constant */
} VariableDependency;

/* The importer's logger: name of the instance, status, category and message. */
void wasm_log_message(const char *name, size_t name_length, fmi3Status status, const char *category,
                      size_t category_length, const char *message, size_t message_length);

#endif
