/* The gate that every fmi2 function passes. */
#ifndef GATE_H
#define GATE_H

#include "component.h"

/* Brings a component to the mode "instantiated" with all start values; both fmi2Instantiate and fmi2Reset do this. */
void component_start(Component *component);

/* The start of every fmi2 function: the component if the call is legal now, else NULL after the error was reported. */
Component *enter(fmi2Component c, Call call);

/* The same for functions that read or change the present point: it is brought up to date first. In the error state the
   call goes on even if that fails, so that the importer can look for what went wrong. */
Component *enter_present(fmi2Component c, Call call);

#endif
