"""The record of the derived equations: what each stage after the derivation reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from lag2fmu.description import names
from lag2fmu.dynamics.blocks import united
from lag2fmu.dynamics.parts import Constraints, Energies, Entries, RowNumbers, Solution, Variables
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.record import Mechanism

_Equations = TypeVar("_Equations", bound="EquationsOfMotion")


@dataclass(frozen=True, eq=False)
class EquationsOfMotion:
    """M qdd = forcing + G^T multiplier and what follows from it; all entries are nodes of ``graph``, in SI units.

    Equations equal themselves alone, so that what is derived from them can be kept by them.

    ``completed`` is the given mechanism with what derivation adds: nominal values, and equilibria of coordinates
    without mass. ``mechanism`` is the same with start values that meet its constraints.

    - ``entries``: the quadratic form 2 T2 over the velocity graph.
    - ``forcing``: (n,).
    - ``solution``: M^-1 forcing (n,) with its pivots, by ``method``. It is None if every order of elimination meets a
      pivot that is identically zero.
    - ``constraints``: m equations; ``permanent``: those of them that hold in all modes, which at first are all.
    - ``rows``: what modes switch on and off, see ``modes``.
    - ``outputs`` and ``dependent`` parameters: {name: node}.
    - ``parts``: energies and forces as composed.
    - ``mass_matrix``: M (n, n), which is d2L/dqd2 and what ``parts.carried`` adds to make it regular.
    - ``residual``: (n + m,), M qdd - forcing - G^T multiplier, and behind it the constraints' accelerations. The
      accelerations qdd and the multipliers are variables in it.
    - ``momenta``: p = dL/dqd, (n,).
    - ``drives``: the force that carries each prescribed motion, and each coordinate among the ports' drives, (k,);
      ``powers``: what these drives put in (W), (k,).
    - ``energies``: the energies (J) and the power of the external inputs (W) by name, see ``terms.named_energies``.

    The graph is sealed: code that adds nodes works on the copy that ``apart`` returns.
    """

    mechanism: Mechanism
    completed: Mechanism
    method: str
    graph: Graph
    variables: Variables
    entries: Entries
    forcing: tuple[Node, ...]
    solution: Solution | None
    constraints: Constraints
    permanent: Constraints
    rows: RowNumbers
    outputs: Mapping[str, Node]
    dependent: Mapping[str, Node]
    parts: Energies
    mass_matrix: tuple[tuple[Node, ...], ...]
    residual: tuple[Node, ...]
    momenta: tuple[Node, ...]
    drives: tuple[Node, ...]
    powers: tuple[Node, ...]
    energies: Mapping[str, Node]

    def apart(self: _Equations) -> _Equations:
        """The same equations on a copy of the graph, to which nodes can be added."""
        return replace(self, graph=self.graph.copy())

    @property
    def forces(self) -> tuple[str, ...]:
        """The names of the forces that the rows bear, which modes switch."""
        return tuple(str(self.graph.leaf[node]) for node in self.variables.forces)

    @property
    def operations(self) -> int:
        """The number of arithmetic operations that the accelerations take."""
        return self.graph.operations(self.solution.x if self.solution else self.forcing)

    def locals(self) -> Iterator[tuple[str, Node]]:
        """(name, node) of everything that is calculated beside the accelerations: momenta, energies, power, outputs.

        Values are in SI units.
        """
        for coordinate, momentum in zip(self.mechanism.coordinates, self.momenta, strict=True):
            yield names.momentum(coordinate.name), momentum
        for motion, drive in zip(carried(self.mechanism), self.drives, strict=True):
            yield names.drive(motion), drive
        for motion, power in zip(carried(self.mechanism), self.powers, strict=True):
            yield names.drive_power(motion), power
        yield from self.energies.items()
        yield from self.outputs.items()
        for constraint, residual in zip(self.mechanism.constraints, self.permanent.residuals, strict=True):
            yield names.residual(constraint.name), residual
        for contact, gap in zip(self.mechanism.unilaterals, self.rows.gaps, strict=True):
            yield names.gap(contact.name), gap

    def unknown_dependencies(self) -> tuple[frozenset[str], ...]:
        """The names of the variables each acceleration and multiplier depends on, (n + m,): those of its block."""
        g, c, n = self.graph, self.constraints, len(self.forcing)
        matrix = [*([*row] for row in self.mass_matrix), *([*row] for row in c.jacobian)]
        entries = [[self.forcing[i], *self.mass_matrix[i]] for i in range(n)]
        rows = g.symbols_of_each([*entries, *([*c.equation(k), *c.jacobian[k]] for k in range(len(c)))])
        blocks = united({i, *(j for j in range(n) if row[j] != g.zero)} for i, row in enumerate(matrix))
        rates = {str(g.leaf[node]) for node in self.variables.rates}
        names_of = {i: frozenset().union(*(rows[j] for j in block)) - rates for block in blocks for i in block}
        return tuple(names_of[i] for i in range(len(rows)))
