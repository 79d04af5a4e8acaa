"""The record ``ScalarVariable``: one variable of an FMU, as modelDescription.xml has it."""

from __future__ import annotations

from typing import NamedTuple

from lag2fmu.language.units import Unit


class ScalarVariable(NamedTuple):
    """One ScalarVariable; ``start`` and bounds are in SI units; ``dependencies`` are names, None if not listed.

    ``derivative_of`` names the state whose derivative the variable is; ``state`` marks the continuous states, and
    ``start_dependencies`` are those of the value at the start of a state that constraints may move there. ``type`` is
    Real, Integer or the name of an enumeration, see ``elements``.
    """

    name: str
    value_reference: int
    causality: str
    variability: str
    initial: str | None = None
    start: float | None = None
    unit: Unit | None = None
    doc: str = ""
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    derivative_of: str | None = None
    state: bool = False
    dependencies: tuple[str, ...] | None = None
    start_dependencies: tuple[str, ...] = ()
    type: str = "Real"
