"""The solvers of co-simulation by name: data for the explicit ones, a file of the runtime for each of the others."""

from __future__ import annotations

from dataclasses import dataclass

from lag2fmu.codegen.tableaus import TABLEAUS, Row, Tableau


@dataclass(frozen=True)
class LinearlyImplicit:
    """A method of fixed cost that is written out in ``source_file`` of the runtime; the letters as in Tableau."""

    solver: str
    title: str
    source: str
    order: int
    source_file: str
    all_stages: int
    implicit = True
    error_order = 0
    dense: tuple[Row, ...] = ()
    dense_order = 0


Method = Tableau | LinearlyImplicit

METHODS: dict[str, Method] = {
    **TABLEAUS,
    "ros2": LinearlyImplicit(
        solver="ros2",
        title="ROS2, linearly implicit, order 2, L-stable, fixed step",
        source="J. G. Verwer, E. J. Spee, J. G. Blom, W. Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456-1480",
        order=2,
        source_file="solver_ros2.c",
        all_stages=2,
    ),
}
"""The solvers of co-simulation, by name."""

DEFAULT_SOLVER = "dopri5"
"""By measurement: dop853 takes less time in long communication steps (benchmarks/integrators.py), but 12 evaluations
for 6 of dopri5 in each step where inputs change, as they do in most co-simulations."""
