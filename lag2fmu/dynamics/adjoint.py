"""The adjoint program: of a weighted sum of unknowns its derivatives by all knowns, in one reverse sweep.

The tangent functions are linear in their seeds, so that the gradient of the weighted sum of their results by the seeds
is the transposed map: about as many operations, whatever the number of knowns. Accelerations are solved for in between,
with the factorisation of the equations themselves. As it is the tangents that are transposed, adjoint derivatives
agree with them in every mode, at kinks, and in tables.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, sections 3.3 (the duality of tangents and adjoints)
and 15.3 (implicit functions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.graph import Graph, Node

_Weights = Mapping[str, tuple[str, str]]
"""{array of weights: (function, array of its results that they are of)}."""

_CALCULATED: _Weights = {"wdz": ("further_tangent", "d2z"), "wy": ("locals_tangent", "dy")}
_ALL: _Weights = {"wr": ("residual_tangent", "dr"), **_CALCULATED}
_DEPENDENT: _Weights = {"wc": ("dependent_tangent", "dc")}
_MET: _Weights = {"wphi": ("constraints", "phi"), "wv": ("constraints", "v")}
_MATRICES: _Weights = {"wM": ("dynamics", "M"), "wG": ("constraints", "G")}
_SLIDING: _Weights = {"ws": ("friction_tangent", "ds")}


def with_adjoints(program: Program) -> Program:
    """``program`` with the functions that adjoint derivatives take behind the others, which stay as they are.

    They work on a copy of the graph. An array of weights has an entry for each result, and gt (1,), gx, gu, gp, gqdd
    are the derivatives by t, x, u, p, qdd; in gp the entries of modes and switches stay untouched, for these are no
    knowns. Functions of constraints and of rows that slide are there if the mechanism has such.
    """
    graph = program.graph.copy()
    sweeps = _Sweeps(graph, {f.name.removeprefix("mechanism_"): f for f in program.functions}, program)
    found = [
        sweeps.adjoint("unknowns_adjoint", "wdz dz + wy y, further rates and locals,", _CALCULATED, ("dqdd",)),
        sweeps.adjoint("adjoint", "wr r + wdz dz + wy y, r that of mechanism_residual_tangent,", _ALL, _SEEDS),
    ]
    with graph.as_written():  # derivatives of dependent parameters contain no variable but parameters
        found.append(sweeps.adjoint("dependent_adjoint", "wc c, the dependent parameters,", _DEPENDENT, ("dp",)))
    if program.constraints:
        found.append(sweeps.adjoint("constraints_adjoint", "wphi phi + wv v of the constraints", _MET, _VARIABLES))
        what = "wM M + wG G, mass matrix (lower triangle) and constraints' Jacobian,"
        found.append(sweeps.adjoint("matrices_adjoint", what, _MATRICES, _VARIABLES))
    if program.places:
        what = "ws s, the forces of the rows that slide,"
        found.append(sweeps.adjoint("friction_adjoint", what, _SLIDING, (*_SEEDS, "dqdd")))
    return replace(program, graph=graph, functions=(*program.functions, *(f.check(graph) for f in found)))


_VARIABLES = ("t", "x", "u", "p")
_SEEDS = tuple(f"d{name}" for name in _VARIABLES)


class _Sweeps:
    """What the reverse sweeps go through: the functions of ``program`` by name without prefix, on a ``graph``."""

    def __init__(self, graph: Graph, functions: Mapping[str, Function], program: Program) -> None:
        self.graph, self.functions = graph, functions
        self.resting = program.masks + program.switches

    def adjoint(self, name: str, what: str, weights: _Weights, by: tuple[str, ...]) -> Function:
        """The derivatives of the sum of ``weights``, said by ``what``, ``by`` arrays of arguments or of seeds."""
        seeds = dict[Node, Node]()
        of_weights = [self._weigh(f"{name} {array}", array, *place, seeds) for array, place in weights.items()]
        known = [self.functions[function] for function, _ in weights.values() if function in self.functions]
        arguments = {argument.name: argument for function in known for argument in function.arguments}
        places = [array.removeprefix("d") for array in by]
        return Function(
            name=f"mechanism_{name}",
            doc=f"Derivatives of {what} by {', '.join(places)}.",
            arguments=(*(a for a in arguments.values() if not a.name.startswith("d")), *of_weights),
            arrays=tuple(f"g{place}" for place in places),
            results=self._gradient(seeds, [arguments[array] for array in by]),
        )

    def _gradient(self, seeds: Mapping[Node, Node], by: Sequence[Array]) -> tuple[tuple[str, int, Node], ...]:
        """The results of a function: the derivatives of the sum of the ``seeds`` {node: weight} by all entries."""
        places = [(f"g{array.name.removeprefix('d')}", k) for array in by for k in range(len(array.entries))]
        found = reverse(self.graph, seeds, [node for array in by for node in array.entries])
        results = ((place, k, node) for (place, k), node in zip(places, found, strict=True))
        return tuple(result for result in results if result[0] != "gp" or result[1] >= self.resting)

    def _weigh(self, label: str, name: str, function: str, array: str, seeds: dict[Node, Node]) -> Array:
        """The weights, called ``name``, of an ``array`` that a ``function`` fills; adds them to ``seeds`` of nodes.

        It is empty if there is no such function.
        """
        found = self.functions.get(function)
        nodes = {} if found is None else {index: node for filled, index, node in found.results if filled == array}
        weights = tuple(self.graph.symbol(f"{label} {k}") for k in range(1 + max(nodes, default=-1)))
        for index, node in nodes.items():
            seeds[node] = self.graph.add(seeds.get(node, self.graph.zero), weights[index])
        return Array(name, weights)
