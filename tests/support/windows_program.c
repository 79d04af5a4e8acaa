/* A program for Windows without MinGW-w64's part of the C library: how it is entered, and what reads and writes. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

int main(int count, char **words);
_CRTIMP int __cdecl _configure_narrow_argv(int mode);
void mainCRTStartup(void);
void __main(void);

void mainCRTStartup(void) {
    _configure_narrow_argv(1);
    exit(main(*__p___argc(), *__p___argv()));
}

int vfprintf(FILE *file, const char *format, va_list values) {
    return __stdio_common_vfprintf(0, file, format, NULL, values);
}

int fprintf(FILE *file, const char *format, ...) {
    va_list values;
    va_start(values, format);
    const int written = vfprintf(file, format, values);
    va_end(values);
    return written;
}

int vprintf(const char *format, va_list values) {
    return vfprintf(stdout, format, values);
}

int printf(const char *format, ...) {
    va_list values;
    va_start(values, format);
    const int written = vprintf(format, values);
    va_end(values);
    return written;
}

int fscanf(FILE *file, const char *format, ...) {
    va_list values;
    va_start(values, format);
    const int read = __stdio_common_vfscanf(0, file, format, NULL, values);
    va_end(values);
    return read;
}

/* The compiler calls it first in 'main'. */
void __main(void) {}

float frexpf(float x, int *exponent) {
    return (float)frexp(x, exponent);
}

float ldexpf(float x, int exponent) {
    return (float)ldexp(x, exponent);
}

int __fpclassifyf(float x) {
    return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x);
}

int __isnanf(float x) {
    return __builtin_isnan(x);
}
