"""Calibration: how often the estimates lie within their 95 % confidence, and the time of one.

Run with `make bench` or `python -m benchmarks.calibration`. The pendulum with a length and a start angle to find, from
41 noisy angles and velocities, noise unknown; a drive with damping and stiffness from one column. 200 repetitions each.
The bar: 95 %, as far as chance allows (the interval that 99 % of the counts lie in).
"""

from __future__ import annotations

import time

import numpy as np
from scipy.stats import binom

import lag2fmu
from lag2fmu.studies.library import Study, compiled

REPETITIONS = 200
CASES = {
    "pendulum": ({"l": 1.1, "theta": 0.8}, {"theta": 0.01, "theta_dot": 0.05}, 4.0),
    "spring_mass_damper": ({"k": 110.0, "c": 0.6}, {"x": 0.005}, 5.0),
    "double_pendulum": ({"m2": 1.2, "l1": 0.9, "theta1": 0.5}, {"theta1": 0.01, "theta2": 0.01}, 3.0),
}
"""Model -> (what is free with its true value, noise of columns, stop time in s)."""


def main() -> None:
    """Repeat and print."""
    low, high = binom.interval(0.99, REPETITIONS, 0.95)
    print(f"95 % of {REPETITIONS} is {0.95 * REPETITIONS:.0f}; 99 % of such counts lie from {low:.0f} to {high:.0f}")
    for model, (true, noise, stop) in CASES.items():
        library = compiled(model)
        times = np.linspace(0.0, stop, 41)
        given = {library.settable(name): value for name, value in true.items()}
        clean = Study(library).run(given, times, library.readable(list(noise)), tolerance=1e-11)[0]
        hits = dict.fromkeys(true, 0)
        start = time.process_time()
        for seed in range(REPETITIONS):
            noisy = clean + np.random.default_rng(seed).standard_normal(clean.shape) * list(noise.values())
            data = {"time": times, **dict(zip(noise, noisy.T, strict=True))}
            found = lag2fmu.calibrate(model, data, free=list(true))
            for name, value in true.items():
                least, greatest = found.confidence(name)
                hits[name] += least <= value <= greatest
        spent = 1e3 * (time.process_time() - start) / REPETITIONS
        print(f"{model:20s} " + ", ".join(f"{n} {hit}" for n, hit in hits.items()) + f"; {spent:.1f} ms of CPU each")


if __name__ == "__main__":
    main()
