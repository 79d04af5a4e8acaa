/* A mechanism whose equations of motion are smooth throughout. */
#include "directions.h"

bool directions_due(Variations *variations) {
    (void)variations;
    return false;
}

bool directions_pass(Variations *variations) {
    (void)variations;
    return true;
}

bool directions_start(Variations *variations) {
    return directions_stand(variations, &variations->study.instance) && study_settle(&variations->study);
}
