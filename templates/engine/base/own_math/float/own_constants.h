/* The constants of own_math.c for numbers of type float. Polynomials of sine, cosine and arctangent: Taylor's,
   as the other series are. */
#ifndef OWN_CONSTANTS_H
#define OWN_CONSTANTS_H

/* A number as the sum of two, of which the second is less than half a unit in the last place of the first. */
typedef struct {
    double high, low;
} Pair;

static const double SPLITTER = 4097.0; /* 2^12 + 1: halves of numbers have products without rounding */
static const double TINY = 1.2207031e-04;     /* what is smaller is its own sine, tangent and so on */
static const double ROOT_OF_HALF = 7.0710677e-01;
static const double LARGE_ANGLE = 1600.0; /* rad */
static const double MOST_RATIO = 1.0737418e+09; /* of the sides of a triangle; beyond, an angle is right */
static const double MOST_EXPONENT = 88.73, LEAST_EXPONENT = -103.98; /* beyond, exp is infinite, or 0 */
static const double MOST_HYPERBOLIC = 89.41598, MOST_TANH = 10.0; /* beyond, sinh is infinite, and tanh is 1 */
static const double SMALL_EXPONENT = 0.34657;
static const Pair HALF_PI = {1.5707964e+00, -4.371139e-08};
static const double HALF_PI_PARTS[] = {
    1.5706787e+00, 1.17614865e-04, 9.920313e-10, 6.223372e-14};
static const double LN_2[] = {
    6.9311523e-01, 3.1944364e-05, 1.820636e-09};
static const Pair ODD_PARTS[] = {
    {3.3333334e-01, -9.934108e-09},
    {2.0e-01, -2.9802323e-09},
    {1.4285715e-01, -6.386212e-09}}; /* 1/3, 1/5, 1/7 */
static const Pair ANGLES[] = {
    {4.636476e-01, 5.0121587e-09},
    {7.853982e-01, -2.1855694e-08},
    {9.8279375e-01, -2.5131424e-08}}; /* atan of 1/2, 1, 3/2 */
enum { EXPONENTIAL_TERMS = 8, LOGARITHM_TERMS = 4, SINE_TERMS = 5, COSINE_TERMS = 5, ARCTANGENT_TERMS = 10 };
static const double EXPONENTIAL[] = {
    1.6666667e-01, 4.1666668e-02, 8.333334e-03, 1.3888889e-03, 1.984127e-04, 2.4801588e-05, 2.7557319e-06,
    2.755732e-07};
static const double LOGARITHM[] = {
    1.1111111e-01, 9.090909e-02, 7.692308e-02, 6.666667e-02};
static const double SINE[] = {
    -1.6666667e-01, 8.333334e-03, -1.984127e-04, 2.7557319e-06, -2.5052108e-08};
static const double COSINE[] = {
    4.1666668e-02, -1.3888889e-03, 2.4801588e-05, -2.755732e-07, 2.0876756e-09};
static const double ARCTANGENT[] = {
    3.3333334e-01, -2.0e-01, 1.4285715e-01, -1.1111111e-01, 9.090909e-02, -7.692308e-02, 6.666667e-02,
    -5.882353e-02, 5.263158e-02, -4.761905e-02};

#endif
