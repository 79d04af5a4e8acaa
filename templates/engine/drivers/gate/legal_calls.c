#include "legal_calls.h"

#include <stdio.h>
#include <string.h>

/* The character of a row for a type of instance and a mode. */
static Verdict look_up(const CallRow *row, InterfaceType type, Mode mode) {
    const int column = type == MODEL_EXCHANGE ? MODE_COLUMNS[mode].model_exchange : MODE_COLUMNS[mode].co_simulation;
    const char *text = type == MODEL_EXCHANGE ? row->model_exchange : row->co_simulation;
    return column < 0 ? VERDICT_ILLEGAL : (Verdict)text[2 * column];
}

Verdict legal_call(Call call, InterfaceType type, Mode mode) {
    return look_up(&CALLS[call], type, mode);
}

Verdict legal_set(VariableKind kind, InterfaceType type, Mode mode) {
    return look_up(&SETTABLE[kind], type, mode);
}

int ever_settable(VariableKind kind, InterfaceType type) {
    const CallRow *row = &SETTABLE[kind];
    return strchr(type == MODEL_EXCHANGE ? row->model_exchange : row->co_simulation, VERDICT_LEGAL) != NULL;
}

const char *call_name(Call call) {
    return CALLS[call].name;
}

const char *mode_name(Mode mode) {
    return MODE_COLUMNS[mode].name;
}

const char *type_name(InterfaceType type) {
    return type == MODEL_EXCHANGE ? "model exchange" : "co-simulation";
}

void legal_modes(Call call, InterfaceType type, char text[], size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (int mode = 0; mode < N_MODES; mode++) {
        if (legal_call(call, type, (Mode)mode) != VERDICT_LEGAL || used >= size) {
            continue;
        }
        const int written = snprintf(text + used, size - used, "%s%s", used > 0 ? ", " : "", MODE_COLUMNS[mode].name);
        used += written > 0 ? (size_t)written : 0;
    }
}
