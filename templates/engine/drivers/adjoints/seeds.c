#include "seeds.h"

static void add_to(double sum[], const double term[], int count) {
    for (int i = 0; i < count; i++) {
        sum[i] += term[i];
    }
}

void seed_add(Seed *sum, const Seed *term) {
    sum->time += term->time;
    add_to(sum->states, term->states, N_STATES);
    add_to(sum->inputs, term->inputs, N_SIGNALS);
    add_to(sum->parameters, term->parameters, SIZE_PARAMETERS);
}
