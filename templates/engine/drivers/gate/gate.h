/* The gate that every function of the standard passes. */
#ifndef GATE_H
#define GATE_H

#include "component.h"

/* Brings a component to the mode "instantiated" with all start values; both instantiation and reset do this. */
void component_start(Component *component);

/* The start of every function: the component behind the importer's handle if the call is legal now, else NULL after the
   error was reported. */
Component *enter(void *handle, Call call);

/* The same for functions that read or change the present point: it is brought up to date first. In the error state the
   call goes on even if that fails, so that the importer can look for what went wrong. */
Component *enter_present(void *handle, Call call);

/* As enter(), for a function that writes to an address, called what in sentences: it must not be NULL. */
Component *enter_with(void *handle, Call call, const void *address, const char *what);

#endif
