"""Equations and their program for an FMU or a page, with the solver that the user names or that suits."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from lag2fmu.analysis.stiffness import Vibration
from lag2fmu.codegen.tables import Vibrations
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.dynamics.massless import determined
from lag2fmu.dynamics.program import lower
from lag2fmu.fmu.advice import missed_vibrations, outruns, suited_solver
from lag2fmu.fmu.method_check import check_bounded, check_solver
from lag2fmu.fmu.runtime_tables import default_solver_step
from lag2fmu.fmu.variables import promotable
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import BOUNDED, METHODS, STEPPING_SOLVER, TimeStepping

_MANY = 24
"""Contacts from which on impacts are stepped over: each event costs more with each of them."""


class Derived(NamedTuple):
    """The complete mechanism, its equations and program, and the name of the solver.

    ``choice`` is a phrase on why this solver was chosen, ``reason`` one on the motion at the start. ``missed`` are the
    vibrations (rad/s) that the solver gets wrong if its steps do not resolve them.
    """

    mechanism: Mechanism
    equations: EquationsOfMotion
    program: Program
    solver: str
    choice: str
    reason: str
    missed: tuple[Vibration, ...]

    @property
    def vibrations(self) -> Vibrations:
        """The missed vibrations, as the C code takes them: (frequency in rad/s, index of the coordinate)."""
        index = {c.name: i for i, c in enumerate(self.mechanism.coordinates)}
        return tuple((v.frequency, index[v.coordinate]) for v in self.missed)


def derived(
    mechanism: Mechanism,
    solver: str | None,
    among: Collection[str] = tuple(METHODS),
    outputs: Sequence[str] = (),
    *,
    events: bool = False,
    bounded: bool = False,
) -> Derived:
    """Derive and lower ``mechanism`` for a solver, by default the one that suits ``among`` those of a backend.

    ``outputs`` and ``events`` are those of ``promotable``. ``bounded``: the steps have to be, in real time. Raises
    DerivationError if the mechanism cannot be derived, ExportError for a solver that cannot integrate it, and for
    unknown outputs.
    """
    equations = derive(mechanism)
    solver, choice, reason = chosen_solver(equations, solver, among, bounded=bounded)
    check_solver(equations.mechanism, METHODS[solver])
    method = METHODS[solver]
    promoted = promotable(equations, outputs, events=events)
    program = lower(equations, promoted, method.variational, isinstance(method, TimeStepping))
    if bounded:
        check_bounded(equations.mechanism, method, [event.name for event in program.event_functions])
    missed = missed_vibrations(equations, method)
    return Derived(with_derived(mechanism, equations), equations, program, solver, choice, reason, missed)


def chosen_solver(
    equations: EquationsOfMotion, named: str | None, among: Collection[str] = tuple(METHODS), *, bounded: bool = False
) -> tuple[str, str, str]:
    """The solver that the user ``named`` or that suits, why it was chosen, and what is known of the start's motion.

    It is one ``among`` those of a backend; ``bounded``: its steps have to be, in real time.
    """
    if bounded and named is None and equations.mechanism.hybrid:
        return STEPPING_SOLVER, "its steps contain impacts", ""
    touching = sum(contact.law == "ideal" for contact in equations.mechanism.contacts)
    heavy = all(i is None for i in determined(equations.mechanism))
    stepped = named is None and touching >= _MANY and STEPPING_SOLVER in among and heavy
    if stepped and not outruns(equations, default_solver_step(equations.mechanism)):
        return STEPPING_SOLVER, f"its steps take impacts at {touching} contacts at once", ""
    if named is not None and isinstance(METHODS[named], TimeStepping):
        return named, "", ""  # its step is for the user to choose, too
    suited, reason = suited_solver(equations, among)
    suited = BOUNDED[suited] if bounded else suited
    return (named, "", reason) if named else (suited, reason, reason)
