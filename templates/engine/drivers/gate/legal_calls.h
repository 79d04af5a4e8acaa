/* Which function may be called when: look-up in the tables of the version. */
#ifndef LEGAL_CALLS_H
#define LEGAL_CALLS_H

#include <stddef.h>

#include "version.h"

/* May this function be called for an instance of this type in this mode? */
Verdict legal_call(Call call, InterfaceType type, Mode mode);

/* May a variable of this kind be set in this mode? */
Verdict legal_set(VariableKind kind, InterfaceType type, Mode mode);

/* Can a variable of this kind be set in any mode at all? */
int ever_settable(VariableKind kind, InterfaceType type);

/* "fmi...Reset" */
const char *call_name(Call call);

/* "initialization mode" */
const char *mode_name(Mode mode);

/* "model exchange" */
const char *type_name(InterfaceType type);

/* Writes the modes where the call is legal as "event mode, continuous-time mode"; empty if there are none. */
void legal_modes(Call call, InterfaceType type, char text[], size_t size);

#endif
