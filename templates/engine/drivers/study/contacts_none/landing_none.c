/* A mechanism in which nothing touches. */
#include "directions.h"

bool directions_land(Variations *variations) {
    return directions_stand(variations, &variations->study.instance);
}
