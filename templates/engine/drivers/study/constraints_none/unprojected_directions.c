/* A mechanism without constraints: nothing is projected. */
#include "directions.h"

bool directions_project(Variations *variations, double time, const double from[], const double to[]) {
    (void)variations;
    (void)time;
    (void)from;
    (void)to;
    return true;
}
