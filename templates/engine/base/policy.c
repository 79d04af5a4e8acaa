#include "policy.h"

const Policy OWN_SOLVER = {.integrate = true, .stabilise = false, .remember = false, .project = true};
const Policy IMPORTERS_SOLVER = {.integrate = false, .stabilise = true, .remember = true, .project = false};
