/* What a RESTRICT pointer leads to, no other one of the function does: the compiler need not ask. */
#ifndef RESTRICT_H
#define RESTRICT_H

#if __STDC_VERSION__ >= 199901L
#define RESTRICT restrict
#else
#define RESTRICT /* C++, and the C of Microsoft's compiler, if not told otherwise */
#endif

#endif
