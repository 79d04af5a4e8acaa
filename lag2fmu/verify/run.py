"""The records of a run of an FMU: the user's choices, the plan that follows for the FMU, and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.signals import Pieces
from lag2fmu.reference.trajectory import Trajectory

Floats = NDArray[np.float64]


Kind = Literal["co-simulation", "model-exchange"]


@dataclass(frozen=True)
class Feedback:
    """A sampled controller: ``law``(t, y) gives {input: SI value}, every ``sample_time`` (s), held until the next one.

    y is {output: value} of all outputs of the FMU and of what is recorded.
    """

    law: Callable[[float, Mapping[str, float]], Mapping[str, Any]]
    sample_time: float


@dataclass(frozen=True)
class Run:
    """The user's choices of a run; those that are not given are taken from the FMU's DefaultExperiment.

    - ``start_time``, ``stop_time``, ``step``: the begin and end of the run, and the communication step, in s; a start
      of 0 gives way to that of the FMU's experiment.
    - ``tolerance``: the relative tolerance of the solver.
    - ``values``: start values of parameters, states and inputs, in SI units.
    - ``inputs``: signals, linear between their times; a motion that is given by position alone is a spline.
    - ``feedback``: computes inputs from outputs during the run, instead of ``inputs``.
    - ``hold``: inputs keep their values during a communication step.
    - ``outputs``: the names that are recorded, by default all outputs; "all" among them: every local variable, too.
    - ``beside``: further names that are recorded if the FMU has them.
    - ``progress``: called with the time reached (s).
    - ``warned``: called with each warning of the FMU, which is logged otherwise.
    - ``recorded``: called with each row that the run of a system records: names (k,), the time (s), values (k,).
    - ``events``: co-simulation by FMI 3.0 uses event mode and early return.
    """

    stop_time: float | None = None
    step: float | None = None
    tolerance: float | None = None
    values: Mapping[str, float] | None = None
    inputs: Trajectory | None = None
    hold: bool = False
    outputs: Sequence[str] | None = None
    beside: Sequence[str] = ()
    kind: Kind = "co-simulation"
    progress: Callable[[float], None] | None = None
    warned: Callable[[str], None] | None = None
    recorded: Callable[[Sequence[str], float, Sequence[float]], None] | None = None
    events: bool = False
    start_time: float = 0.0
    feedback: Feedback | None = None


@dataclass(frozen=True)
class Plan:
    """A run that was checked: the ``grid`` of communication points (k,), in s, the ``names`` recorded, the inputs.

    ``scalars`` are all numbers of the FMU by name. ``pieces`` are the inputs between communication points; None without
    inputs, and for held ones.
    """

    grid: Floats
    names: Sequence[str]
    scalars: Mapping[str, Scalar]
    pieces: Pieces | None
    held: Trajectory | None

    @property
    def points(self) -> Floats:
        """The communication points with those between them where inputs have kinks, (m,)."""
        if self.pieces is None:
            return self.grid
        grid, breaks = self.grid, self.pieces.breaks
        nearest = grid[np.searchsorted((grid[1:] + grid[:-1]) / 2, breaks)]
        return np.union1d(grid, breaks[np.abs(breaks - nearest) > 1e-9 * grid[-1]])


@dataclass(frozen=True)
class Scalar:
    """A number of an FMU: the ``element`` of ``variable``, as fmpy reads it, with its ``start`` value if it has one."""

    name: str
    variable: Any
    element: int
    start: float | None

    @property
    def reference(self) -> int:
        """The value reference of the variable."""
        return int(self.variable.valueReference)


def size_of(variable: Any) -> int:
    """How many numbers a variable has."""
    size = 1
    for dimension in getattr(variable, "shape", None) or ():
        size *= int(dimension)
    return size


def whole(values: Mapping[str, float], scalars: Mapping[str, Scalar]) -> dict[str, float | list[float]]:
    """``values`` of scalars by variable: those of an array as a list, in which other elements have their starts.

    What is no scalar, as a text, stays as it is.
    """
    found: dict[str, float | list[float]] = {name: value for name, value in values.items() if name not in scalars}
    for name, value in values.items():
        if name in found:
            continue
        variable = scalars[name].variable
        is_array = bool(getattr(variable, "shape", ()))
        found[variable.name if is_array else name] = elements_of(variable, scalars, values) if is_array else value
    return found


def elements_of(variable: Any, scalars: Mapping[str, Scalar], values: Mapping[str, float]) -> list[float]:
    """All elements of ``variable``: those in ``values``, others at their starts, 0 where there are none."""
    found = [0.0] * size_of(variable)
    for name, scalar in scalars.items():
        if scalar.variable is variable:
            found[scalar.element] = values.get(name, scalar.start or 0.0)
    return found


def first_inputs(plan: Plan) -> dict[str, float]:
    """The inputs at the start."""
    if plan.pieces is not None:
        return dict(zip(plan.pieces.names, plan.pieces.values(float(plan.grid[0])), strict=True))
    return {} if plan.held is None else dict(zip(plan.held.names, plan.held.values[0].tolist(), strict=True))
