/* Arguments that leave the tables which have no value outside; tables_none.c is for mechanisms without such tables. */
#ifndef TABLES_H
#define TABLES_H

#include "instance.h"

/* Where the equations have no finite value: is an argument outside its table at this time (s), states and inputs? Then
   sets instance->failure to it and returns true. */
bool tables_explain(Instance *instance, double time, const double states[], const double inputs[]);

#endif
