/* Elementary functions that have the same bits on every target with the arithmetic of IEEE 754, whose libms differ.
   Their errors are below 1 unit in the last place; what libm computes exactly (sqrt, floor, ldexp) is its own. */
#ifndef OWN_MATH_H
#define OWN_MATH_H

double own_sin(double x);
double own_cos(double x);
double own_tan(double x);
double own_asin(double x);
double own_acos(double x);
double own_atan(double x);
double own_atan2(double y, double x);
double own_sinh(double x);
double own_cosh(double x);
double own_tanh(double x);
double own_exp(double x);
double own_log(double x);
double own_pow(double x, double y);
double own_hypot(double x, double y);

#endif
