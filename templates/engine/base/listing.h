/* Long functions that are called rarely, as numbers that are read at run time: a compiler has no work with them.

   Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, section 2.2 (evaluation procedures). */
#ifndef LISTING_H
#define LISTING_H

/* Computes s, which begins with the function's arguments and constants. A listing consists of runs of equal operations:
   the sign of the operation, how many there are, and for each of them the places in s of its result and of its two
   operands. Results have the bits that statements give. The signs are + - * / ~ (minus a) r (root) s (sine) c (cosine);
   where there is one operand, its place stands twice. */
void listing_run(const unsigned short listing[], int runs, double s[]);

/* result[places[2 i]] = s[places[2 i + 1]] for each i below count. */
void listing_read(const int places[], int count, const double s[], double result[]);

#endif
