"""The constants of step size control, for all integrators: this file, and the header in C that is made from it.

Sources: [HNW] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4; [HW]
Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2 (the PI controller), with the
constants of the code dopri5.f of the same authors. Errors are in units of the tolerance; the error of a step is
proportional to its length to the ``power``.
"""

LARGEST_GROWTH = 10.0  # the longest next step, in units of this step
LARGEST_REDUCTION = 0.2  # the shortest next step, in units of this step
UNMEASURED_REDUCTION = 0.25  # the next step after one without a finite error, in units of this step
REMEMBERED_EXPONENT = 0.2  # beta of [HW]: the exponent of the last error, in units of 1 / power
REMEMBERED_SHARE = 0.75  # the exponent alpha of [HW] is 1 / power less this part of beta
SMALLEST_ERROR = 1e-4  # the smallest error that the controller remembers

STRETCH = 1.05  # the last step may be longer than the proposed one by this factor, so that no sliver is left
MAX_STEP_SLACK = 1.001  # the last step may be longer than the longest one by this factor
LONGEST_PART = 0.02  # the longest step under error control by default, as a part of the experiment
SHORTEST_ROUNDINGS = 16.0  # the shortest step, in units of the rounding of the time

FIRST_PART = 0.01  # the first step changes the states, or their change, by this part: [HNW], "Starting step size"
FIRST_GROWTH = 100.0  # the first step in units of the step that is tried for it
RESTING = 1e-5  # states or derivatives of less than this, in units of the tolerance, do not tell a first step
RESTING_PART = 1e-7  # the first step is tried with this part of the experiment then
NO_CHANGE = 1e-15  # derivatives that change by less do not tell a first step
FAILED_START = 1e-3  # the first step after one that cannot be tried, in units of the step that is tried
