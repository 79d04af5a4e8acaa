"""Whether a method can integrate a mechanism at all."""

from __future__ import annotations

from collections.abc import Sequence

from lag2fmu.dynamics.massless import determined
from lag2fmu.errors import ExportError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.collocation import Collocation
from lag2fmu.solvers.methods import DEFAULT_SOLVER, METHODS, SMOOTH_METHODS, Method, TimeStepping, takes


def check_solver(mechanism: Mechanism, method: Method) -> None:
    """Raise ExportError for a method that does not take the mechanism; the message names methods that do."""
    if isinstance(method, TimeStepping):
        _check_time_stepping(mechanism, method)
    if mechanism.hybrid and isinstance(method, Collocation) and method.variational:
        _check_impacts(mechanism, method)
    kinds = sorted({c.kind for c in mechanism.constraints if not takes(method, c.kind)})
    if kinds:
        raise _refused(mechanism, method, kinds)


def _refused(mechanism: Mechanism, method: Method, kinds: Sequence[str]) -> ExportError:
    """The error that a variational ``method`` does not take constraints of these ``kinds``."""
    kinds_there = {c.kind for c in mechanism.constraints}
    others = [name for name in SMOOTH_METHODS if all(takes(METHODS[name], kind) for kind in kinds_there)]
    listed = ", ".join(c.name for c in mechanism.constraints if c.kind in kinds)
    action = "under holonomic constraints only" if takes(method, "holonomic") else "without constraints"
    return ExportError(
        f"solver '{method.solver}' discretises an action {action}, and mechanism '{mechanism.name}' has "
        f"{' and '.join(kinds)} ones ({listed}); take one of {', '.join(others)}"
    )


def _check_impacts(mechanism: Mechanism, method: Collocation) -> None:
    """A contact that stays closed is a holonomic constraint of the action; friction and latches belong to no action."""
    rubbing = [contact.where for contact in mechanism.unilaterals if contact.slips]
    rubbing += [f"frictions.{friction.name}" for friction in mechanism.frictions]
    rubbing += [f"constraints.{latch.kind}.{latch.name}" for latch in mechanism.latches]
    if method.holonomic and not rubbing:
        return
    others = [name for name, other in METHODS.items() if not (isinstance(other, Collocation) and other.variational)]
    if rubbing:
        what = f"and the forces of {', '.join(rubbing)} belong to none"
    else:
        what = "and takes no constraint, which a contact or stop is while it is closed"
        others = [name for name in METHODS if takes(METHODS[name], "holonomic")]
    raise ExportError(
        f"solver '{method.solver}' discretises an action, {what} (mechanism '{mechanism.name}'); take one of "
        f"{', '.join(others)}"
    )


def _check_time_stepping(mechanism: Mechanism, method: TimeStepping) -> None:
    """Time stepping is for rows that modes switch, and knows no coordinates without mass."""
    light = [i for i in determined(mechanism) if i is not None]
    if not mechanism.hybrid:
        raise ExportError(
            f"solver '{method.solver}' steps over impacts with an error of first order, and mechanism "
            f"'{mechanism.name}' has no contacts, stops, dry friction or latches; take {DEFAULT_SOLVER}"
        )
    if light:
        names = ", ".join(mechanism.coordinates[i].name for i in light)
        raise ExportError(
            f"solver '{method.solver}' moves all coordinates by impulses, and mechanism '{mechanism.name}' has some "
            f"without mass ({names}); give them a mass, or take {DEFAULT_SOLVER}"
        )
