"""Gradients through time: the derivatives of one number of a run by many starts, parameters and inputs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.language.given import check_mapping
from lag2fmu.language.identifiers import suggestion
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.costs import INTEGRAL, Cost, Expression, parts_of, with_integral
from lag2fmu.studies.library import INPUT, PARAMETERS, StudyLibrary, compiled
from lag2fmu.studies.requests import (
    check_over,
    continuous_outputs,
    numbers_of,
    references_of,
    scale_of,
    signals_of,
    times_of,
)
from lag2fmu.studies.sensitivities import TOLERANCE, directed_run
from lag2fmu.studies.tape import Tape
from lag2fmu.verify.inputs import Inputs
from lag2fmu.verify.plan import check_tolerance


@dataclass(frozen=True, eq=False)
class Gradient:
    """The ``value`` of a cost, and its ``derivatives`` (d,) by the names ``over`` (d), in SI units."""

    value: float
    over: tuple[str, ...]
    derivatives: Floats = field(repr=False)

    def __getitem__(self, name: str) -> float:
        """The derivative by ``name``; raises LoadError for an unknown one."""
        if name not in self.over:
            raise LoadError(f"there is no derivative by '{name}'; {suggestion(name, self.over)}")
        return float(self.derivatives[self.over.index(name)])


@telling("differentiating a run")
def gradient(  # noqa: PLR0913 (those of sensitivities)
    model: object,
    cost: Cost,
    *,
    over: Sequence[str],
    data: Mapping[str, ArrayLike] | None = None,
    times: Sequence[float] | Floats | None = None,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float = TOLERANCE,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    solver: str | None = None,
) -> Gradient:
    """The ``cost`` of a run of ``model``, and its derivatives by the names ``over``, however many there are.

    ``cost`` is an expression of variables at the end of the run, such as "x_tip**2", or a mapping of places to
    expressions, which add up: "end"; "sum", over all ``times``; "integral", over the time of the run. In the first
    two any variable may stand, and time t; in an integral what a mechanism may contain: coordinates, velocities,
    inputs, parameters, and outputs that are expressions of those. ``data`` {name: values (m,) at the times, SI} are
    further names in a sum, as measurements are.

    All else is as for ``sensitivities``. The run is taken once, and followed backwards step by step: the derivatives
    are those of the very numbers that the solver gave, and cost a few runs, not one for each name. At impacts, stops
    and switches they jump as the motion demands. Where an event leaves no derivative along some direction, directions
    that the names do not move are left out, by ``sensitivities``.

    Raises LoadError for bad arguments, such as a cost of parameters that do not vary, ExpressionError for an
    expression that cannot be read, and SimulationError where the run fails or has no derivative. Source: A. Griewank,
    A. Walther, Evaluating Derivatives, SIAM 2008, chapters 3 and 12.
    """
    parts = parts_of(cost)
    library = compiled(with_integral(as_mechanism(model), parts.get("integral")), solver=solver, adjoints=True)
    check_over(library, over)
    taken = times_of(library, times, stop_time, step)
    check_mapping("data", data or {})
    summed = _Sum(library, over, parts, taken, data or {})
    run = _CostedRun(library, over, summed, taken, check_tolerance(tolerance), values or {}, inputs, hold)
    total, derivatives = run.differentiated()
    return Gradient(total, tuple(over), derivatives)


class _Sum:
    """The cost as a function of samples: the terms of a sum over them, those at the end, and the integral there."""

    def __init__(
        self,
        library: StudyLibrary,
        over: Sequence[str],
        parts: Mapping[str, str],
        times: Floats,
        data: Mapping[str, ArrayLike],
    ) -> None:
        """Read the ``parts`` {place: expression}; raises LoadError for unknown names and where none of ``over`` counts.

        ``given``: which outputs are no result of a run, but parameters and inputs.
        """
        self.times, self.name = times, library.name
        self.terms = {place: Expression(text, place) for place, text in parts.items() if place != "integral"}
        if "integral" in parts:
            self.terms["integral"] = Expression(INTEGRAL, "integral")
        self.data = {name: _column(library, name, column, len(times)) for name, column in data.items()}
        names = dict.fromkeys(name for term in self.terms.values() for name in term.names if name not in self.data)
        self.outputs = continuous_outputs(library, list(names))
        if not self.outputs:
            raise LoadError(f"the cost contains no variable of '{library.name}', so nothing changes it")
        self.given = np.array([library.kinds[name] in (*PARAMETERS, INPUT) for name in self.outputs])
        if self.given.all() and not set(self.outputs) & set(over):
            raise LoadError(f"the cost of '{library.name}' does not depend on {', '.join(over)}; choose other names")

    def __call__(self, samples: Floats) -> tuple[float, Floats]:
        """The cost for ``samples`` (m, k) of the outputs, and its derivatives (m, k) by them.

        Raises SimulationError where it has no finite value or derivative.
        """
        columns = {**dict(zip(self.outputs, samples.T, strict=True)), **self.data}
        total, weights = 0.0, np.zeros_like(samples)
        for place, term in self.terms.items():
            rows = slice(None) if place == "sum" else slice(-1, None)
            found, slopes = term({name: columns[name][rows] for name in term.names}, self.times[rows])
            total += float(found.sum())
            for name in set(term.names) & set(self.outputs):
                weights[rows, self.outputs.index(name)] += slopes[name]
        if not (np.isfinite(total) and np.isfinite(weights).all()):
            raise SimulationError(f"'{self.name}': the cost has no finite value or derivative at some sample")
        return total, weights


def _column(library: StudyLibrary, name: str, given: ArrayLike, count: int) -> Floats:
    """A column (m,) of data; raises LoadError for a name that is taken, another length, and gaps."""
    found = numbers_of(f"data '{name}'", given)
    if name in library.variables:
        raise LoadError(f"data '{name}' has the name of a variable of '{library.name}'; give it another one")
    if found.shape != (count,):
        raise LoadError(f"data '{name}' has shape {found.shape}; give one value for each of the {count} times")
    if not np.isfinite(found).all():
        at = int(np.flatnonzero(~np.isfinite(found))[0])
        raise LoadError(f"data '{name}' is {found[at]:g} at index {at}; leave out the times of gaps")
    return found


@dataclass(frozen=True)
class _CostedRun:
    """A run whose cost is asked for, and what varies."""

    library: StudyLibrary
    over: Sequence[str]
    cost: _Sum
    times: Floats
    tolerance: float
    values: Mapping[str, float]
    inputs: Inputs | None
    hold: bool

    def differentiated(self) -> tuple[float, Floats]:
        """The cost, and its derivatives (d,)."""
        tape = Tape(self.library, len(self.over))
        samples, reason = tape.record(
            references_of(self.library, self.values),
            self.times,
            self.library.readable(self.cost.outputs),
            tolerance=self.tolerance,
            signals=signals_of(self.library, self.inputs, self.times, hold=self.hold),
            seeds=[(self.library.settable(name), scale_of(self.library, name, self.values)) for name in self.over],
        )
        if reason:
            return self._forward()
        total, weights = self.cost(samples)
        derivatives, reason = tape.gradient(np.where(self.cost.given, 0.0, weights))
        if reason:
            raise SimulationError(f"'{self.library.name}': the run has no gradient: {reason}")
        return total, derivatives + self._direct(weights)

    def _direct(self, weights: Floats) -> Floats:
        """What the cost changes by, (d,), with the parameters and inputs that stand in it."""
        sums = dict(zip(self.cost.outputs, weights.sum(axis=0) * self.cost.given, strict=True))
        return np.array([sums.get(name, 0.0) for name in self.over])

    def _forward(self) -> tuple[float, Floats]:
        """The same by directions along what varies alone; raises SimulationError where these fail too."""
        found = directed_run(self.library, self.over, self.cost.outputs, values=self.values, times=self.times,
                             tolerance=self.tolerance, inputs=self.inputs, hold=self.hold)  # fmt: skip
        if found.reason:
            raise SimulationError(f"'{self.library.name}': the run has no gradient: {found.reason}")
        total, weights = self.cost(found.result.values)
        slopes = np.where(self.cost.given[:, None], 0.0, found.result.derivatives)
        return total, np.einsum("mk,mkd->d", weights, slopes) + self._direct(weights)
