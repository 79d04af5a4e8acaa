/* What an importer may change between steps, as the memory of a method sees it. */
#ifndef CHANGES_H
#define CHANGES_H

typedef enum {
    CHANGED_STATE, /* a coordinate, a velocity, a further state, a parameter; or an event did so */
    CHANGED_INPUT, /* an input that is no motion */
    CHANGED_MOTION /* the position, velocity or acceleration of a prescribed motion */
} Change;

#endif
