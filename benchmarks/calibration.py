"""Calibration: how often the estimates lie within their 95 % confidence, and the time of one.

Run with `make bench` or `python -m benchmarks.calibration`. The pendulum with a length and a start angle to find, from
41 noisy angles and velocities, noise unknown; a drive with damping and stiffness from one column. 200 repetitions each.
The bar: 95 %, as far as chance allows (the interval that 99 % of the counts lie in). Then chains with many free values,
stiffnesses, dampings, lengths and starts of links, from 41 noisy angles each: by the derivatives of all samples, and by
gradients with adjoints. Both have to end at the same fit.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.stats import binom

import lag2fmu
from benchmarks.gradients import chain
from lag2fmu.studies import measured_runs
from lag2fmu.studies.library import Study, compiled

REPETITIONS = 200
CASES = {
    "pendulum": ({"l": 1.1, "theta": 0.8}, {"theta": 0.01, "theta_dot": 0.05}, 4.0),
    "spring_mass_damper": ({"k": 110.0, "c": 0.6}, {"x": 0.005}, 5.0),
    "double_pendulum": ({"m2": 1.2, "l1": 0.9, "theta1": 0.5}, {"theta1": 0.01, "theta2": 0.01}, 3.0),
}
"""Model -> (what is free with its true value, noise of columns, stop time in s)."""


KINDS = ("k{}", "d{}", "l{}", "theta{}", "theta{}_dot")
CHAINS = ((6, 2), (6, 5), (12, 2), (12, 5), (24, 2), (24, 5))
"""(links, how many of the KINDS are free in each)."""
OFF, NOISE = 0.02, 2e-4
"""The truth beside the model's values, as a part of them, and the noise of angles (rad)."""


def main() -> None:
    """Repeat and print."""
    repeated()
    print("links, free values: CPU s by all derivatives, by adjoints; greatest difference in standard errors")
    for links, kinds in CHAINS:
        print(both_ways(links, kinds), flush=True)


def both_ways(links: int, kinds: int) -> str:
    """What a fit of ``kinds`` kinds of values of a chain takes, each way, and what the fits differ by."""
    model, links_from_1 = chain(links, 1), range(1, links + 1)
    free = [kind.format(i) for kind in KINDS[:kinds] for i in links_from_1]
    angles, times, noise = [f"theta{i}" for i in links_from_1], np.linspace(0.0, 2.0, 41), np.random.default_rng(0)
    library = compiled(model)
    compiled(model, adjoints=True)  # so that no fit waits for the compiler
    first = Study(library).run({}, np.zeros(1), library.readable(free), tolerance=1e-8)[0][0].tolist()
    true = [value + OFF * (value or 1.0) * noise.standard_normal() for value in first]
    given = {library.settable(name): value for name, value in zip(free, true, strict=True)}
    clean = Study(library).run(given, times, library.readable(angles), tolerance=1e-11)[0]
    data = {"time": times, **dict(zip(angles, (clean + NOISE * noise.standard_normal(clean.shape)).T, strict=True))}
    usual, fits, spent = measured_runs.MANY, [], []
    for measured_runs.MANY in (len(free), 0):
        start = time.process_time()
        fits.append(lag2fmu.calibrate(model, data, free=free, noise=dict.fromkeys(angles, NOISE)))
        spent.append(time.process_time() - start)
    measured_runs.MANY = usual
    known = fits[0].standard_errors > 0  # what is at a bound has none
    apart = abs(fits[0].estimates - fits[1].estimates)[known] / fits[0].standard_errors[known]
    return f"{links:3d}, {len(free):4d}: {spent[0]:7.2f}, {spent[1]:7.2f}; {apart.max():.1e}"


def repeated() -> None:
    """How often the truth lies within the confidence."""
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
