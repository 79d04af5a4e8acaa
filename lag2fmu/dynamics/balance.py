"""The balance of momenta that variational methods solve, and its derivatives, for derivatives through their steps.

At a point (t, q, qd) it consists of the momenta m = dL/dqd, the forces F with dm/dt = F, the reactions R = G^T mu of
constraints with the multipliers mu, and of what the constraints say: positions phi and velocities v = G qd + b.
Source: J. E. Marsden, M. West, Discrete mechanics and variational integrators, Acta Numerica 2001, section 3.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lag2fmu.dynamics.functions import Array, Function, Program, filling
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.graph import Graph, Node

VALUES = ("m", "F", "R", "phi", "v")
"""The arrays that the balance fills."""
_KNOWN = ("t", "x", "u", "p")


def with_balance(program: Program) -> Program:
    """``program`` with the functions mechanism_balance and mechanism_balance_tangent, if its method is variational.

    The second one gives the derivatives dm, dF, dR (n,), dphi (h,), dv (m,) along (dt, dx, du, dp) at fixed mu (m,).
    Both stand on a copy of the graph. Raises DerivationError as ``Function.check`` does.
    """
    functions = {f.name.removeprefix("mechanism_"): f for f in program.functions}
    if "canonical" not in functions:
        return program
    graph = program.graph.copy()
    arguments = {a.name: a for a in functions["residual_tangent"].arguments}
    mu = Array("mu", tuple(graph.symbol(f"balance mu {k}") for k in range(program.constraints)))
    known = (*(arguments[name] for name in _KNOWN), mu)
    values = _values(graph, functions, mu.entries)
    seeds = tuple(arguments[f"d{name}"] for name in _KNOWN)
    direction = {
        x: dx for a, da in zip(known, seeds, strict=False) for x, dx in zip(a.entries, da.entries, strict=True)
    }
    slopes = {f"d{name}": forward(graph, nodes, direction) for name, nodes in values.items()}
    what = "momenta m, forces F, reactions R = G^T mu, and of the constraints phi and v = G qd + b"
    found = (
        filling("mechanism_balance", f"The {what}.", known, **values),
        filling("mechanism_balance_tangent", f"Directional derivatives of {what}.", (*known, *seeds), **slopes),
    )
    return program._replace(graph=graph, functions=(*program.functions, *(f.check(graph) for f in found)))


def _values(graph: Graph, functions: Mapping[str, Function], mu: Sequence[Node]) -> dict[str, list[Node]]:
    """{name: nodes} of VALUES; what constraints say is empty without any."""
    found: dict[str, list[Node]] = {name: [] for name in ("m", "F", "phi", "v", "G")}
    for function in ("canonical", "constraints"):
        for array, _, node in functions[function].results if function in functions else ():
            found[array].append(node)
    n, G = len(found["m"]), found.pop("G")
    R = [graph.dot(mu, G[i::n]) for i in range(n)]
    return {"m": found["m"], "F": found["F"], "R": R, "phi": found["phi"], "v": found["v"]}
