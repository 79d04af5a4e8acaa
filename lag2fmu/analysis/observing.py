"""What an observer is asked for, and what it assumes where nothing is said.

The state x (n,) of an observer has coordinates, velocities, further states, and behind them the parameters that are
estimated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lag2fmu.analysis.subspaces import SHARE, complement, reached
from lag2fmu.description.names import rate, residual, velocity
from lag2fmu.errors import LoadError
from lag2fmu.graph.batches import Floats
from lag2fmu.language.given import check_mapping, check_names, within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism

SIMPLEX = "ukf-simplex"
METHODS_OF_OBSERVERS = ("ekf", "ukf", SIMPLEX)
RESOLVED = 0.1
"""A step times the fastest pole: the method's error in a step is then 1e-7 of the motion, far below any noise."""


@dataclass(frozen=True)
class Observing:
    """What an observer is asked for, in SI units.

    - ``method``: one of METHODS_OF_OBSERVERS.
    - ``measure`` {variable: standard deviation}; ``sample_times`` {variable: s}, where they are not given 0: a sample
      comes with each communication step.
    - ``process`` {input, state or estimated parameter: density of white noise}.
    - ``estimate``: parameters that are estimated too.
    - ``delays`` {variable: s}: samples of it belong to an earlier time.
    """

    method: str
    measure: Mapping[str, float]
    process: Mapping[str, float] = field(default_factory=dict)
    estimate: tuple[str, ...] = ()
    sample_times: Mapping[str, float] = field(default_factory=dict)
    delays: Mapping[str, float] = field(default_factory=dict)


def doubt_of(hidden: Sequence[str]) -> str:
    """A sentence on states of which samples say nothing; "" without such states."""
    if not hidden:
        return ""
    return (
        f"at the start what is measured does not show {', '.join(hidden)}; estimates of it rest on how "
        "well the start is known, unless the motion shows more later"
    )


def modes_refused(mechanism: Mechanism) -> str:
    """Why a ``mechanism`` with modes has no observer, and what helps; "" without modes."""
    if not mechanism.hybrid:
        return ""
    return (
        f"mechanism '{mechanism.name}' has contacts, stops, dry friction or switches: their modes have no "
        "covariance, so no observer; leave out what may be"
    )


def check_noise(
    measure: Mapping[str, float], times: Mapping[str, float], what: str = "delay", *, least: float = 0.0
) -> None:
    """Raise LoadError for standard deviations and ``times`` (s), called ``what`` in sentences, that cannot be."""
    if not measure or not isinstance(measure, Mapping):
        raise LoadError(
            "nothing is measured; give measure = {variable: standard deviation}, or --measure VARIABLE=STD on the "
            "command line"
        )
    for name, size in measure.items():
        if not within(size, above=0):
            raise LoadError(f"measure '{name}': {size!r} is no standard deviation; give a positive one")
    check_mapping(what, times)
    for name, time in times.items():
        if name not in measure or not within(time, least=least):
            raise LoadError(f"{what} of '{name}': {time!r} s; give a measured name and a time that is not negative")


def check_process(process: Mapping[str, float], known: Sequence[str]) -> None:
    """Raise LoadError for densities that cannot be, and for names that are not ``known``."""
    check_mapping("process", process)
    for name, size in process.items():
        if name not in known:
            raise LoadError(f"process '{name}' is no input, state or estimated parameter; {suggestion(name, known)}")
        if not within(size, above=0):
            raise LoadError(f"process '{name}': {size!r} is no density of noise; give a positive one")


def check_estimated(estimate: Sequence[str], parameters: Sequence[str], states: Sequence[str]) -> None:
    """Raise LoadError for names that are no ``parameters`` or stand twice, and for a text in place of names.

    Raises it too where there are no ``states``, and nothing else to ``estimate``.
    """
    check_names("estimate", estimate, "parameters")
    if not (states or estimate):
        raise LoadError(
            "no state moves by itself, so there is nothing to estimate; name parameters to estimate, or prescribe less"
        )
    for name in estimate:
        if name not in parameters:
            raise LoadError(f"'{name}' is no parameter that can be estimated; {suggestion(name, parameters)}")
        if list(estimate).count(name) > 1:
            raise LoadError(f"estimate: '{name}' stands twice; name it once")


def residuals_of(mechanism: Mechanism) -> tuple[str, ...]:
    """The names of the conditions on states: residuals of constraints, and rates of the holonomic ones."""
    positions = (residual(c.name) for c in mechanism.constraints if c.name)
    return (*positions, *(rate(residual(c.name)) for c in mechanism.holonomic))


def _nominals(mechanism: Mechanism) -> dict[str, float]:
    """{state: nominal value}."""
    sizes = {q.name: q.nominal for q in mechanism.coordinates}
    sizes |= {velocity(q.name): q.nominal for q in mechanism.coordinates}
    return sizes | {z.name: z.nominal for z in mechanism.states}


def known_starts(mechanism: Mechanism, names: Sequence[str], start: Floats) -> Floats:
    """By default the start of a state is known to its nominal value, that of a parameter to a tenth of it, (n,)."""
    nominal = _nominals(mechanism)
    sizes = [nominal.get(name, 0.1 * abs(x)) for name, x in zip(names, start, strict=True)]
    return np.array(sizes, dtype=np.float64)


ASSUMED = 0.01
"""The standard deviation of what is measured, by the nominal value of its variable, where none is given."""


def assumed_noise(mechanism: Mechanism, name: str) -> float:
    """The standard deviation, in SI units, that is assumed of what is measured of a state.

    Raises LoadError for other variables, which have no nominal value.
    """
    sizes = _nominals(mechanism)
    if name not in sizes:
        found = suggestion(name, sizes)
        raise LoadError(
            f"measure '{name}': it has no nominal value to tell its noise by, as states have: {found}; give {name}=STD"
        )
    return ASSUMED * sizes[name]


def hidden_states(names: Sequence[str], A: Floats, H: Floats, T: Floats) -> tuple[str, ...]:
    """The states with a share in what outputs H x (o, n) of dx/dt = A x do not show; errors are in the span of T."""
    unseen = T @ complement(reached((T.T @ A @ T).T, (H @ T).T))
    shares = np.abs(unseen).max(axis=1, initial=0.0) > SHARE
    return tuple(name for name, share in zip(names, shares, strict=True) if share)
