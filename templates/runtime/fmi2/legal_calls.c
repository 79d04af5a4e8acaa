/* Reading the tables of legal calls; the rows of the functions are in legal_calls.h. */
#include "legal_calls.h"

#include <stdio.h>
#include <string.h>

/* A row of either table: a character for each mode, at even positions, for the two types of instance. */
typedef struct {
    const char *name;
    const char *model_exchange;
    const char *co_simulation;
} Row;

#define CALL_ROW(name, model_exchange, co_simulation) {"fmi2" #name, model_exchange, co_simulation},
static const Row CALLS[N_CALLS] = {FMI2_CALLS(CALL_ROW)};
#undef CALL_ROW

/* What fmi2SetReal may set. An o stands for a habit of importers: fmpy sets inputs before initialization, CasADi sets
   parameters in continuous-time mode. States are settable in continuous-time mode since FMI 2.0.1. */
static const Row SETTABLE[N_VARIABLE_KINDS] = {
    /*                                         model exchange   co-simulation
                                               i z e c t x      i z s f t x  */
    [VARIABLE_TIME]         = {"time",         ". . . . . .",   ". . . . . ."},
    [VARIABLE_STATE]        = {"state",        "x x x x . .",   "x x . . . ."},
    [VARIABLE_MASSLESS]     = {"output",       "x x . . . .",   "x x . . . ."},
    [VARIABLE_ACCELERATION] = {"acceleration", ". . . . . .",   ". . . . . ."},
    [VARIABLE_FURTHER_RATE] = {"derivative",   ". . . . . .",   ". . . . . ."},
    [VARIABLE_MULTIPLIER]   = {"multiplier",   ". . . . . .",   ". . . . . ."},
    [VARIABLE_INPUT]        = {"input",        "o x x x . .",   "o x x . . ."},
    [VARIABLE_PARAMETER]    = {"parameter",    "x x x o . .",   "x x x . . ."},
    [VARIABLE_FIXED_PARAMETER] = {"parameter", "x x . . . .",   "x x . . . ."},
    [VARIABLE_SETTING]      = {"setting",      "x x . . . .",   "x x . . . ."},
    [VARIABLE_DEPENDENT]    = {"dependent",    ". . . . . .",   ". . . . . ."},
    [VARIABLE_LOCAL]        = {"local",        ". . . . . .",   ". . . . . ."},
    [VARIABLE_MODE]         = {"mode",         ". . . . . .",   ". . . . . ."},
    [VARIABLE_IMPACTS]      = {"impacts",      ". . . . . .",   ". . . . . ."},
    [VARIABLE_IMPULSE]      = {"impulse",      ". . . . . .",   ". . . . . ."},
    [VARIABLE_INDICATOR]    = {"indicator",    ". . . . . .",   ". . . . . ."},
    [VARIABLE_CLOCK]        = {"clock",        ". . . . . .",   ". . . . . ."},
};

/* The modes' names and their columns in the tables, one for each type of instance; -1 where the type has no
   such mode. */
static const struct {
    const char *name;
    int model_exchange, co_simulation;
} MODES[N_MODES] = {
    [MODE_INSTANTIATED]    = {"instantiated",         0,  0},
    [MODE_INITIALIZATION]  = {"initialization mode",  1,  1},
    [MODE_EVENT]           = {"event mode",           2, -1},
    [MODE_CONTINUOUS_TIME] = {"continuous-time mode", 3, -1},
    [MODE_STEP_COMPLETE]   = {"step complete",       -1,  2},
    [MODE_STEP_FAILED]     = {"step failed",         -1,  3},
    [MODE_TERMINATED]      = {"terminated",           4,  4},
    [MODE_ERROR]           = {"error",                5,  5},
};

/* The character of a row for a type of instance and a mode. */
static Verdict look_up(const Row *row, fmi2Type type, Mode mode) {
    const int column = type == fmi2ModelExchange ? MODES[mode].model_exchange : MODES[mode].co_simulation;
    const char *text = type == fmi2ModelExchange ? row->model_exchange : row->co_simulation;
    return column < 0 ? VERDICT_ILLEGAL : (Verdict)text[2 * column];
}

Verdict legal_call(Call call, fmi2Type type, Mode mode) {
    return look_up(&CALLS[call], type, mode);
}

Verdict legal_set(VariableKind kind, fmi2Type type, Mode mode) {
    return look_up(&SETTABLE[kind], type, mode);
}

int ever_settable(VariableKind kind, fmi2Type type) {
    const Row *row = &SETTABLE[kind];
    return strchr(type == fmi2ModelExchange ? row->model_exchange : row->co_simulation, VERDICT_LEGAL) != NULL;
}

const char *call_name(Call call) {
    return CALLS[call].name;
}

const char *mode_name(Mode mode) {
    return MODES[mode].name;
}

void legal_modes(Call call, fmi2Type type, char text[], size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int mode = 0; mode < N_MODES; mode++) {
        if (legal_call(call, type, (Mode)mode) != VERDICT_LEGAL || used >= size) {
            continue;
        }
        const int written = snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", MODES[mode].name);
        used += written > 0 ? (size_t)written : 0;
    }
}
