/* What MinGW-w64's part of the C library would add to a library for Windows: how it is entered, and few functions. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <windows.h>

BOOL WINAPI DllMainCRTStartup(HINSTANCE library, DWORD reason, LPVOID reserved);

/* Windows calls it; there is nothing to prepare. */
BOOL WINAPI DllMainCRTStartup(HINSTANCE library, DWORD reason, LPVOID reserved) {
    (void)library, (void)reason, (void)reserved;
    return TRUE;
}

int vsnprintf(char *text, size_t size, const char *format, va_list values) {
    return __stdio_common_vsprintf(_CRT_INTERNAL_PRINTF_STANDARD_SNPRINTF_BEHAVIOR, text, size, format, NULL, values);
}

int snprintf(char *text, size_t size, const char *format, ...) {
    va_list values;
    va_start(values, format);
    const int length = vsnprintf(text, size, format, values);
    va_end(values);
    return length;
}

/* That of 'isfinite', and that of 'isnan'. */
int __fpclassify(double x) {
    return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x);
}

int __isnan(double x) {
    return __builtin_isnan(x);
}
