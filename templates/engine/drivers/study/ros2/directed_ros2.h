/* Second derivatives of the equations, as the steps of ROS2 need them. With f_w v the derivative of f along changes v
   of states, inputs and parameters, J k changes along v by

       d(J k) v = d/de f_w(x + e k) v,   and with weights m   m^T d(J k) = d/de f_w(x + e k)^T m.

   Exact first derivatives, forward or backwards, thus stand at points beside the motion along one line, and their
   central difference of fourth order gives both to near rounding. It is the same sum either way, so that directions and
   adjoints agree to rounding whatever it misses. Second derivatives as programs would be needed of the equations, their
   constraints, contacts and tables, each forward and backwards, for what is a small part of a step. */
#ifndef DIRECTED_ROS2_H
#define DIRECTED_ROS2_H

#include "instance.h"

enum { POINTS_BESIDE = 4 };

/* states[N_STATES] of point i on the line along k through the present point; returns its weight (1/s) in d/de, 0 where
   k leads nowhere. */
double ros2_beside(const Instance *instance, const double k[], int i, double states[]);

#endif
