/* The function of lane_equations.h at many points, a group of lanes at a time. */
#include "lane_equations.h"
#include "lane_math.h"

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

/* Points stand one after another; a stride of 0 gives all of them the same values. */
typedef struct {
    int64_t first, end;  /* the points to compute */
    const double *t, *x, *u, *p;
    int64_t strides[4];  /* of t, x, u, p, in doubles */
    double *results;     /* [points][results of one] */
} Points;

EXPORTED void function_values(const Points *points);

/* Where pivots are not positive there is no value. */
static Lanes only_where_sound(const Lanes pivots[], Lanes value) {
    Mask sound = ~(Mask){0};
    for (int i = 0; i < N_PIVOTS; i++) {
        sound &= (Mask)(pivots[i] > 0.0);
    }
    return lanes_select(sound, value, lanes_of(NAN));
}

static void gather(const double from[], int64_t stride, int size, int64_t first, int64_t last, Lanes to[]) {
    for (int lane = 0; lane < LANES; lane++) {
        const int64_t point = first + lane < last ? first + lane : last;
        for (int i = 0; i < size; i++) {
            to[i][lane] = from[point * stride + i];
        }
    }
}

EXPORTED void function_values(const Points *points) {
    Lanes t = lanes_of(0.0); /* gather fills it lane by lane, which gcc does not follow */
    Lanes x[N_STATES], u[SIZE_SIGNALS], p[SIZE_PARAMETERS], results[SIZE_RESULTS], pivots[N_PIVOTS];
    for (int64_t first = points->first; first < points->end; first += LANES) {
        const int64_t last = points->end - 1;
        gather(points->t, points->strides[0], 1, first, last, &t);
        gather(points->x, points->strides[1], N_STATES, first, last, x);
        gather(points->u, points->strides[2], N_SIGNALS, first, last, u);
        gather(points->p, points->strides[3], N_PARAMETERS, first, last, p);
        lanes_values(t, x, u, p, results, pivots);
        for (int i = 0; i < N_RESULTS; i++) {
            const Lanes sound = only_where_sound(pivots, results[i]);
            for (int lane = 0; lane < LANES && first + lane <= last; lane++) {
                points->results[(first + lane) * N_RESULTS + i] = sound[lane];
            }
        }
    }
}
