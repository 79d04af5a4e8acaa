"""Co-simulation by FMI 3.0: communication steps with and without event mode and early return, through fmpy's calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.verify.instances import Instance
from lag2fmu.verify.run import Floats, Plan, Run, Scalar, elements_of, size_of

_TYPES = {"Enumeration": "Int64"}
"""{type of a variable: type of the call that gets it}, where the two differ."""
_PATIENCE = 100_000
"""The most early returns in one communication step; accumulating impacts make many, but not more than that."""


class Reader:
    """Gets the numbers ``names`` of an FMU of FMI 3.0, with one call for each type."""

    def __init__(self, fmu: Any, scalars: Mapping[str, Scalar], names: Sequence[str]) -> None:
        """Look up the place of each number among those of its call."""
        self._calls: list[tuple[Callable[..., list[float]], list[int], int, list[int], list[int]]] = []
        kinds = {name: _TYPES.get(scalars[name].variable.type, scalars[name].variable.type) for name in names}
        for kind in sorted(set(kinds.values())):
            columns = [i for i, name in enumerate(names) if kinds[name] == kind]
            offsets, size = {}, 0
            for i in columns:
                scalar = scalars[names[i]]
                if scalar.reference not in offsets:
                    offsets[scalar.reference] = size
                    size += size_of(scalar.variable)
            rows = [offsets[scalars[names[i]].reference] + scalars[names[i]].element for i in columns]
            self._calls.append((getattr(fmu, f"get{kind}"), [*offsets], size, columns, rows))

    def read(self, row: Floats) -> None:
        """Write the present values into ``row`` (names,)."""
        for get, references, size, columns, rows in self._calls:
            values = get(references, size)
            row[columns] = [values[k] for k in rows]


class Writer:
    """Sets the floating-point numbers ``names`` by FMI 3.0; other elements of arrays get their ``values``."""

    def __init__(
        self, fmu: Any, scalars: Mapping[str, Scalar], names: Sequence[str], values: Mapping[str, float] | None = None
    ) -> None:
        """Look up the place of each number among those of the call."""
        self._set, self._references, self._values = fmu.setFloat64, [], list[float]()
        offsets: dict[int, int] = {}
        for name in names:
            scalar = scalars[name]
            if scalar.reference not in offsets:
                offsets[scalar.reference] = len(self._values)
                self._references.append(scalar.reference)
                self._values += elements_of(scalar.variable, scalars, values or {})
        self._rows = [offsets[scalars[name].reference] + scalars[name].element for name in names]

    def write(self, values: Sequence[float]) -> None:
        """Set the numbers to ``values`` (names,)."""
        for row, value in zip(self._rows, values, strict=True):
            self._values[row] = float(value)
        if self._references:
            self._set(self._references, self._values)


class Inputs:
    """Sets the inputs at the beginning of a step and, if the FMU asks for them, within the step."""

    def __init__(self, instance: Instance, run: Run, plan: Plan) -> None:
        """Let the FMU ask for inputs from now on, unless they are held."""
        self._plan, self._begun = plan, 0.0
        names = plan.pieces.names if plan.pieces is not None else plan.held.names if plan.held is not None else ()
        self._writer = Writer(instance.fmu, plan.scalars, names, run.values)
        self._slack = 1e-9 * float(plan.grid[-1])  # a communication point may be a rounding before a kink
        self._derivatives = np.zeros((4, len(names)))
        instance.asked = self._ask if plan.pieces is not None else None

    def begin(self, t: float) -> None:
        """Set the inputs at the time ``t`` (s), at which a step begins."""
        pieces, held = self._plan.pieces, self._plan.held
        if pieces is not None:
            self._begun, self._derivatives = t, pieces.derivatives(t, self._slack)
            self._writer.write(self._derivatives[0])
        elif held is not None:
            self._writer.write(held.values[int(np.searchsorted(held.time, t, "right")) - 1])

    def _ask(self, t: float) -> None:
        """Set the inputs at ``t`` (s) within the step, by the cubic polynomials that hold until its end."""
        h, d = t - self._begun, self._derivatives
        self._writer.write(d[0] + h * (d[1] + h * (d[2] / 2 + h * d[3] / 6)))


def co_simulation(instance: Instance, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """Make all communication steps; returns the grid (k,), in s, and the values recorded there, (k, outputs).

    The instance has been initialized. Inputs that are not held are given when the FMU asks for them, because FMI 3.0
    has no derivatives of inputs. Raises SimulationError if the FMU ends the simulation or makes no progress. Source:
    FMI 3.0.2 specification, section 4.2.
    """
    fmu, points, row = instance.fmu, plan.points, 0
    if run.events:
        settle(fmu)
        fmu.enterStepMode()
    inputs, reader = Inputs(instance, run, plan), Reader(fmu, plan.scalars, plan.names)
    values = np.empty((len(plan.grid), len(plan.names)))
    for i, t in enumerate(points):
        if t == plan.grid[row]:
            reader.read(values[row])
            row += 1
            if run.progress is not None:
                run.progress(float(t))
        if i + 1 < len(points):
            step_to(fmu, float(t), float(points[i + 1]), inputs.begin, events=run.events)
    return plan.grid, values


def step_to(
    fmu: Any,
    begun: float,
    end: float,
    begin: Callable[[float], None] | None = None,
    *,
    events: bool = False,
    final: bool = True,
) -> None:
    """Step by FMI 3.0 from one communication point to the next, from ``begun`` to ``end`` (s).

    ``begin`` sets inputs at each time from which the FMU goes on. With ``events`` the FMU may stop at events, which are
    handled. ``final``: nobody goes back to a time before. Raises SimulationError if the FMU ends the simulation or
    makes no progress.
    """
    t, stops = begun, 0
    while t < end:
        if begin is not None:
            begin(t)
        event, terminate, early, reached = fmu.doStep(t, end - t, final)
        if terminate:
            raise SimulationError(f"the FMU ended the simulation at t = {reached:.9g} s")
        t, stops = (reached if early else end), stops + 1
        if stops > _PATIENCE:
            raise SimulationError(f"the FMU returned {stops} times from one step, the last time at t = {t:.9g} s")
        if events and event:
            fmu.enterEventMode()
            settle(fmu)
            fmu.enterStepMode()


def settle(fmu: Any) -> None:
    """Event iteration in event mode of FMI 3.0, until the discrete states need no further update.

    Raises SimulationError where they never do, and where the FMU ends the simulation.
    Source: FMI 3.0.2 specification, section 2.3.5 (fmi3UpdateDiscreteStates).
    """
    for _ in range(_PATIENCE):
        needed, terminate, *_ = fmu.updateDiscreteStates()
        if terminate:
            raise SimulationError("the FMU ended the simulation at an event")
        if not needed:
            return
    raise SimulationError(f"the FMU's discrete states do not settle in {_PATIENCE} rounds")
