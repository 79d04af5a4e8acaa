#include "seeds.h"

static void add(double sum[], const double term[], int count) {
    for (int i = 0; i < count; i++) {
        sum[i] += term[i];
    }
}

void seed_add(Seed *sum, const Seed *term) {
    sum->time += term->time;
    add(sum->states, term->states, N_STATES);
    add(sum->inputs, term->inputs, N_SIGNALS);
    add(sum->parameters, term->parameters, SIZE_PARAMETERS);
}
