"""Remarks of an export for its user: which solver it chose, how this treats vibrations, which starts it moved."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lag2fmu.analysis.stiffness import Vibration, stiffness, undamped_vibrations, without_linear_dampers
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import DEFAULT_SOLVER, STIFF_SOLVER, Method, TimeStepping

_SEEN, _MOST = 1e-9, 6
"""Starts that move by less than _SEEN of their size are not mentioned; of the others at most _MOST are named."""
_STABLE = 2.0
"""An explicit step of second order grows beyond this product of its length and a decay: 1 - z + z**2/2 exceeds 1."""


def moved_starts(mechanism: Mechanism, equations: EquationsOfMotion) -> str:
    """A phrase on the start values that ``equations`` have in place of those of ``mechanism``; "" if none has moved."""
    pairs = zip(mechanism.coordinates, equations.mechanism.coordinates, strict=True)
    moved = [
        f"{new.name} = {new.start:.6g}{f' {new.unit.si_name}' if new.unit and new.unit.si_name else ''}"
        for old, new in pairs
        if abs(new.start - old.start) > _SEEN * max(abs(old.start), new.nominal)
    ]
    shown = [*moved[:_MOST], *(["..."] if len(moved) > _MOST else [])]
    return f"the constraints move the start to {', '.join(shown)}" if moved else ""


def suited_solver(equations: EquationsOfMotion, among: Collection[str]) -> tuple[str, str]:
    """The solver for a mechanism whose user named none, one of ``among``, and a phrase that gives the reason.

    The phrase is "" where the motion about the start gives no reason.
    """
    found = stiffness(equations)
    if found is None:
        return DEFAULT_SOLVER, ""
    if not found.stiff:
        return DEFAULT_SOLVER, "the motion is not stiff at its start"
    reason = f"the motion is stiff at its start, with decays of {found.rate:.2g} /s among {found.pace:.2g} /s"
    if STIFF_SOLVER in among:
        return STIFF_SOLVER, reason
    return DEFAULT_SOLVER, f"{reason}; only --backend c has {STIFF_SOLVER}"


def outruns(equations: EquationsOfMotion, step: float) -> bool:
    """Whether a decay at the start is so fast that time stepping by ``step`` (s) is unstable.

    Linear dampers are stable with any step. Other forces of velocities are those of an explicit midpoint, found in two
    passes. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.2.
    """
    found = stiffness(without_linear_dampers(equations))
    return found is not None and found.rate * step > _STABLE


def damping(found: Sequence[Vibration], method: Method) -> str:
    """A phrase on how ``method`` treats the vibrations ``found`` by ``missed_vibrations``; "" if there are none."""
    if not found:
        return ""
    others = f" and {len(found) - 3} slower ones" if len(found) > 3 else ""
    listed = ", ".join(map(str, found[:3]))
    if method.implicit:
        action, remedy = f"it damps the vibrations of {listed}{others}", "solver_max_step bounds them"
    else:
        action = f"it gets the vibrations of {listed}{others} wrong, or is unstable,"
        remedy = "solver_step sets their length"
    return f"{action} where its steps are longer than an eighth of a period; {remedy}"


def missed_vibrations(equations: EquationsOfMotion, method: Method) -> tuple[Vibration, ...]:
    """The fast undamped vibrations about the start that ``method`` gets wrong if its steps do not resolve them.

    Implicit methods damp them, and methods of fixed step without error control may be unstable.
    """
    steps = isinstance(method, TimeStepping)  # their steps have errors of first order anyway
    return undamped_vibrations(equations) if not steps and (method.implicit or method.error_order == 0) else ()


def steps_over_impacts(mechanism: Mechanism, method: Method) -> str:
    """A phrase that ``method`` resolves impacts all at once; "" if it does not, or if there are no sequential ones."""
    returning = sum(contact.restitution != 0 for contact in mechanism.unilaterals)
    if not isinstance(method, TimeStepping) or mechanism.impacts == "simultaneous" or returning < 2:
        return ""
    return f'solver {method.solver} resolves the impacts of a step at once, as impacts = "simultaneous" does'
