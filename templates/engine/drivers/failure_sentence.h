/* Why an evaluation or a solver step failed, in words. */
#ifndef FAILURE_SENTENCE_H
#define FAILURE_SENTENCE_H

#include <stddef.h>

#include "instance.h"

/* Writes one sentence to text[size] that says what failed, at which time, for which coordinate or state, and what to
   do; a longer one is cut. */
void failure_sentence(const Failure *failure, char text[], size_t size);

#endif
