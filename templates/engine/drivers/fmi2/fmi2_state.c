/* fmi2GetFMUstate and its relatives (FMI 2.0, section 2.1.8). */
#include "saved_state.h"

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return get_state(c, CALL_GetFMUstate, FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    return set_state(c, CALL_SetFMUstate, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return free_state(c, CALL_FreeFMUstate, FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    return state_size(c, CALL_SerializedFMUstateSize, FMUstate, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    return serialize_state(c, CALL_SerializeFMUstate, FMUstate, serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    return deserialize_state(c, CALL_DeSerializeFMUstate, serializedState, size, FMUstate);
}
