/* The arguments are evaluated by generated code. */
#include "tables.h"

bool tables_explain(Instance *instance, double time, const double states[], const double inputs[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, arguments, N_ARGUMENTS);
    mechanism_arguments(time, states, inputs, instance->state.parameters, arguments);
    for (int k = 0; k < N_ARGUMENTS; k++) {
        if (arguments[k] < ARGUMENTS[k].least || arguments[k] > ARGUMENTS[k].greatest) {
            instance->failure.kind = FAILURE_TABLE;
            instance->failure.time = time;
            instance->failure.state = k;
            instance->failure.amount = arguments[k];
            return arena_leave(mark, true);
        }
    }
    return arena_leave(mark, false);
}
