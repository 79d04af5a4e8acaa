#include "names.h"

#include "mechanism.h"

const char *variable_name(VariableKind kind, int index) {
    for (int i = 0; i < N_VARIABLES; i++) {
        if (VARIABLES[i].kind == kind && VARIABLES[i].index == index) {
            return VARIABLES[i].name;
        }
    }
    return "?";
}

const char *state_name(int index) {
    const char *name = variable_name(VARIABLE_STATE, index);
    return name[0] != '?' ? name : variable_name(VARIABLE_MASSLESS, index);
}
