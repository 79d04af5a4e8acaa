/* The tables of FMI 2.0, and messages to its logger. */
#include "version.h"

#include <stddef.h>

#define CALL_ROW(name, model_exchange, co_simulation) {"fmi2" #name, model_exchange, co_simulation},
const CallRow CALLS[N_CALLS] = {FMI2_CALLS(CALL_ROW)};
#undef CALL_ROW

/* What fmi2SetReal may set. An o stands for a habit of importers: fmpy sets inputs before initialization, CasADi sets
   parameters in continuous-time mode. States are settable in continuous-time mode since FMI 2.0.1. */
const CallRow SETTABLE[N_VARIABLE_KINDS] = {
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
    [VARIABLE_ESTIMATE]     = {"estimate",     "x x x x . .",   "x x . . . ."},
    [VARIABLE_SAMPLE]       = {"sample",       "o x x x . .",   "o x x . . ."},
    [VARIABLE_TUNING]       = {"tuning",       "x x x o . .",   "x x x . . ."},
    [VARIABLE_FIXED_TUNING] = {"tuning",       "x x . . . .",   "x x . . . ."},
    [VARIABLE_BELIEF]       = {"belief",       ". . . . . .",   ". . . . . ."},
};

const ModeColumns MODE_COLUMNS[N_MODES] = {
    [MODE_INSTANTIATED]    = {"instantiated",         0,  0},
    [MODE_INITIALIZATION]  = {"initialization mode",  1,  1},
    [MODE_EVENT]           = {"event mode",           2, -1},
    [MODE_CONTINUOUS_TIME] = {"continuous-time mode", 3, -1},
    [MODE_STEP_COMPLETE]   = {"step complete",       -1,  2},
    [MODE_STEP_FAILED]     = {"step failed",         -1,  3},
    [MODE_TERMINATED]      = {"terminated",           4,  4},
    [MODE_ERROR]           = {"error",                5,  5},
};

void deliver(const Importer *importer, const char *name, Status status, const char *category, const char *text) {
    if (importer->logger != NULL) {
        importer->logger(importer->componentEnvironment, name, status, category, text);
    }
}
