"""The arguments of studies, checked: values, times, inputs, names of what is varied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.errors import LoadError
from lag2fmu.language.given import check_mapping, check_names, within
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.library import INPUT, PARAMETERS, STATES, USUAL, KnotSignals, StudyLibrary
from lag2fmu.verify.inputs import Inputs, trajectory_of

_SAMPLES = 100
"""The number of times of a run if the user names none."""


def references_of(library: StudyLibrary, values: Mapping[str, float]) -> dict[int, float]:
    """{value reference: SI value} of ``values``; raises LoadError for a name, number or bound that does not fit."""
    check_mapping("values", values)
    found = {}
    for name, value in values.items():
        reference = library.settable(name)
        check_value(library, name, value)
        found[reference] = float(value)
    return found


def check_value(library: StudyLibrary, name: str, value: float) -> None:
    """Raise LoadError for a value (SI) of ``name`` that is no finite number within the bounds of the variable."""
    if isinstance(value, bool) or not within(value):
        raise LoadError(f"'{name}' cannot be set to {value!r}; give a finite number")
    variable = library.variables[name]
    least = -np.inf if variable.minimum is None else variable.minimum
    greatest = np.inf if variable.maximum is None else variable.maximum
    if not least <= value <= greatest:
        raise LoadError(f"'{name}' cannot be set to {value:.9g}; it is bounded by {least:g} and {greatest:g} (SI)")


def check_given(library: StudyLibrary, name: str) -> None:
    """Raise LoadError if the start of ``name`` is a guess, because constraints determine its value."""
    if library.kinds[name] in STATES and library.variables[name].initial != "exact":
        raise LoadError(
            f"the start of '{name}' is a guess that the constraints of '{library.name}' determine; "
            "choose what they follow from"
        )


def times_of(
    library: StudyLibrary, times: Sequence[float] | Floats | None, stop_time: float | None, step: float | None
) -> Floats:
    """The times (m,) of a run in s: ``times`` or every ``step`` from 0 to ``stop_time``; by default those of the model.

    Raises LoadError for times that do not ascend from 0 on.
    """
    if times is None:
        stop = library.experiment.stop_time if stop_time is None else stop_time
        if not within(stop, above=0):
            raise LoadError(f"the stop time {stop!r} s is not positive and finite")
        if step is not None and not within(step, above=0):
            raise LoadError(f"the step {step!r} s is not positive and finite")
        count = _SAMPLES if step is None else max(1, round(stop / step))
        return np.linspace(0.0, stop, count + 1)
    found = np.atleast_1d(numbers_of("the times of a study", times))
    if found.ndim != 1 or not len(found) or not np.isfinite(found).all() or found[0] < 0 or (np.diff(found) <= 0).any():
        raise LoadError("the times of a study must be finite, at least one, none before 0 s, and ascend")
    return found


def numbers_of(what: str, given: ArrayLike) -> Floats:
    """``given`` as an array of its shape (...); raises LoadError, about ``what``, where it contains no numbers."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise LoadError(f"{what}: no array of numbers, {error}") from error


def signals_of(
    library: StudyLibrary, inputs: Inputs | None, times: Floats, *, hold: bool = False
) -> KnotSignals | None:
    """``inputs`` as ``simulate`` takes them, for runs of ``library`` at ``times`` (m,) in s.

    They are linear between their own times, or held with ``hold``. Raises LoadError for a name that is no input, for a
    motion without its rates, and for one that strikes where it jumps.
    """
    found = trajectory_of(inputs, float(times[-1]) or 1.0, library.experiment.step)
    if found is None:
        return None
    for name in found.names:
        if library.kinds.get(name) != INPUT:
            library.variable(name)
            raise LoadError(f"'{name}' of '{library.name}' is no input; inputs over time are signals of inputs")
        rates = (velocity(name), acceleration(name))
        if all(library.kinds.get(rate) == INPUT for rate in rates) and not set(rates) <= set(found.names):
            raise LoadError(f"the motion '{name}' is given without {' and '.join(rates)}; a study needs all three")
    if hold:
        _check_strokes(library, found, float(times[-1]))
    return KnotSignals(tuple(library.readable(found.names)), found.time, found.values, hold)


def _check_strokes(library: StudyLibrary, held: Trajectory, stop: float) -> None:
    """Raise LoadError for a motion among the ``held`` inputs that strikes before the time ``stop`` (s)."""
    before = held.time < stop
    for name in sorted(library.striking & set(held.names)):
        jumps = np.diff(held[name][before])
        if jumps.any():
            k = int(np.flatnonzero(jumps)[0])
            raise LoadError(
                f"the motion '{name}' of '{library.name}' is held and jumps by {jumps[k]:g} (SI) at "
                f"{held.time[k + 1]:g} s, where it strikes: '{library.solver}' carries no derivatives through that; "
                f"give it without hold, linear between its times, or take {USUAL}"
            )


def continuous_outputs(library: StudyLibrary, outputs: Sequence[str] | None) -> list[str]:
    """The names of ``outputs`` that have a derivative; by default all outputs that are real numbers.

    Raises LoadError for a name that is unknown or stands for a count, a mode or an impulse.
    """
    smooth = {name for name, kind in library.kinds.items() if kind not in _JUMPING}
    if outputs is None:
        return [n for n, v in library.variables.items() if v.causality == "output" and n in smooth]
    check_names("outputs", outputs)
    for name in outputs:
        library.variable(name)
        if name not in smooth:
            raise LoadError(f"'{name}' of '{library.name}' has no derivative: it is a number that events change")
    return list(outputs)


_JUMPING = ("VARIABLE_MODE", "VARIABLE_IMPACTS", "VARIABLE_IMPULSE", "VARIABLE_CLOCK", "VARIABLE_INDICATOR")


def check_over(library: StudyLibrary, over: Sequence[str]) -> None:
    """Raise LoadError for names in ``over`` that are no given starts, parameters or inputs, or stand twice."""
    if not over:
        raise LoadError("there is nothing to vary; name starts, parameters or inputs")
    check_names("over", over)
    for i, name in enumerate(over):
        library.variable(name)
        if library.kinds[name] not in (*STATES, *PARAMETERS, INPUT) or name in over[:i]:
            why = "stands twice" if name in over[:i] else "is no start, independent parameter or input"
            raise LoadError(f"'{name}' of '{library.name}' {why} and cannot be varied")
        check_given(library, name)


def scale_of(library: StudyLibrary, name: str, values: Mapping[str, float]) -> float:
    """A typical size (SI) of ``name``: its value, or where that is 0 its nominal value or 1."""
    variable = library.variables[name]
    value = abs(float(values.get(name, variable.start or 0.0)))
    return value if np.isfinite(value) and value > 0 else variable.nominal or 1.0
