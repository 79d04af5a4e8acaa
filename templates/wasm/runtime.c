/* What is left of the C library where a module takes but a few of its functions. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

_Thread_local int errno;

void _initialize(void);

/* The host calls it first; nothing in C or Zig has to be prepared. */
__attribute__((visibility("default"))) void _initialize(void) {}

_Noreturn void abort(void) {
    __builtin_trap();
}

/* Two things that 'snprintf' knows and nobody asks for: wide characters, and what an error number means. */
int wctomb(char *text, wchar_t character) {
    (void)text, (void)character;
    return -1;
}

char *strerror(int number) {
    (void)number;
    return "";
}
