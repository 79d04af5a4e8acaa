/* Calls with right and wrong arguments: the life of an instance, its states, its solver. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "session.h"

static Outcome outcome(fmi2Status status, unsigned allowed) {
    const Outcome result = {status, allowed};
    return result;
}

/* A call without arguments that leads to another state if it may. */
static Outcome transition(Session *s, fmi2Status (*call)(fmi2Component), char mode, unsigned allowed) {
    const fmi2Status status = call(s->component);
    if (status == fmi2OK) {
        s->model.mode = mode;
    }
    return outcome(status, allowed);
}

Outcome try_EnterInitializationMode(Session *s) { return transition(s, s->fmu->EnterInitializationMode, 'z', OK); }
Outcome try_ExitInitializationMode(Session *s) {
    return transition(s, s->fmu->ExitInitializationMode, s->type == fmi2ModelExchange ? 'e' : 's', calculation(s));
}
Outcome try_Terminate(Session *s) { return transition(s, s->fmu->Terminate, 't', OK); }
Outcome try_EnterEventMode(Session *s) { return transition(s, s->fmu->EnterEventMode, 'e', OK); }
Outcome try_EnterContinuousTimeMode(Session *s) { return transition(s, s->fmu->EnterContinuousTimeMode, 'c', OK); }
Outcome try_CancelStep(Session *s) { return transition(s, s->fmu->CancelStep, 's', REFUSED); }

Outcome try_Reset(Session *s) {
    static fmi2Byte bytes[MAX_BYTES];
    const Outcome result = transition(s, s->fmu->Reset, 'i', OK);
    if (result.status == fmi2OK) {
        const size_t size = serialize(s->fmu, s->component, bytes);
        expect(memcmp(bytes, s->fresh, size) == 0, "after fmi2Reset the instance is not as a new one");
        s->model.wild = 0;
        s->model.time = 0.0;
        s->model.stop = INFINITY;
        s->logging = 1;
    }
    return result;
}

Outcome try_SetupExperiment(Session *s) {
    double tolerance = 1e-6, first = 0.01 * below(s, 3), stop = first + 0.3;
    const unsigned fault = mistake(s, 4);
    const fmi2Boolean end = fault < 4 || below(s, 2) == 0 ? fmi2True : fmi2False;
    switch (fault) {
    case 0: tolerance = 0.0 * below(s, 2) - 1e-9 * below(s, 2); break;
    case 1: tolerance = not_finite(s); break;
    case 2: first = not_finite(s); break;
    case 3: stop = first - 1.0; break;
    default: break;
    }
    const fmi2Status status = s->fmu->SetupExperiment(s->component, fmi2True, tolerance, first, end, stop);
    if (status == fmi2OK) {
        s->model.time = first;
        s->model.stop = end ? stop : INFINITY;
    }
    return outcome(status, fault < 4 ? REFUSED : OK);
}

Outcome try_SetDebugLogging(Session *s) {
    static const fmi2String ALL[] = {"logStatusWarning", "logStatusDiscard", "logStatusError", "logAll",
                                     "logSingularLinearSystems"};
    static const fmi2String UNKNOWN[] = {"logStatusWarning", "logStatusDiscard", "logWeather", "logStatusError",
                                         "logSingularLinearSystems"};
    static const fmi2String HOLE[] = {"logAll", NULL};
    fmi2Status status;
    switch (mistake(s, 3)) {
    case 0: return outcome(s->fmu->SetDebugLogging(s->component, fmi2True, 3, NULL), REFUSED);
    case 1: return outcome(s->fmu->SetDebugLogging(s->component, fmi2True, 2, HOLE), REFUSED);
    case 2:
        status = s->fmu->SetDebugLogging(s->component, fmi2True, 5, UNKNOWN);
        s->logging = status == fmi2Warning ? 1 : s->logging;
        return outcome(status, WARNED);
    default: break;
    }
    const int on = below(s, 4) != 0;
    status = s->fmu->SetDebugLogging(s->component, on ? fmi2True : fmi2False, on && below(s, 2) ? 5 : 0, ALL);
    s->logging = status == fmi2OK ? on : s->logging;
    return outcome(status, OK);
}

/* ------------------------------------------------------------------------------------------------------- saved
   states */

Outcome try_GetFMUstate(Session *s) {
    if (mistake(s, 1) == 0) {
        return outcome(s->fmu->GetFMUstate(s->component, NULL), REFUSED);
    }
    const fmi2FMUstate before = s->slot;
    const fmi2Status status = s->fmu->GetFMUstate(s->component, &s->slot);
    if (status == fmi2OK) {
        expect(s->slot != NULL && (before == NULL || s->slot == before), "the block was not used again");
        s->slot_model = s->model;
    }
    return outcome(status, calculation(s));
}

Outcome try_SetFMUstate(Session *s) {
    if (mistake(s, 1) == 0) { /* memory that is no state */
        void *zeros = calloc(1, MAX_BYTES);
        const fmi2Status status = s->fmu->SetFMUstate(s->component, zeros);
        free(zeros);
        return outcome(status, REFUSED);
    }
    const fmi2Status status = s->fmu->SetFMUstate(s->component, s->slot);
    if (status == fmi2OK) {
        s->model = s->slot_model;
    }
    return outcome(status, s->slot == NULL ? REFUSED : OK);
}

Outcome try_FreeFMUstate(Session *s) {
    if (below(s, 4) == 0) {
        return outcome(s->fmu->FreeFMUstate(s->component, NULL), OK);
    }
    const fmi2Status status = s->fmu->FreeFMUstate(s->component, &s->slot);
    expect(status != fmi2OK || s->slot == NULL, "the pointer to a freed state is kept");
    return outcome(status, OK);
}

Outcome try_SerializedFMUstateSize(Session *s) {
    size_t size = 0;
    const int fault = mistake(s, 1) == 0;
    const fmi2Status status = s->fmu->SerializedFMUstateSize(s->component, s->slot, fault ? NULL : &size);
    expect(status != fmi2OK || (size > 0 && size <= MAX_BYTES), "a state has %u bytes", (unsigned)size);
    return outcome(status, fault || s->slot == NULL ? REFUSED : OK);
}

Outcome try_SerializeFMUstate(Session *s) {
    size_t size = s->foreign_size;
    const unsigned fault = mistake(s, 2);
    if (fault == 0) {
        return outcome(s->fmu->SerializeFMUstate(s->component, s->slot, NULL, size), REFUSED);
    }
    size -= fault == 1 ? 1 + below(s, (unsigned)size - 1) : 0;
    fmi2Byte *bytes = malloc(size); /* of just the size, so that a sanitizer sees what is written behind it */
    const fmi2Status status = s->fmu->SerializeFMUstate(s->component, s->slot, bytes, size);
    if (status == fmi2OK) {
        memcpy(s->bytes, bytes, size);
        s->size = size;
        s->bytes_model = s->slot_model;
    }
    free(bytes);
    return outcome(status, fault == 1 || s->slot == NULL ? REFUSED : OK);
}

Outcome try_DeSerializeFMUstate(Session *s) {
    fmi2FMUstate state = NULL;
    size_t size = s->size > 0 ? s->size : s->foreign_size;
    const unsigned fault = mistake(s, 4);
    if (fault == 0) {
        return outcome(s->fmu->DeSerializeFMUstate(s->component, below(s, 2) ? s->bytes : NULL, size, NULL), REFUSED);
    }
    fmi2Byte *bytes = malloc(size);
    memcpy(bytes, s->size == 0 || fault == 1 ? s->foreign : s->bytes, size);
    if (fault == 2) {
        bytes[below(s, (unsigned)size)] ^= (fmi2Byte)(1u << below(s, 7));
    }
    size -= fault == 3 ? 1 + below(s, (unsigned)size) : 0;
    const fmi2Status status = s->fmu->DeSerializeFMUstate(s->component, bytes, size, &state);
    free(bytes);
    if (status == fmi2OK) {
        expect(s->fmu->FreeFMUstate(s->component, &s->slot) == fmi2OK, "the old state cannot be freed");
        s->slot = state;
        s->slot_model = s->bytes_model;
    }
    return outcome(status, s->size == 0 || fault < 4 ? REFUSED : OK);
}

/* --------------------------------------------------------------------------------------------------------------
   steps */

Outcome try_DoStep(Session *s) {
    double time = s->model.time + between(s, -1e-6, 1e-6), step = 0.01;
    const unsigned fault = mistake(s, 5);
    switch (fault) {
    case 0: step = -0.01; break;
    case 1: step = 0.0; break;
    case 2: step = not_finite(s); break;
    case 3: time = not_finite(s); break;
    case 4: time += 0.005; break;
    default: break;
    }
    const unsigned done = OK | WARNED; /* of a motion that is stiff, for example */
    const unsigned in_time = time + step > s->model.stop + 1e-3   ? REFUSED
                             : time + step > s->model.stop - 1e-12 ? done | REFUSED /* to rounding and jitter, both do */
                                                                   : done;
    const fmi2Status status = s->fmu->DoStep(s->component, time, step, below(s, 2) ? fmi2True : fmi2False);
    if (status == fmi2OK || status == fmi2Warning) {
        s->model.time = time + step;
    } else if (status == fmi2Discard) {
        fmi2Boolean terminated = fmi2False;
        s->model.mode = 'f';
        expect(s->fmu->GetRealStatus(s->component, fmi2LastSuccessfulTime, &s->model.time) == fmi2OK, "no last time");
        expect(s->fmu->GetBooleanStatus(s->component, fmi2Terminated, &terminated) == fmi2OK, "ended, or not?");
        expect(s->model.time >= time - 1e-5 && s->model.time < time + step, "last time %g", s->model.time);
    }
    return outcome(status, fault < 5 ? REFUSED : s->model.wild ? in_time | DISCARDED : in_time);
}

#define STATUS(name, type, kind)                                                                       \
    Outcome try_##name(Session *s) {                                                                   \
        type value;                                                                                    \
        const fmi2StatusKind asked = (fmi2StatusKind)below(s, 4);                                      \
        if (mistake(s, 1) == 0) {                                                                      \
            return outcome(s->fmu->name(s->component, asked, NULL), REFUSED);                          \
        }                                                                                              \
        return outcome(s->fmu->name(s->component, asked, &value), (int)asked == (kind) ? OK : DISCARDED);   \
    }
enum { NEVER = 99 }; /* these ask what only asynchronous FMUs know */
STATUS(GetStatus, fmi2Status, NEVER)
STATUS(GetIntegerStatus, fmi2Integer, NEVER)
STATUS(GetStringStatus, fmi2String, NEVER)
STATUS(GetRealStatus, fmi2Real, fmi2LastSuccessfulTime)
STATUS(GetBooleanStatus, fmi2Boolean, fmi2Terminated)

Outcome try_NewDiscreteStates(Session *s) {
    fmi2EventInfo info;
    if (mistake(s, 1) == 0) {
        return outcome(s->fmu->NewDiscreteStates(s->component, NULL), REFUSED);
    }
    const fmi2Status status = s->fmu->NewDiscreteStates(s->component, &info);
    expect(status != fmi2OK || !info.newDiscreteStatesNeeded, "events without end");
    return outcome(status, calculation(s));
}

Outcome try_CompletedIntegratorStep(Session *s) {
    fmi2Boolean event, end;
    const unsigned fault = mistake(s, 2);
    const fmi2Status status = s->fmu->CompletedIntegratorStep(s->component, fmi2True, fault == 0 ? NULL : &event,
                                                              fault == 1 ? NULL : &end);
    return outcome(status, fault < 2 ? REFUSED : OK);
}

Outcome try_SetTime(Session *s) {
    const int fault = mistake(s, 1) == 0;
    const double time = fault ? not_finite(s) : s->model.time + 0.01;
    const fmi2Status status = s->fmu->SetTime(s->component, time);
    if (status == fmi2OK) {
        s->model.time = time;
    }
    return outcome(status, fault ? REFUSED : OK);
}
