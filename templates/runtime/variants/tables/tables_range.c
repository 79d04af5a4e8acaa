/* The arguments are evaluated by generated code. */
#include <stdio.h>

#include "tables.h"

bool tables_explain(Instance *instance, double time, const double states[], const double inputs[]) {
    double arguments[N_ARGUMENTS];
    mechanism_arguments(time, states, inputs, instance->state.parameters, arguments);
    for (int k = 0; k < N_ARGUMENTS; k++) {
        if (arguments[k] < ARGUMENTS[k].least || arguments[k] > ARGUMENTS[k].greatest) {
            instance->failure.kind = FAILURE_TABLE;
            instance->failure.time = time;
            instance->failure.state = k;
            instance->failure.amount = arguments[k];
            return true;
        }
    }
    return false;
}

void tables_sentence(const Failure *failure, char text[], size_t size) {
    const TableArgument *argument = &ARGUMENTS[failure->state];
    snprintf(text, size, "at time %.17g argument %d of the table %s is %.9g, outside its data from %.9g to %.9g (SI); "
             "extend the table, or set outside = \"hold\" or \"extrapolate\"", failure->time, argument->position,
             argument->table, failure->amount, argument->least, argument->greatest);
}
