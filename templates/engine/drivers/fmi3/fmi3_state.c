/* fmi3GetFMUState and its relatives (FMI 3.0, section 2.2.6.4). */
#include "saved_state.h"

/* A state that is saved in an intermediate update is one of step mode. */
fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    Component *component = (Component *)instance;
    const bool intermediate = component != NULL && component->session.mode == MODE_INTERMEDIATE_UPDATE;
    if (intermediate) {
        set_mode(component, MODE_STEP);
    }
    const fmi3Status status = get_state(component, CALL_GetFMUState, FMUState);
    if (intermediate && component->session.mode == MODE_STEP) {
        set_mode(component, MODE_INTERMEDIATE_UPDATE);
    }
    return status;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return set_state(instance, CALL_SetFMUState, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return free_state(instance, CALL_FreeFMUState, FMUState);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return state_size(instance, CALL_SerializedFMUStateSize, FMUState, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    return serialize_state(instance, CALL_SerializeFMUState, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    return deserialize_state(instance, CALL_DeserializeFMUState, serializedState, size, FMUState);
}
