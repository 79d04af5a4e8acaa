"""The arguments of a batch of runs, checked and turned into the arrays that compiled code reads and fills."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.codegen.tables import Slot
from lag2fmu.ensemble.batch import WAITS, Batch, Floats
from lag2fmu.ensemble.columns import event_kinds_of, numbers_of, unknown
from lag2fmu.errors import LoadError
from lag2fmu.fmu.builder import VariableTable

LONGEST_PART = 0.02
"""The longest step under error control, as a part of the run; FMUs have the same default."""


@dataclass(frozen=True)
class Asked:
    """The arguments of ``Ensemble.run`` as the user gave them."""

    starts: Mapping[str, ArrayLike]
    parameters: Mapping[str, ArrayLike]
    inputs: Mapping[str, ArrayLike]
    input_times: ArrayLike | None
    hold: bool
    start_time: float
    stop_time: ArrayLike | None
    samples: ArrayLike | int
    outputs: Sequence[str] | None
    extremes: Sequence[str]
    crossings: Sequence[str]
    most_crossings: int
    events: Sequence[str]
    most_events: int
    tolerance: float
    step: ArrayLike
    max_step: ArrayLike


def batch_of(
    asked: Asked, table: VariableTable, events: Mapping[str, int], default_stop: float, *, fixed_step: bool
) -> Batch:
    """The batch that is ``asked`` for; raises LoadError, with name, shape and remedy, for arguments that do not fit.

    ``events`` {name: number in the engine} are those that can be asked for. ``default_stop`` is a stop time in s. A
    method of ``fixed_step`` takes the mechanism's usual step if no step is given.
    """
    _check_choices(asked)
    knot_times = _knot_times(asked)
    inputs = {name: _signal(name, value, asked, len(knot_times)) for name, value in asked.inputs.items()}
    vectors = _vectors(asked, default_stop)
    runs = _count({**vectors, **{f"input '{name}'": rows for name, rows in inputs.items()}})
    start = float(asked.start_time)
    given = {name: _spread(vectors[name], runs) for name in _TIMES}
    stops, steps, longest = _times(asked, given, table.tables.default_solver_step if fixed_step else None)
    outputs = _outputs(asked, table)
    columns = [numbers_of(kind, names, table) for kind, names in _wanted(asked, outputs).items()]
    kinds = event_kinds_of(asked.events, events)
    times = _sample_times(asked, start, float(stops.max()))
    o, e, c, k = (*map(len, columns), len(kinds))
    return Batch(
        hold=asked.hold,
        start_time=start,
        tolerance=float(asked.tolerance),
        starts=_filled(table, "start", ("VARIABLE_STATE", "VARIABLE_MASSLESS"), asked.starts, vectors, runs),
        parameters=_filled(
            table, "parameter", ("VARIABLE_PARAMETER", "VARIABLE_FIXED_PARAMETER"), asked.parameters, vectors, runs
        ),
        stop_times=stops,
        steps=steps,
        longest_steps=longest,
        nominals=np.array(table.tables.nominal_states),
        knot_times=knot_times,
        inputs=_inputs(table, inputs, len(knot_times), runs),
        sample_times=times,
        output_columns=columns[0],
        extreme_columns=columns[1],
        crossing_columns=columns[2],
        event_kinds=kinds,
        finals=np.full((runs, o), np.nan),
        sampled=np.full((runs, len(times), o), np.nan),
        minima=np.full((runs, e), np.inf),
        maxima=np.full((runs, e), -np.inf),
        crossed=np.full((runs, c, asked.most_crossings), np.nan),
        crossing_counts=np.zeros((runs, c), dtype=np.int64),
        event_times=np.empty((runs, k, asked.most_events)),
        event_counts=np.zeros((runs, k), dtype=np.int64),
        reached=np.full(runs, start),
        accepted=np.zeros(runs, dtype=np.int64),
        status=np.full(runs, WAITS, dtype=np.int64),
        next=np.zeros(1, dtype=np.int64),
        reasons=np.zeros(0, dtype="S1"),
    )


def _check_choices(asked: Asked) -> None:
    """Raise LoadError for counts that are no numbers, and for one name where a list of names is expected."""
    for name in ("most_crossings", "most_events"):
        _check_number(name, getattr(asked, name))
    for name in ("outputs", "extremes", "crossings", "events"):
        value = getattr(asked, name)
        _expect(not isinstance(value, str), f"{name} is {value!r}", f"a list of names, [{value!r}]")


_TIMES = ("stop_time", "step", "max_step")


def _vectors(asked: Asked, default_stop: float) -> dict[str, Floats]:
    """{argument: values} of all arguments that are one number, (1,), or one for each run, (r,)."""
    values = {
        **{f"start '{name}'": value for name, value in asked.starts.items()},
        **{f"parameter '{name}'": value for name, value in asked.parameters.items()},
        "stop_time": default_stop if asked.stop_time is None else asked.stop_time,
        "step": asked.step,
        "max_step": asked.max_step,
    }
    return {what: _vector(what, value) for what, value in values.items()}


def _times(asked: Asked, given: Mapping[str, Floats], usual: float | None) -> tuple[Floats, Floats, Floats]:
    """Stop times, steps and longest steps, each (r,) in s; raises LoadError for values that no run can have.

    ``usual`` is the step (s) of a method of fixed step if none is given; it is None for methods of variable step.
    """
    stops, steps, longest = (given[name] for name in _TIMES)
    start = float(asked.start_time)
    _expect(np.isfinite(start), f"start_time is {start:g}", "a finite time in s")
    bad = stops[~(np.isfinite(stops) & (stops > start))]
    _expect(not len(bad), f"stop_time is {bad.min(initial=np.inf):g}", f"finite times, more than {start:g}")
    _expect(2e-15 <= asked.tolerance < 1.0, f"tolerance is {asked.tolerance:g}", "2e-15 to below 1")
    for name, values in (("step", steps), ("max_step", longest)):
        _expect((values >= 0).all(), f"{name} is {values.min():g}", "0, for automatic, or more")
    if usual is None:
        return stops, steps, np.where(longest > 0, longest, LONGEST_PART * (stops - start))
    longest = np.where(longest > 0, longest, np.inf)
    return stops, np.minimum(np.where(steps > 0, steps, usual), longest), longest


def _check_number(name: str, value: object) -> None:
    """Raise LoadError unless ``value`` is a number."""
    counts = isinstance(value, int | np.integer) and not isinstance(value, bool) and value >= 0
    _expect(counts, f"{name} is {value!r}", "a whole number, 0 or more")


def _expect(holds: object, found: str, expected: str) -> None:
    if not holds:
        raise LoadError(f"{found}; expected {expected}")


def _outputs(asked: Asked, table: VariableTable) -> Sequence[str]:
    """The names of the outputs: those that are asked for, or the states if none are."""
    if asked.outputs is not None:
        return asked.outputs
    kinds = {"VARIABLE_STATE", "VARIABLE_MASSLESS"}
    return [slot.name for slot in table.tables.slots if slot.kind in kinds]


def _wanted(asked: Asked, outputs: Sequence[str]) -> dict[str, Sequence[str]]:
    return {"output": outputs, "extreme": asked.extremes, "crossing": asked.crossings}


def names_of(asked: Asked, table: VariableTable) -> tuple[Sequence[str], Sequence[str], Sequence[str]]:
    """The names of the outputs, extremes and crossings, in the order of their columns."""
    return _outputs(asked, table), asked.extremes, asked.crossings


def _numbers(what: str, value: ArrayLike) -> Floats:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise LoadError(f"{what} is {value!r}; expected numbers") from error


def _vector(what: str, value: ArrayLike) -> Floats:
    """``value`` as (r,), or as (1,) where it is one number for all runs."""
    vector = np.atleast_1d(_numbers(what, value))
    _expect(vector.ndim == 1 and len(vector), f"{what} has shape {vector.shape}", "a number, or one for each run")
    return vector


def _knot_times(asked: Asked) -> Floats:
    """The times (k,) in s at which inputs are given; the start time alone if no times are."""
    if asked.input_times is None:
        return np.array([asked.start_time], dtype=np.float64)
    times = _vector("input_times", asked.input_times)
    _expect((np.diff(times) > 0).all(), "input_times do not ascend", "each time to be later than the one before")
    _expect(
        times[0] <= asked.start_time, f"input_times begin at {times[0]:g} s", f"the start time, {asked.start_time:g} s"
    )
    return times


def _signal(name: str, value: ArrayLike, asked: Asked, knots: int) -> Floats:
    """The values of an input at the knots: (r, k), or (1, k) if all runs have the same."""
    if asked.input_times is None:
        return _vector(f"input '{name}'", value)[:, None]
    values = _numbers(f"input '{name}'", value)
    if values.ndim == 2 or values.shape == (knots,):
        rows = np.atleast_2d(values)
        _expect(rows.shape[1] == knots, f"input '{name}' has shape {values.shape}", f"{knots} values, as input_times")
        return rows
    _expect(values.ndim == 0, f"input '{name}' has shape {values.shape}", f"(), ({knots},) or (runs, {knots})")
    return np.full((1, knots), values)


def _count(vectors: Mapping[str, Floats]) -> int:
    """The number of runs; raises LoadError if two arguments have different numbers of values."""
    runs, first = 1, ""
    for what, vector in vectors.items():
        if len(vector) != 1 and runs not in {1, len(vector)}:
            raise LoadError(f"{what} has {len(vector)} values and {first} has {runs}; expected one for each run")
        if len(vector) != 1:
            runs, first = len(vector), what
    return runs


def _spread(vector: Floats, runs: int) -> Floats:
    return np.ascontiguousarray(np.broadcast_to(vector, (runs,)))


def _slots(table: VariableTable, kinds: Iterable[str]) -> dict[str, Slot]:
    return {slot.name: slot for slot in table.tables.slots if slot.kind in kinds}


def _filled(
    table: VariableTable,
    what: str,
    kinds: Sequence[str],
    given: Mapping[str, ArrayLike],
    vectors: Mapping[str, Floats],
    runs: int,
) -> Floats:
    """The values of all starts, or of all parameters, in all runs: (r, number of starts or parameters)."""
    usual = table.tables.start_states if what == "start" else table.tables.start_parameters
    values = np.tile(np.array(usual, dtype=np.float64), (runs, 1))
    slots = _slots(table, kinds)
    for name in given:
        if name not in slots:
            raise unknown(what, name, slots)
        values[:, slots[name].index] = _within(slots[name], vectors[f"{what} '{name}'"], what)
    return values


def _inputs(table: VariableTable, given: Mapping[str, Floats], knots: int, runs: int) -> Floats:
    """The inputs at the knots, (r or 1, k, number of inputs)."""
    rows = runs if any(len(values) > 1 for values in given.values()) else 1
    values = np.tile(np.array(table.tables.start_inputs, dtype=np.float64), (rows, knots, 1))
    slots = _slots(table, ["VARIABLE_INPUT"])
    for name, signal in given.items():
        if name not in slots:
            raise unknown("input", name, slots)
        values[:, :, slots[name].index] = _within(slots[name], signal, "input")
    return values


def _within(slot: Slot, values: Floats, what: str) -> Floats:
    """The ``values`` of a variable; raises LoadError for one beyond its declared range, which its FMU refuses too."""
    low, high = -np.inf if slot.minimum is None else slot.minimum, np.inf if slot.maximum is None else slot.maximum
    beyond = values[(values < low) | (values > high)]
    found = f"{what} '{slot.name}' is {beyond.min(initial=np.inf):g}"
    _expect(not beyond.size, found, f"values in its range, {low:g} to {high:g} (SI)")
    return values


def _sample_times(asked: Asked, start: float, stop: float) -> Floats:
    """The times (k,) in s of the samples; if only their number is given, they are spread from start to stop."""
    if isinstance(asked.samples, int | np.integer):
        _check_number("samples", asked.samples)
        return np.linspace(start, stop, asked.samples)
    times = _numbers("samples", asked.samples).reshape(-1)
    _expect(
        np.ndim(asked.samples) == 1, f"samples is {asked.samples!r}", "a number of samples, or a list of times in s"
    )
    _expect(
        np.isfinite(times).all() and (np.diff(times) > 0).all(),
        "the times of samples do not ascend",
        "each to be later than the one before",
    )
    _expect(
        not len(times) or (times[0] >= start and times[-1] <= stop),
        f"samples reach from {times[0] if len(times) else 0:g} s to {times[-1] if len(times) else 0:g} s",
        f"times from {start:g} s to {stop:g} s",
    )
    return times


def motions_alone(batch: Batch, motions: int) -> bool:
    """Whether some motion has a velocity or an acceleration although its inputs do not change.

    The scalar engine continues such a motion between its inputs, which lanes cannot.
    """
    if not motions:
        return False
    triples = batch.inputs[:, :, batch.inputs.shape[2] - 3 * motions :].reshape(*batch.inputs.shape[:2], motions, 3)
    given = len(batch.knot_times) > 1 and not batch.hold
    return bool(triples[..., 1:].any()) and not given
