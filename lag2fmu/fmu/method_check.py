"""Whether a method can integrate a mechanism at all."""

from __future__ import annotations

from lag2fmu.dynamics.massless import determined
from lag2fmu.errors import ExportError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import DEFAULT_SOLVER, METHODS, SMOOTH_METHODS, Method, TimeStepping, takes


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
            f"'{mechanism.name}' has no contacts, stops, dry friction or latches; take {DEFAULT_SOLVER}"
        )
    if light:
        names = ", ".join(mechanism.coordinates[i].name for i in light)
        raise ExportError(
            f"solver '{method.solver}' moves all coordinates by impulses, and mechanism '{mechanism.name}' has some "
            f"without mass ({names}); give them a mass, or take {DEFAULT_SOLVER}"
        )
