/* A mechanism without contacts, stops and dry friction. */
#include "adjoint_parts.h"

void contacts_answer_adjoint(Instance *instance, double unknowns[], Seed *sensitivity) {
    (void)instance;
    (void)unknowns;
    (void)sensitivity;
}

void contacts_rub_adjoint(const Instance *instance, const double weights[], double unknowns[], Seed *sensitivity) {
    (void)instance;
    (void)weights;
    (void)unknowns;
    (void)sensitivity;
}
