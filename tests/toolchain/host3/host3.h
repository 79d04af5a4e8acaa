/* What the host does with the FMU that it is compiled or linked with; each action ends the program with exit status 1
   and a message if something is not as expected. */
#ifndef HOST3_H
#define HOST3_H

#include "random_calls3.h"

/* Random calls of both types of instances; prints how often each function was called in each state. */
void random_calls(int count, unsigned long long seed);

/* Instances that are made, moved over events, saved, restored, reset and freed. */
void cycles(int count);

/* Prints how an instance moves: the states after each communication step and at each event, then derivatives. */
void move(void);

/* Saves the state of that instance half way; goes on from there, and prints the rest of its steps. */
void save(const char *path);
void go_on(const char *path);

/* Instances in threads of their own move like instances that are alone. Where there are threads. */
void threads(int count);

/* An instance that is driven in co-simulation with event mode, early return and intermediate updates, or in model
   exchange. */
typedef struct {
    fmi3Instance instance;
    int co_simulation, variant; /* its inputs depend on the variant */
    int updates;                /* intermediate updates */
    char text[512];             /* of the last message */
} Unit;

void start(Unit *unit, int co_simulation, int variant);

/* From one point in time to the next (s); a co-simulation that ends early is settled, and goes on. told: NULL, or what
   is done where an event is met, before it is settled. */
void advance(Unit *unit, double from, double to, void (*told)(Unit *unit));

/* The serialized state; returns its size. */
size_t bytes_of(Unit *unit, fmi3Byte bytes[]);

#endif
