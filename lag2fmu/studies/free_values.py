"""The values that a calibration estimates: parameters and starts, with bounds and first guesses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.studies.fits import FreeValue, Measurement
from lag2fmu.studies.library import INPUT, STATES, StudyLibrary
from lag2fmu.studies.requests import check_over, references_of, scale_of

_MASS = ((1, 0, 0), (1, 2, 0))
"""Exponents of kg, m, s of a mass and of a moment of inertia."""
_LEAST = 1e-9
"""Relative to its first value: the least value of one that stays positive."""


def free_values(
    library: StudyLibrary,
    mechanism: Mechanism,
    free: Sequence[str],
    experiments: Sequence[Measurement],
    values: Sequence[Mapping[str, float]],
    bounds: Mapping[str, tuple[float, float]],
) -> list[FreeValue]:
    """The values that ``free`` names; there is one for each of the ``experiments`` if it is a start.

    Raises LoadError for names and bounds that cannot be used.
    """
    check_over(library, free)
    for given in values:
        references_of(library, given)
    limits = _limits(library, mechanism, free, bounds)
    found: list[FreeValue] = []
    for name in free:
        own = library.kinds[name] in STATES and len(experiments) > 1
        for i in range(len(experiments)) if own else [None]:
            guess = _guess(library, name, experiments[i or 0], values[i or 0])
            label = name if i is None else f"{name}[{i + 1}]"
            found.append(FreeValue(name, label, i, guess, *limits[name], scale_of(library, name, {name: guess})))
    _check_inside(found)
    return found


def _check_inside(found: Sequence[FreeValue]) -> None:
    for x in found:
        if not x.low <= x.start <= x.high:
            between = f"its bounds, {x.low:g} to {x.high:g}"
            raise LoadError(f"the first value of '{x.label}', {x.start:g}, is out of {between}")


def _guess(library: StudyLibrary, name: str, experiment: Measurement, values: Mapping[str, float]) -> float:
    """The first guess: the given value, that measured at the first time, or that of the model, in this order."""
    if name in values:
        return float(values[name])
    if library.kinds[name] in STATES and name in experiment.names:
        measured = experiment.values[0, experiment.names.index(name)]
        if np.isfinite(measured):
            return float(measured)
    return float(library.variables[name].start or 0.0)


def _limits(
    library: StudyLibrary, mechanism: Mechanism, free: Sequence[str], bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """{name: (least, greatest) value} by the model, by what a quantity means, and by the user; raises LoadError."""
    for name in bounds:
        if name not in free:
            near = get_close_matches(name, free) or free
            raise LoadError(f"bounds of '{name}' are given, but it is not free; free are {', '.join(near)}")
    positive, found = set(positive_parameters(mechanism)), {}
    for name in free:
        variable, start = library.variables[name], float(library.variables[name].start or 0.0)
        low = -np.inf if variable.minimum is None else variable.minimum
        high = np.inf if variable.maximum is None else variable.maximum
        if name in positive and start > 0 and library.kinds[name] != INPUT:
            low = max(low, _LEAST * start)
        least, greatest = bounds.get(name, (-np.inf, np.inf))
        if np.isnan((least, greatest)).any():
            raise LoadError(
                f"the bounds of '{name}', {least:g} to {greatest:g}, are no numbers; give -inf or inf for none"
            )
        low, high = max(low, least), min(high, greatest)
        if not low < high:
            raise LoadError(f"the bounds of '{name}', {low:g} to {high:g}, leave no room")
        found[name] = (low, high)
    return found


def positive_parameters(mechanism: Mechanism) -> Iterator[str]:
    """The names of the parameters that are masses, inertias, stiffnesses or dampings, by place or by unit."""
    for body in mechanism.bodies:
        yield str(body.mass)
    for spring in mechanism.springs:
        yield str(spring.stiffness)
    for damper in mechanism.dampers:
        yield str(damper.damping)
    for p in mechanism.parameters:
        if p.unit is not None and tuple(p.unit.exponents[:3]) in _MASS and not any(p.unit.exponents[3:]):
            yield p.name
