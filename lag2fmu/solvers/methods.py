"""The solvers of co-simulation by name. Each belongs to a family, a folder of templates/runtime/solvers."""

from __future__ import annotations

from dataclasses import dataclass

from lag2fmu.solvers.collocation import COLLOCATIONS, Collocation
from lag2fmu.solvers.tableaus import TABLEAUS, Tableau


@dataclass(frozen=True)
class LinearlyImplicit:
    """A method of fixed cost, written out in the folder ``family`` of the runtime's solvers; letters as in Tableau."""

    solver: str
    title: str
    source: str
    order: int
    family: str
    all_stages: int
    generated_files = ()
    implicit = True
    variational = False
    error_order = 0
    dense_rows = dense_order = 0


Method = Tableau | LinearlyImplicit | Collocation

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
}
"""The solvers of co-simulation, by name."""


def takes(method: Method, kind: str) -> bool:
    """Whether ``method`` works under constraints of this kind; variational ones do under holonomic ones at best."""
    return not (isinstance(method, Collocation) and method.variational) or (kind == "holonomic" and method.holonomic)


STIFF_SOLVER = "radau5"
"""For mechanisms that are stiff at their start, if no solver is asked for; for the others:"""
DEFAULT_SOLVER = "dopri5"
"""By measurement: dop853 takes less time in long communication steps (benchmarks/integrators.py), but 12 evaluations
for 6 of dopri5 in each step where inputs change, as they do in most co-simulations."""
