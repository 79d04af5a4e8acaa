/* A mechanism without constraints: nothing is projected. */
#include "tape.h"

bool tape_project_back(Tape *tape, double time, const double point[], double states[]) {
    (void)tape;
    (void)time;
    (void)point;
    (void)states;
    return true;
}
