"""The adjoint program: the derivatives of a weighted sum of unknowns by all knowns, in one reverse sweep.

A tangent function is linear in its seeds. The gradient of a weighted sum of its results by the seeds is therefore the
transposed map. It takes about as many operations as the function, whatever the number of knowns. Accelerations are
solved for in between, with the factorisation of the equations themselves. Adjoint derivatives agree with the tangents,
which they transpose, in every mode, at kinks, and in tables.
Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, sections 3.3 (the duality of tangents and adjoints)
and 15.3 (implicit functions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lag2fmu.dynamics.balance import VALUES
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.graph import Graph, Node

_Weights = Mapping[str, tuple[str, str]]
"""{array of weights: (function, the array of its results that the weights belong to)}."""

_RATES: _Weights = {"wdz": ("further_tangent", "d2z")}
_LOCALS: _Weights = {"wy": ("locals_tangent", "dy")}
_MOTION: _Weights = {"wr": ("residual_tangent", "dr"), **_RATES}
_DEPENDENT: _Weights = {"wc": ("dependent_tangent", "dc")}
_MET: _Weights = {"wphi": ("constraints", "phi"), "wv": ("constraints", "v")}
_MATRICES: _Weights = {"wM": ("dynamics", "M"), "wG": ("constraints", "G")}
_BALANCE: _Weights = {f"w{name}": ("balance", name) for name in VALUES}
_SLIDING: _Weights = {"ws": ("friction_tangent", "ds")}


def with_adjoints(program: Program) -> Program:
    """``program`` with the functions of adjoint derivatives added behind its own, which stay as they are.

    The added functions work on a copy of the graph. An array of weights has an entry for each result. The results gt
    (1,), gx, gu, gp, gqdd are the derivatives by t, x, u, p, qdd and have their lengths. The entries of gp for switches
    stay untouched, because switches are no knowns; those for modes count where latches hold places. There are functions
    of constraints, and of rows that slide, if the mechanism has constraints, and such rows, and one of the balance of
    momenta if the program has that (``balance.with_balance``). Raises DerivationError as
    ``Function.check`` does.
    """
    graph = program.graph.copy()
    sweeps = _Sweeps(graph, {f.name.removeprefix("mechanism_"): f for f in program.functions}, program)
    found = [
        sweeps.adjoint(
            "unknowns_adjoint", "wdz dz + wy y, further rates and locals,", {**_RATES, **_LOCALS}, ("dqdd",)
        ),
        sweeps.adjoint("adjoint", "wr r + wdz dz, r that of mechanism_residual_tangent,", _MOTION, _SEEDS),
        sweeps.adjoint("locals_adjoint", "wy y, the locals,", _LOCALS, _SEEDS),
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
    if "balance" in sweeps.functions:
        what = "the sum of what mechanism_balance gives, each by its weights,"
        found.append(sweeps.adjoint("balance_adjoint", what, _BALANCE, _VARIABLES))
    return program._replace(graph=graph, functions=(*program.functions, *(f.check(graph) for f in found)))


_VARIABLES = ("t", "x", "u", "p")
_SEEDS = tuple(f"d{name}" for name in _VARIABLES)


class _Sweeps:
    """Makes the reverse sweeps through the functions of ``program``, which are known by name without prefix."""

    def __init__(self, graph: Graph, functions: Mapping[str, Function], program: Program) -> None:
        self.graph, self.functions = graph, functions
        self.switches = range(program.masks, program.masks + program.switches)

    def adjoint(self, name: str, what: str, weights: _Weights, by: tuple[str, ...]) -> Function:
        """The function that gives the derivatives of the weighted sum ``by`` arrays of arguments or of seeds.

        ``weights`` say what is summed; ``what`` describes the sum in the printed code.
        """
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
        return tuple(result for result in results if result[0] != "gp" or result[1] not in self.switches)

    def _weigh(self, label: str, name: str, function: str, array: str, seeds: dict[Node, Node]) -> Array:
        """The weights, called ``name``, of an ``array`` that a ``function`` fills; adds them to the ``seeds`` of nodes.

        The array of weights is empty if the program has no such function.
        """
        found = self.functions.get(function)
        nodes = {} if found is None else {index: node for filled, index, node in found.results if filled == array}
        weights = tuple(self.graph.symbol(f"{label} {k}") for k in range(1 + max(nodes, default=-1)))
        for index, node in nodes.items():
            seeds[node] = self.graph.add(seeds.get(node, self.graph.zero), weights[index])
        return Array(name, weights)
