/* ns of thread CPU time per call, over all rows and repetitions. */
#define _POSIX_C_SOURCE 200809L
#include <time.h>

typedef void (*Kernel)(const double in[], double out[]);

double measure(Kernel kernel, int rows, int width, const double in[], int n, double out[], int repetitions) {
    struct timespec start, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &start);
    for (int repetition = 0; repetition < repetitions; repetition++) {
        for (int row = 0; row < rows; row++) {
            kernel(in + row * width, out + row * n);
        }
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    const double ns = 1e9 * (double)(end.tv_sec - start.tv_sec) + (double)(end.tv_nsec - start.tv_nsec);
    return ns / ((double)repetitions * rows);
}
