/* How much work memory an instance needs besides that of laws whose matrices are large. Its unit is what all vectors,
   or all matrices, of the mechanism have together; the call that takes most has no more of them at one time than the
   factors here say, which the compiler's call graph shows (tests/toolchain/test_stack.py). */
#ifndef ARENA_SIZE_H
#define ARENA_SIZE_H

#include "arena.h"
#include "state.h"

/* Entries of vectors: states, residuals, signals, parameters, events at the nodes of a polynomial, locals. */
#define VECTOR_ENTRIES                                                                                                \
    ((size_t)N_STATES + N_RESIDUALS + N_SIGNALS + SIZE_PARAMETERS + 16 * (size_t)SIZE_EVENTS + SIZE_LOCALS +          \
     SIZE_DEPENDENT + SIZE_FURTHER)

/* Entries of matrices: the constraints' Jacobian, their operator, the mass matrix with its factor. */
#define MATRIX_ENTRIES                                                                                                \
    ((size_t)N_CONSTRAINTS * N_COORDINATES + (size_t)N_CONSTRAINTS * N_CONSTRAINTS)

/* Bytes that calls take without a reservation. */
#define ARENA_WORK                                                                                                    \
    ((12 * VECTOR_ENTRIES + 5 * MATRIX_ENTRIES + 2 * (size_t)N_COORDINATES * N_COORDINATES + SIZE_FACTOR) *            \
         sizeof(double) +                                                                                             \
     4096)

/* Bytes of laws that are solved without a further block: the matrices that an elimination, its laws, their program of
   cones and Newton's method have at one time, 16 of all rows at most; their vectors; the work of the calls above. Many
   rows touch in few places, and their matrices are sparse: there are no more bytes than these. */
#define LAWS_WORK ((16 * (size_t)N_CONSTRAINTS + 200) * N_CONSTRAINTS * sizeof(double) + ARENA_WORK)
#ifndef SMALL_LAWS
#define SMALL_LAWS (LAWS_WORK < 262144 ? LAWS_WORK : 262144)
#endif

#ifndef SOLVER_WORK
#define SOLVER_WORK 0 /* bytes that a solver asks for beyond them and may not have from the heap */
#endif

#define ARENA_CAPACITY (ARENA_WORK + SOLVER_WORK + (N_UNILATERALS + N_FRICTIONS > 0 ? SMALL_LAWS : 0))

#endif
