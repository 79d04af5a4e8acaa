#include "policy.h"

const Policy OWN_SOLVER = {.stabilise = false, .remember = false, .project = true};
const Policy IMPORTERS_SOLVER = {.stabilise = true, .remember = true, .project = false};
