#include "repetition.h"

void repetition_proceed(Repetition *last, const double answer[], bool slow, double x[]) {
    double square = 0.0, product = 0.0;
    for (int k = 0; k < K; k++) {
        const double rest = answer[k] - x[k], change = rest - last->rest[k];
        square += change * change;
        product += change * rest;
    }
    const double part = slow && square > 0.0 ? product / square : 0.0;
    for (int k = 0; k < K; k++) {
        const double before = last->x[k] + last->rest[k];
        last->x[k] = x[k];
        last->rest[k] = answer[k] - x[k];
        x[k] = answer[k] - part * (answer[k] - before);
    }
}
