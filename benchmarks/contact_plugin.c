/* What Siconos calls of the cases of contact_peers.py with curved contacts: gaps and their derivatives, by columns. */
#include <math.h>

static const double PI = 3.14159265358979323846;
static const double B = 0.1, H = 0.4; /* half the width and height of the rocking block (m) */
static const double L0 = 3.0, L1 = 1.0, L2 = 4.0, L3 = 2.5, PIN = 0.055, BUSH = 0.06; /* the four-bar linkage (m) */

typedef unsigned int Size;

static void edge(const double *q, double side, double *y) {
    y[0] = q[1] + side * B * sin(q[2]) - H * cos(q[2]);
    y[1] = 0.0;
}

static void edge_slopes(const double *q, double side, double *w) {
    w[0] = 0.0, w[2] = 1.0, w[4] = side * B * cos(q[2]) + H * sin(q[2]);
    w[1] = 1.0, w[3] = 0.0, w[5] = -side * B * sin(q[2]) + H * cos(q[2]);
}

void hA(Size n, const double *q, Size m, double *y, Size k, double *z) { edge(q, -1.0, y); }
void hB(Size n, const double *q, Size m, double *y, Size k, double *z) { edge(q, 1.0, y); }
void GA(Size n, const double *q, Size m, double *w, Size k, double *z) { edge_slopes(q, -1.0, w); }
void GB(Size n, const double *q, Size m, double *w, Size k, double *z) { edge_slopes(q, 1.0, w); }

/* The lift of the cam (m), and its derivative along the angle of the cam (m/rad). */
static double cam(double time, double *slope) {
    const double rate = 2.0 * PI * 358.0 / 60.0, c = -sin(rate * time), w = cos(rate * time), s = fabs(w);
    const double dc = -w, ds = w < 0.0 ? sin(rate * time) : -sin(rate * time);
    double k = 0.45, rho = 0.85, a = -s, da = -ds, b = c, db = dc;
    *slope = 0.0;
    if (c > 0.0) {
        return 0.1;
    }
    if (c <= -sin(1.22173047639603)) {
        return 0.55393320723821 - 0.3;
    }
    if (c <= -sin(1.050328174371336)) {
        const double p = cos(PI / 9.0), r = sin(PI / 9.0);
        k = 0.40393320723821, rho = 0.15, a = -(c * p - s * r), da = -(dc * p - ds * r), b = s * p + c * r;
        db = ds * p + dc * r;
    }
    const double root = sqrt(rho * rho - k * k * b * b);
    *slope = k * da - k * k * b * db / root;
    return k * a + root - 0.3;
}

void hcam(Size n, const double *q, double time, Size m, double *y, Size k, double *z) {
    double slope;
    y[0] = q[0] - cam(time, &slope);
}
void Gcam(Size n, const double *q, double time, Size m, double *w, Size k, double *z) { w[0] = 1.0; }
void Tcam(Size n, const double *q, double time, Size m, double *w, Size k, double *z) {
    cam(time, w);
    w[0] *= -2.0 * PI * 358.0 / 60.0;
}

/* A pin in its bush. Its centre is at d from that of the bush. `rows` are the derivatives of d along the coordinates,
   two a coordinate; `turns` are the radii times signs by which a rotation makes the surfaces slide. */
static void joint(const double *d, double *y) {
    y[0] = BUSH - PIN - hypot(d[0], d[1]);
    y[1] = 0.0;
}

static void joint_slopes(const double *d, const double rows[7][2], const double turns[3], double *w) {
    const double length = hypot(d[0], d[1]);
    for (int i = 0; i < 7; i++) {
        w[2 * i] = -(d[0] * rows[i][0] + d[1] * rows[i][1]) / length;
        w[2 * i + 1] = (d[0] * rows[i][1] - d[1] * rows[i][0]) / length + (i < 3 ? turns[i] : 0.0);
    }
}

static void first(const double *q, double *d) {
    d[0] = q[3] - L2 / 2.0 * cos(q[1]) - L1 * cos(q[0]);
    d[1] = q[4] - L2 / 2.0 * sin(q[1]) - L1 * sin(q[0]);
}
static void second(const double *q, double *d) {
    d[0] = q[5] + L3 / 2.0 * cos(q[2]) - q[3] - L2 / 2.0 * cos(q[1]);
    d[1] = q[6] + L3 / 2.0 * sin(q[2]) - q[4] - L2 / 2.0 * sin(q[1]);
}
static void third(const double *q, double *d) {
    d[0] = q[5] - L3 / 2.0 * cos(q[2]) - L0;
    d[1] = q[6] - L3 / 2.0 * sin(q[2]);
}

void h1(Size n, const double *q, Size m, double *y, Size k, double *z) {
    double d[2];
    first(q, d), joint(d, y);
}
void h2(Size n, const double *q, Size m, double *y, Size k, double *z) {
    double d[2];
    second(q, d), joint(d, y);
}
void h3(Size n, const double *q, Size m, double *y, Size k, double *z) {
    double d[2];
    third(q, d), joint(d, y);
}
void G1(Size n, const double *q, Size m, double *w, Size k, double *z) {
    const double rows[7][2] = {{L1 * sin(q[0]), -L1 * cos(q[0])},
                               {L2 / 2.0 * sin(q[1]), -L2 / 2.0 * cos(q[1])},
                               {0.0, 0.0},
                               {1.0, 0.0},
                               {0.0, 1.0}};
    double d[2];
    first(q, d), joint_slopes(d, rows, (const double[]){-PIN, BUSH, 0.0}, w);
}
void G2(Size n, const double *q, Size m, double *w, Size k, double *z) {
    const double rows[7][2] = {{0.0, 0.0},
                               {L2 / 2.0 * sin(q[1]), -L2 / 2.0 * cos(q[1])},
                               {-L3 / 2.0 * sin(q[2]), L3 / 2.0 * cos(q[2])},
                               {-1.0, 0.0},
                               {0.0, -1.0},
                               {1.0, 0.0},
                               {0.0, 1.0}};
    double d[2];
    second(q, d), joint_slopes(d, rows, (const double[]){0.0, -PIN, BUSH}, w);
}
void G3(Size n, const double *q, Size m, double *w, Size k, double *z) {
    const double rows[7][2] = {{0.0, 0.0}, {0.0, 0.0},           {L3 / 2.0 * sin(q[2]), -L3 / 2.0 * cos(q[2])},
                               {0.0, 0.0}, {0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}};
    double d[2];
    third(q, d), joint_slopes(d, rows, (const double[]){0.0, 0.0, BUSH}, w);
}

/* The weight of the crank, whose moment is not constant, on the left of the equations. */
void weight(double time, Size n, const double *q, const double *v, double *f, Size k, double *z) {
    for (Size i = 0; i < n; i++) {
        f[i] = 0.0;
    }
    f[0] = 9.81 * L1 / 2.0 * cos(q[0]);
    f[4] = f[6] = 9.81;
}
void weight_slopes(double time, Size n, const double *q, const double *v, double *w, Size k, double *z) {
    for (Size i = 0; i < n * n; i++) {
        w[i] = 0.0;
    }
    w[0] = -9.81 * L1 / 2.0 * sin(q[0]);
}
