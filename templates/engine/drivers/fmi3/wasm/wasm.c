/* Calls of a component for WebAssembly, by the draft fmi-ls-wasm, as calls of FMI 3.0.

   Arguments and results have the form of the Component Model's canonical ABI: lists and strings are an address and a
   count, records are laid out as structs of C are, and what a call returns beside a number stands in memory. The
   importer takes memory for arguments by wasm_realloc, and all that a call used is free after wasm_post_return. One
   call runs at a time, because a component is not entered twice. */
#include "wasm.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "component.h"
#include "event_sizes.h"
#include "logging.h"

/* A piece of memory that a call uses. */
typedef struct Piece {
    struct Piece *next;
    double content[]; /* aligned for all types */
} Piece;
static Piece *the_pieces;

static void *take(size_t size) {
    Piece *piece = (Piece *)malloc(sizeof *piece + size);
    if (piece == NULL) {
        abort(); /* as the canonical ABI demands where no memory is left */
    }
    piece->next = the_pieces;
    the_pieces = piece;
    return piece->content;
}

void *wasm_realloc(void *old, size_t old_size, size_t alignment, size_t size) {
    (void)alignment; /* none is greater than that of double */
    void *taken = take(size);
    return old_size == 0 ? taken : memcpy(taken, old, old_size < size ? old_size : size);
}

void wasm_post_return(const void *result) {
    (void)result;
    while (the_pieces != NULL) {
        Piece *piece = the_pieces;
        the_pieces = piece->next;
        free(piece);
    }
}

/* A copy of a text, with an end. */
static char *text_of(const char *text, size_t length) {
    char *copy = (char *)take(length + 1);
    memcpy(copy, text, length);
    copy[length] = '\0';
    return copy;
}

static bool succeeded(fmi3Status status) {
    return status == fmi3OK || status == fmi3Warning;
}

/* The result of a call: a list, or the status if it failed. */
static const ListResult *listed(fmi3Status status, const void *items, size_t count) {
    ListResult *result = (ListResult *)take(sizeof *result);
    result->failed = !succeeded(status);
    if (result->failed) {
        result->of.status = (uint8_t)status;
    } else {
        result->of.list = (List){items, count};
    }
    return result;
}

/* The same with a number. */
static const CountResult *counted(fmi3Status status, size_t count) {
    CountResult *result = (CountResult *)take(sizeof *result);
    result->failed = !succeeded(status);
    if (result->failed) {
        result->of.status = (uint8_t)status;
    } else {
        result->of.count = count;
    }
    return result;
}

/* The number of values of these variables; unknown ones, which the call refuses, count as one. */
static size_t count_values(const fmi3ValueReference references[], size_t count) {
    size_t values = 0;
    for (size_t i = 0; i < count; i++) {
        values += references[i] < N_PORTS ? (size_t)PORTS[references[i]].count : 1;
    }
    return values;
}

/* ---------------------------------------------------------------------- life of an instance */

const List *wasm_get_version(void) {
    List *version = (List *)take(sizeof *version);
    *version = (List){fmi3GetVersion(), strlen(fmi3GetVersion())};
    return version;
}

/* The bytes of a text without a character that is cut at its end: sentences have a greatest length. */
static size_t whole_length(const char *text) {
    const size_t length = strlen(text);
    size_t begin = length;
    while (begin > 0 && ((unsigned char)text[begin - 1] & 0xC0u) == 0x80u) {
        begin--;
    }
    if (begin == 0) {
        return 0;
    }
    const unsigned char lead = (unsigned char)text[begin - 1];
    const size_t wanted = lead < 0x80u ? 0 : lead < 0xE0u ? 1 : lead < 0xF0u ? 2 : 3;
    return length - begin == wanted ? length : begin - 1;
}

/* The importer's logger; the environment is the name of the instance. */
static void log_to_importer(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                            fmi3String message) {
    const char *name = (const char *)environment;
    wasm_log_message(name, strlen(name), status, category, strlen(category), message, whole_length(message));
}

/* A copy of an instance's name, which lives as long as the instance. */
static char *kept_name(const char *name, size_t length) {
    char *copy = (char *)malloc(length + 1);
    if (copy == NULL) {
        abort();
    }
    memcpy(copy, name, length);
    copy[length] = '\0';
    return copy;
}

static const Option *made(fmi3Instance instance, char *name) {
    Option *option = (Option *)take(sizeof *option);
    option->some = instance != NULL;
    option->instance = instance;
    if (instance == NULL) {
        free(name);
    }
    return option;
}

const Option *wasm_instantiate_co_simulation(const char *name, size_t name_length, const char *token,
                                             size_t token_length, const char *path, size_t path_length, int visible,
                                             int logging_on, int event_mode_used, int early_return_allowed,
                                             const fmi3ValueReference intermediate[], size_t n_intermediate) {
    char *kept = kept_name(name, name_length);
    (void)path; /* all data is compiled in */
    (void)path_length;
    return made(fmi3InstantiateCoSimulation(kept, text_of(token, token_length), "", visible != 0, logging_on != 0,
                                            event_mode_used != 0, early_return_allowed != 0, intermediate,
                                            n_intermediate, kept, log_to_importer, NULL),
                kept);
}

const Option *wasm_instantiate_model_exchange(const char *name, size_t name_length, const char *token,
                                              size_t token_length, const char *path, size_t path_length, int visible,
                                              int logging_on) {
    char *kept = kept_name(name, name_length);
    (void)path;
    (void)path_length;
    return made(fmi3InstantiateModelExchange(kept, text_of(token, token_length), "", visible != 0, logging_on != 0,
                                             kept, log_to_importer),
                kept);
}

void wasm_free_instance(fmi3Instance self) {
    void *name = ((Component *)self)->importer.environment;
    fmi3FreeInstance(self);
    free(name);
}

fmi3Status wasm_set_debug_logging(fmi3Instance self, int logging_on, const List categories[], size_t count) {
    const char **names = (const char **)take(count * sizeof *names);
    for (size_t i = 0; i < count; i++) {
        names[i] = text_of((const char *)categories[i].items, categories[i].count);
    }
    return fmi3SetDebugLogging(self, logging_on != 0, count, names);
}

fmi3Status wasm_enter_initialization_mode(fmi3Instance self, int tolerance_defined, double tolerance,
                                          double start_time, int stop_time_defined, double stop_time) {
    return fmi3EnterInitializationMode(self, tolerance_defined != 0, tolerance, start_time, stop_time_defined != 0,
                                       stop_time);
}

#define CHANGE_OF_MODE(name, Name)                    \
    fmi3Status wasm_##name(fmi3Instance self) {       \
        return fmi3##Name(self);                      \
    }

CHANGE_OF_MODE(exit_initialization_mode, ExitInitializationMode)
CHANGE_OF_MODE(enter_event_mode, EnterEventMode)
CHANGE_OF_MODE(terminate, Terminate)
CHANGE_OF_MODE(reset, Reset)
CHANGE_OF_MODE(enter_configuration_mode, EnterConfigurationMode)
CHANGE_OF_MODE(exit_configuration_mode, ExitConfigurationMode)
CHANGE_OF_MODE(evaluate_discrete_states, EvaluateDiscreteStates)
CHANGE_OF_MODE(enter_continuous_time_mode, EnterContinuousTimeMode)
CHANGE_OF_MODE(enter_step_mode, EnterStepMode)

const DiscreteResult *wasm_update_discrete_states(fmi3Instance self) {
    DiscreteResult *result = (DiscreteResult *)take(sizeof *result);
    bool needed, terminates, nominals, values, timed;
    double next;
    const fmi3Status status =
        fmi3UpdateDiscreteStates(self, &needed, &terminates, &nominals, &values, &timed, &next);
    result->failed = !succeeded(status);
    if (result->failed) {
        result->of.status = (uint8_t)status;
    } else {
        result->of.states = (DiscreteStates){needed, terminates, nominals, values, timed, next};
    }
    return result;
}

const StepResult *wasm_do_step(fmi3Instance self, double point, double step, int no_return) {
    StepResult *result = (StepResult *)take(sizeof *result);
    bool event, terminates, early;
    double last;
    const fmi3Status status = fmi3DoStep(self, point, step, no_return != 0, &event, &terminates, &early, &last);
    result->failed = !succeeded(status);
    if (result->failed) {
        result->of.status = (uint8_t)status;
    } else {
        result->of.step = (StepEnd){last, event, terminates, early};
    }
    return result;
}

/* ---------------------------------------------------------------------- variables */

#define VALUES(name, Name, Type)                                                                                 \
    const ListResult *wasm_get_##name(fmi3Instance self, const fmi3ValueReference references[], size_t count) {  \
        const size_t n = count_values(references, count);                                                        \
        Type *values = (Type *)take(n * sizeof *values);                                                         \
        return listed(fmi3Get##Name(self, references, count, values, n), values, n);                             \
    }                                                                                                            \
    fmi3Status wasm_set_##name(fmi3Instance self, const fmi3ValueReference references[], size_t count,           \
                               const Type values[], size_t n) {                                                  \
        return fmi3Set##Name(self, references, count, values, n);                                                \
    }

VALUES(float32, Float32, float)
VALUES(float64, Float64, double)
VALUES(int8, Int8, int8_t)
VALUES(int16, Int16, int16_t)
VALUES(int32, Int32, int32_t)
VALUES(int64, Int64, int64_t)
VALUES(uint8, UInt8, uint8_t)
VALUES(uint16, UInt16, uint16_t)
VALUES(uint32, UInt32, uint32_t)
VALUES(uint64, UInt64, uint64_t)
VALUES(boolean, Boolean, bool)

/* No variable is of type String or Binary, so that these lists are empty, or the call fails. */
const ListResult *wasm_get_string(fmi3Instance self, const fmi3ValueReference references[], size_t count) {
    return listed(fmi3GetString(self, references, count, NULL, count), NULL, 0);
}

const ListResult *wasm_get_binary(fmi3Instance self, const fmi3ValueReference references[], size_t count) {
    return listed(fmi3GetBinary(self, references, count, NULL, NULL, count), NULL, 0);
}

fmi3Status wasm_set_string(fmi3Instance self, const fmi3ValueReference references[], size_t count,
                           const List values[], size_t n) {
    (void)values;
    return fmi3SetString(self, references, count, NULL, n);
}

fmi3Status wasm_set_binary(fmi3Instance self, const fmi3ValueReference references[], size_t count,
                           const List values[], size_t n) {
    (void)values;
    return fmi3SetBinary(self, references, count, NULL, NULL, n);
}

const ListResult *wasm_get_clock(fmi3Instance self, const fmi3ValueReference references[], size_t count) {
    bool *values = (bool *)take(count * sizeof *values);
    return listed(fmi3GetClock(self, references, count, values), values, count);
}

fmi3Status wasm_set_clock(fmi3Instance self, const fmi3ValueReference references[], size_t count,
                          const bool values[], size_t n) {
    if (n != count) {
        return fail((Component *)self, "there are %u values for %u clocks", (unsigned)n, (unsigned)count);
    }
    return fmi3SetClock(self, references, count, values);
}

/* No clock has an interval or a shift, so that these lists are empty, or the call fails. */
#define NO_TIMES(name, Name, ...)                                                                                \
    const ListResult *wasm_get_##name(fmi3Instance self, const fmi3ValueReference references[], size_t count) {  \
        return listed(fmi3Get##Name(self, references, count, __VA_ARGS__), NULL, 0);                             \
    }
#define NO_TIMES_SET(name, Name, ...)                                                                            \
    fmi3Status wasm_set_##name(fmi3Instance self, const fmi3ValueReference references[], size_t count,           \
                               const void *times, size_t n) {                                                    \
        (void)times;                                                                                             \
        (void)n;                                                                                                 \
        return fmi3Set##Name(self, references, count, __VA_ARGS__);                                              \
    }

NO_TIMES(interval_decimal, IntervalDecimal, NULL, NULL)
NO_TIMES(interval_fraction, IntervalFraction, NULL, NULL, NULL)
NO_TIMES(shift_decimal, ShiftDecimal, NULL)
NO_TIMES(shift_fraction, ShiftFraction, NULL, NULL)
NO_TIMES_SET(interval_decimal, IntervalDecimal, NULL)
NO_TIMES_SET(interval_fraction, IntervalFraction, NULL, NULL)
NO_TIMES_SET(shift_decimal, ShiftDecimal, NULL)
NO_TIMES_SET(shift_fraction, ShiftFraction, NULL, NULL)

const CountResult *wasm_get_number_of_variable_dependencies(fmi3Instance self, fmi3ValueReference reference) {
    size_t count = 0;
    const fmi3Status status = fmi3GetNumberOfVariableDependencies(self, reference, &count);
    return counted(status, count);
}

const ListResult *wasm_get_variable_dependencies(fmi3Instance self, fmi3ValueReference dependent) {
    size_t count = 0;
    fmi3Status status = fmi3GetNumberOfVariableDependencies(self, dependent, &count);
    if (!succeeded(status)) {
        return listed(status, NULL, 0);
    }
    size_t *elements = (size_t *)take(2 * count * sizeof *elements);
    fmi3ValueReference *independents = (fmi3ValueReference *)take(count * sizeof *independents);
    fmi3DependencyKind *kinds = (fmi3DependencyKind *)take(count * sizeof *kinds);
    VariableDependency *found = (VariableDependency *)take(count * sizeof *found);
    status = fmi3GetVariableDependencies(self, dependent, elements, independents, elements + count, kinds, count);
    for (size_t i = 0; succeeded(status) && i < count; i++) {
        found[i] = (VariableDependency){dependent, (uint32_t)elements[i], independents[i],
                                        (uint32_t)elements[count + i], kinds[i] == fmi3Constant};
    }
    return listed(status, found, count);
}

/* ---------------------------------------------------------------------- states and derivatives */

const ListResult *wasm_get_fmu_state(fmi3Instance self) {
    fmi3FMUState state = NULL;
    size_t size = 0;
    void *bytes = NULL;
    fmi3Status status = fmi3GetFMUState(self, &state);
    if (succeeded(status)) {
        fmi3SerializedFMUStateSize(self, state, &size);
        bytes = take(size);
        status = fmi3SerializeFMUState(self, state, (fmi3Byte *)bytes, size);
        fmi3FreeFMUState(self, &state);
    }
    return listed(status, bytes, size);
}

fmi3Status wasm_set_fmu_state(fmi3Instance self, const fmi3Byte bytes[], size_t size) {
    fmi3FMUState state = NULL;
    fmi3Status status = fmi3DeserializeFMUState(self, bytes, size, &state);
    if (succeeded(status)) {
        status = fmi3SetFMUState(self, state);
        fmi3FreeFMUState(self, &state);
    }
    return status;
}

const ListResult *wasm_get_directional_derivative(fmi3Instance self, const fmi3ValueReference unknowns[],
                                                  size_t n_unknowns, const fmi3ValueReference knowns[],
                                                  size_t n_knowns, const double seed[], size_t n_seed) {
    const size_t n = count_values(unknowns, n_unknowns);
    double *values = (double *)take(n * sizeof *values);
    return listed(fmi3GetDirectionalDerivative(self, unknowns, n_unknowns, knowns, n_knowns, seed, n_seed, values, n),
                  values, n);
}

const ListResult *wasm_get_adjoint_derivative(fmi3Instance self, const fmi3ValueReference unknowns[],
                                              size_t n_unknowns, const fmi3ValueReference knowns[], size_t n_knowns,
                                              const double seed[], size_t n_seed) {
    const size_t n = count_values(knowns, n_knowns);
    double *values = (double *)take(n * sizeof *values);
    return listed(fmi3GetAdjointDerivative(self, unknowns, n_unknowns, knowns, n_knowns, seed, n_seed, values, n),
                  values, n);
}

const ListResult *wasm_get_output_derivatives(fmi3Instance self, const Request requests[], size_t count) {
    fmi3ValueReference *references = (fmi3ValueReference *)take(count * sizeof *references);
    fmi3Int32 *orders = (fmi3Int32 *)take(count * sizeof *orders);
    for (size_t i = 0; i < count; i++) {
        references[i] = requests[i].reference;
        orders[i] = requests[i].order > INT32_MAX ? INT32_MAX : (fmi3Int32)requests[i].order;
    }
    const size_t n = count_values(references, count);
    double *values = (double *)take(n * sizeof *values);
    return listed(fmi3GetOutputDerivatives(self, references, count, orders, values, n), values, n);
}

/* FMI 3.0 has no such function. */
fmi3Status wasm_set_input_derivatives(fmi3Instance self, const Request requests[], size_t count,
                                      const double values[], size_t n) {
    (void)requests;
    (void)values;
    (void)n;
    return count == 0 ? fmi3OK
                      : fail((Component *)self, "inputs have no derivatives in FMI 3.0; set inputs more often");
}

fmi3Status wasm_set_time(fmi3Instance self, double time) {
    return fmi3SetTime(self, time);
}

fmi3Status wasm_set_continuous_states(fmi3Instance self, const double states[], size_t count) {
    return fmi3SetContinuousStates(self, states, count);
}

#define VECTOR(name, Name, N)                                               \
    const ListResult *wasm_get_##name(fmi3Instance self) {                  \
        double *values = (double *)take((N) * sizeof *values);              \
        return listed(fmi3Get##Name(self, values, N), values, N);           \
    }

VECTOR(continuous_states, ContinuousStates, N_CONTINUOUS)
VECTOR(continuous_state_derivatives, ContinuousStateDerivatives, N_CONTINUOUS)
VECTOR(nominals_of_continuous_states, NominalsOfContinuousStates, N_CONTINUOUS)
VECTOR(event_indicators, EventIndicators, N_EVENTS)

const CountResult *wasm_get_number_of_event_indicators(fmi3Instance self) {
    size_t count = 0;
    const fmi3Status status = fmi3GetNumberOfEventIndicators(self, &count);
    return counted(status, count);
}

const CountResult *wasm_get_number_of_continuous_states(fmi3Instance self) {
    size_t count = 0;
    const fmi3Status status = fmi3GetNumberOfContinuousStates(self, &count);
    return counted(status, count);
}

const CompletedResult *wasm_completed_integrator_step(fmi3Instance self, int no_return) {
    CompletedResult *result = (CompletedResult *)take(sizeof *result);
    bool event, terminates;
    const fmi3Status status = fmi3CompletedIntegratorStep(self, no_return != 0, &event, &terminates);
    result->failed = !succeeded(status);
    if (result->failed) {
        result->of.status = (uint8_t)status;
    } else {
        result->of.completed = (CompletedStep){event, terminates};
    }
    return result;
}
