/* What is noticed along a run, in words. */
#ifndef NOTICE_SENTENCE_H
#define NOTICE_SENTENCE_H

#include <stddef.h>

#include "instance.h"

/* Writes one sentence to text[size] on a notice that is not NOTICE_NONE: what was noticed, when, and what to do. */
void notice_sentence(const Notice *notice, char text[], size_t size);

#endif
