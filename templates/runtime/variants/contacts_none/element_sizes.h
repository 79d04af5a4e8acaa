/* A mechanism without contacts, stops and dry friction; an array has one entry at least. */
#ifndef ELEMENT_SIZES_H
#define ELEMENT_SIZES_H

enum { N_UNILATERALS = 0, N_FRICTIONS = 0, N_ELEMENTS = 0, SIZE_ELEMENTS = 1, SIZE_UNILATERALS = 1 };

#endif
