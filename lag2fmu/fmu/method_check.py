"""Whether a method can integrate a mechanism at all."""

from __future__ import annotations

from collections.abc import Sequence

from lag2fmu.dynamics.massless import determined
from lag2fmu.errors import ExportError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import (
    BOUNDED,
    DEFAULT_SOLVER,
    METHODS,
    SMOOTH_METHODS,
    STEPPING_SOLVER,
    STIFF_SOLVER,
    Method,
    TimeStepping,
    takes,
)


def check_solver(mechanism: Mechanism, method: Method) -> None:
    """Raise ExportError for a method that does not take the mechanism; the message names methods that do."""
    if isinstance(method, TimeStepping):
        _check_time_stepping(mechanism, method)
    light = [constraint.name for constraint in mechanism.constraints if not takes(method, constraint.kind)]
    if light:
        kinds = {constraint.kind for constraint in mechanism.constraints}
        others = [name for name in SMOOTH_METHODS if all(takes(METHODS[name], kind) for kind in kinds)]
        raise ExportError(
            f"solver '{method.solver}' works on momenta, which do not tell how coordinates without mass move, and "
            f"mechanism '{mechanism.name}' has some ({', '.join(light)}); take one of {', '.join(others)}"
        )


def _check_time_stepping(mechanism: Mechanism, method: TimeStepping) -> None:
    """Time stepping is for rows that modes switch, and knows no coordinates without mass."""
    light = [i for i in determined(mechanism) if i is not None]
    if not mechanism.hybrid:
        raise ExportError(
            f"solver '{method.solver}' steps over impacts with an error of first order, and mechanism "
            f"'{mechanism.name}' has no ideal contacts, stops, dry friction or latches; take {DEFAULT_SOLVER}"
        )
    if light:
        names = ", ".join(mechanism.coordinates[i].name for i in light)
        raise ExportError(
            f"solver '{method.solver}' moves all coordinates by impulses, and mechanism '{mechanism.name}' has some "
            f"without mass ({names}); give them a mass, or take {DEFAULT_SOLVER}"
        )


def check_bounded(mechanism: Mechanism, method: Method, events: Sequence[str]) -> None:
    """Raise ExportError where the work of a step has no bound; the message names what has one.

    ``events`` are the names of the events of its equations.
    """
    if method.error_order > 0:
        raise ExportError(
            f"solver '{method.solver}' takes as many steps as the error of mechanism '{mechanism.name}' asks for, and "
            f"nothing bounds them in real time; take {BOUNDED[DEFAULT_SOLVER]}, or {BOUNDED[STIFF_SOLVER]} where it is "
            f"stiff, or {STEPPING_SOLVER} with contacts, stops and dry friction"
        )
    if mechanism.hybrid and not isinstance(method, TimeStepping):
        raise ExportError(
            f"solver '{method.solver}' ends its steps at the events of mechanism '{mechanism.name}', and nothing "
            f"bounds how many of them come in a step; take {STEPPING_SOLVER}, which takes them within its steps"
        )
    if events and not mechanism.hybrid:
        raise ExportError(
            f"mechanism '{mechanism.name}' has conditions ({', '.join(events[:3])}), at which solver "
            f"'{method.solver}' ends its steps, and nothing bounds how many of them come in a step; write smooth "
            "expressions in their place"
        )
