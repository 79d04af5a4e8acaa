/* Intermediate updates of co-simulation (FMI 3.0, section 4.2.2). */
#ifndef INTERMEDIATE_UPDATE_H
#define INTERMEDIATE_UPDATE_H

#include "gate.h"

/* Takes note of the variables that the importer announces for intermediate updates; returns false, with the reason
   logged, if one does not exist. */
bool announce_intermediate(Importer *importer, const char *name, const fmi3ValueReference references[], size_t count);

/* Lets the importer follow communication steps: each end of a solver step is an intermediate update in which outputs
   can be read and an early return requested. */
void offer_updates(Component *component);

/* If the importer announced inputs: asks for them within the communication step of this length (s) that begins. They
   are set to the cubic polynomial of time through what it sets. Returns false after an error of the importer. */
bool ask_for_inputs(Component *component, double length);

#endif
