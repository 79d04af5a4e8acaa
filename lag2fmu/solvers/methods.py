"""The solvers of co-simulation by name. Each belongs to a family, a folder of templates/engine/integrate/methods."""

from __future__ import annotations

from typing import NamedTuple

from lag2fmu.solvers.collocation import COLLOCATIONS, Collocation
from lag2fmu.solvers.tableaus import TABLEAUS, Tableau


class LinearlyImplicit(NamedTuple):
    """A method of fixed cost, written out in the folder ``family`` of the engine's solvers; letters as in Tableau."""

    solver: str
    title: str
    source: str
    order: int
    family: str
    all_stages: int
    generated_files: tuple[str, ...] = ()
    implicit: bool = True
    variational: bool = False
    error_order: int = 0
    dense_rows: int = 0
    dense_order: int = 0


class TimeStepping(NamedTuple):
    """A method whose steps contain impacts and changes of modes, in the folder ``family``; letters as in Tableau."""

    solver: str
    title: str
    source: str
    order: int
    family: str
    all_stages: int = 1
    generated_files: tuple[str, ...] = ("row_tables.h", "row_tables.c")
    implicit: bool = False
    variational: bool = False
    error_order: int = 0
    dense_rows: int = 0
    dense_order: int = 0


Method = Tableau | LinearlyImplicit | Collocation | TimeStepping

METHODS: dict[str, Method] = {
    **TABLEAUS,
    "ros2": LinearlyImplicit(
        solver="ros2",
        title="ROS2, linearly implicit, order 2, L-stable, fixed step",
        source="J. G. Verwer, E. J. Spee, J. G. Blom, W. Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456-1480",
        order=2,
        family="ros2",
        all_stages=2,
    ),
    **COLLOCATIONS,
    "moreau": TimeStepping(
        solver="moreau",
        title="Moreau-Jean time stepping over impacts and changes of modes, fixed step",
        source="M. Jean, The non-smooth contact dynamics method, Comput. Methods Appl. Mech. Eng. 177 (1999) 235-257",
        order=1,
        family="moreau",
    ),
}
"""The solvers of co-simulation, by name."""

SMOOTH_METHODS = tuple(name for name, method in METHODS.items() if not isinstance(method, TimeStepping))
"""The names of the solvers that take mechanisms without contacts, stops and dry friction."""


def takes(method: Method, kind: str) -> bool:
    """Whether ``method`` takes constraints of this ``kind``.

    Methods on momenta take no coordinates without mass, because a momentum does not determine their velocities.
    """
    return not (isinstance(method, Collocation) and method.variational) or not kind.endswith("equilibrium")


STIFF_SOLVER = "radau5"
"""The solver of mechanisms that are stiff at their start, if the user names none."""
DEFAULT_SOLVER = "dopri5"
"""The solver of all other mechanisms, if the user names none.

dop853 takes less time in long communication steps, as benchmarks/integrators.py measures. But if inputs change in each
step, as in most co-simulations, dop853 needs 12 evaluations for a step and dopri5 needs 6.
"""
STEPPING_SOLVER = "moreau"
"""The solver of contacts, stops and dry friction where the steps have to be bounded, in real time."""
BOUNDED = {DEFAULT_SOLVER: "rk4", STIFF_SOLVER: "ros2"}
"""{solver: the one that takes its place where the steps have to be bounded}."""
