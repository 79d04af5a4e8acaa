"""Co-simulation by FMI 3.0: communication steps with and without event mode and early return, through fmpy's calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.verify.plan import Floats, Plan, Run
from lag2fmu.verify.scalars import Scalar, size_of, starts_of

_TYPES = {"Enumeration": "Int64"}
"""The types that values are got by, where they are not those of the variable."""
_PATIENCE = 100_000
"""So many early returns may end one communication step; accumulating impacts are many, and more are endless."""


class Reader:
    """Gets the numbers ``names`` of an FMU of FMI 3.0, those of one type in one call."""

    def __init__(self, fmu: Any, scalars: Mapping[str, Scalar], names: Sequence[str]) -> None:
        """Look up where each number is among those of its call."""
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
    """Sets the floating-point numbers ``names`` of an FMU of FMI 3.0; other elements of an array keep their starts."""

    def __init__(self, fmu: Any, scalars: Mapping[str, Scalar], names: Sequence[str]) -> None:
        """Look up where each number is among those of the call."""
        self._set, self._references, self._values = fmu.setFloat64, [], list[float]()
        offsets: dict[int, int] = {}
        for name in names:
            scalar = scalars[name]
            if scalar.reference not in offsets:
                offsets[scalar.reference] = len(self._values)
                self._references.append(scalar.reference)
                self._values += starts_of(scalar.variable, scalars.values())
        self._rows = [offsets[scalars[name].reference] + scalars[name].element for name in names]

    def write(self, values: Sequence[float]) -> None:
        """Set the numbers to ``values`` (names,)."""
        for row, value in zip(self._rows, values, strict=True):
            self._values[row] = float(value)
        if self._references:
            self._set(self._references, self._values)


def co_simulation(fmu: Any, run: Run, plan: Plan) -> tuple[Floats, Floats]:
    """Communication step after communication step: the grid (k,) and what is recorded there, (k, outputs).

    ``fmu`` has been initialized. Inputs are held during a step: FMI 3.0 has no derivatives of them.
    """
    if run.events:
        settle(fmu)
        fmu.enterStepMode()
    held = plan.held
    inputs = Writer(fmu, plan.scalars, held.names if held is not None else ())
    reader, values = Reader(fmu, plan.scalars, plan.names), np.empty((len(plan.grid), len(plan.names)))
    for row, t in enumerate(plan.grid):
        reader.read(values[row])
        if run.progress is not None:
            run.progress(float(t))
        if row + 1 < len(plan.grid):
            inputs.write(held.values[row] if held is not None else ())
            _step(fmu, float(t), float(plan.grid[row + 1]), run.events)
    return plan.grid, values


def _step(fmu: Any, begun: float, end: float, events: bool) -> None:
    """From one communication point to the next; with ``events`` the FMU may stop in between, and they are handled."""
    t, stops = begun, 0
    while t < end:
        event, terminate, early, reached = fmu.doStep(t, end - t)
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
    """Event iteration in event mode of FMI 3.0, until the discrete states need no further update."""
    for _ in range(_PATIENCE):
        needed, terminate, *_ = fmu.updateDiscreteStates()
        if terminate:
            raise SimulationError("the FMU ended the simulation at an event")
        if not needed:
            return
    raise SimulationError(f"the FMU's discrete states do not settle in {_PATIENCE} rounds")
