#include "newton_step.h"

bool newton_many(Newton *newton) {
    (void)newton;
    return false;
}
