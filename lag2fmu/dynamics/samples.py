"""Derived equations in numbers at the start and at random states around it: M, and checks."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from lag2fmu.description import names
from lag2fmu.dynamics.parts import Entries, Solution
from lag2fmu.dynamics.starts import State, start_values
from lag2fmu.dynamics.variables import declare, translator
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats, evaluate, matrix
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.mechanism.record import Mechanism

RESOLVED = 1e-12
"""Relative to the inertia that its coordinates have alone: a motion with less inertia is lost in rounding."""


def samples(mechanism: Mechanism, count: int) -> Iterator[State]:
    """``count`` states around the start, in SI units, the same in each call.

    Parameters are moved by up to a tenth of their values, coordinates by up to their nominal values.
    """
    generator = random.Random(20)
    start = start_values(mechanism)
    parameters = {p.name for p in mechanism.parameters}
    nominal = {c.name: c.nominal for c in mechanism.coordinates}
    nominal |= {z.name: z.nominal for z in mechanism.states}
    for _ in range(count):
        yield {
            name: value * generator.uniform(0.9, 1.1)
            if name in parameters
            else value + nominal.get(name, 1.0) * generator.uniform(-1, 1)
            for name, value in start.items()
        }


def mass_matrices(graph: Graph, entries: Entries, velocities: Sequence[Node], states: Sequence[State]) -> Floats:
    """M at k ``states``, (k, n, n), in SI units; ``entries`` is its quadratic form, ``velocities`` are (n,) nodes.

    The m nodes of the form are linear in the velocities. So their values at unit velocities are their coefficients J
    (m, n), and M = J^T H J.
    """
    if not velocities:
        return np.zeros((len(states), 0, 0))
    table = np.array([list(state.values()) for state in states])
    values: dict[str, float | Floats] = dict(zip(states[0], table.T[:, :, np.newaxis], strict=True))
    place = {node: i for i, node in enumerate(sorted({node for pair in entries for node in pair}))}
    H = np.zeros((len(states), len(place), len(place)))
    for (a, b), weight in zip(entries, evaluate(graph, list(entries.values()), values), strict=True):
        H[:, place[a], place[b]] = H[:, place[b], place[a]] = weight[:, 0]
    values |= zip((str(graph.leaf[v]) for v in velocities), np.eye(len(velocities)), strict=True)
    J = evaluate(graph, list(place), values).swapaxes(0, 1)
    with np.errstate(all="ignore"):
        found: Floats = J.swapaxes(1, 2) @ H @ J
    return found


def massless_directions(
    mechanism: Mechanism, graph: Graph, entries: Entries, velocities: Sequence[Node], jacobian: Sequence[Sequence[Node]]
) -> dict[int, float]:
    """{row of ``jacobian`` (m, n): weight} of the rows that restrict motion without mass; {} if M is regular somewhere.

    M is the Hessian of ``entries`` over ``velocities``, (n,). Each weight w is a power of two. It makes w g g^T as
    large as M is for the coordinates that the row g ties. For other coordinates M may be far larger: think of a light
    rotor on a crane.
    """
    found: dict[int, float] = {}
    states = list(samples(mechanism, 5))
    for values, mass in zip(states, mass_matrices(graph, entries, velocities, states), strict=True):
        rows = matrix(graph, jacobian, values, len(velocities))
        if not (np.all(np.isfinite(mass)) and np.all(np.isfinite(rows))):
            continue
        scale = np.sqrt(np.abs(np.diag(mass)))
        scale[scale == 0] = 1.0
        _, singular, vectors = np.linalg.svd(mass / np.outer(scale, scale))
        null = vectors[singular <= RESOLVED * max(singular[0], 1e-300)]
        if len(null) == 0:
            return {}
        for k, row in enumerate(rows):
            if k not in found and np.any(np.abs(null @ (row / scale)) > 1e-9 * np.linalg.norm(row / scale)):
                tied = row != 0
                largest = float(np.abs(mass[tied][:, tied]).max(initial=0.0) or np.abs(mass).max()) or 1.0
                found[k] = 2.0 ** round(float(np.log2(largest / (row @ row))))
    return found


def check_start(
    mechanism: Mechanism, graph: Graph, mass: Floats, forcing: Sequence[Node], distances: Mapping[str, Node]
) -> None:
    """Raise DerivationError unless M, ``mass`` (n, n), and the forces, ``forcing`` (n,), are finite at the start.

    ``distances`` {place in the mechanism: node} are those of the ends of springs and dampers, in m. Where one is 0, the
    force has no direction.
    """
    values = start_values(mechanism)
    starts = ", ".join(f"{c.name} = {c.start:g}" for c in mechanism.coordinates)
    for what, numbers in (("mass matrix", mass), ("forces", np.array(graph.evaluate(forcing, values)))):
        if np.all(np.isfinite(numbers)):
            continue
        lengths = zip(distances, graph.evaluate(list(distances.values()), values), strict=True)
        where = next((name for name, length in lengths if length == 0), None)
        if where is not None:
            raise DerivationError(
                f"{where}.between: both ends are at the same place at the start ({starts}), at a distance of 0 m, so "
                "that the force has no direction; start with the ends apart"
            )
        verb, place = "has" if what == "mass matrix" else "have", _undefined(mechanism, values)
        raise DerivationError(
            f"mechanism '{mechanism.name}': the {what} {verb} no finite value at the start ({starts}){place}; "
            "choose start values and parameters without a division by zero or a root of a negative number"
        )


def _undefined(mechanism: Mechanism, values: State) -> str:
    """A phrase with the first expression that is not finite at ``values`` (SI); '' if only derivatives are not."""
    graph = Graph()
    translate = translator(graph, mechanism, declare(graph, mechanism))
    known = dict.fromkeys(map(str, graph.leaf.values()), 0.0) | values
    for where, expression in mechanism.expressions():
        (value,) = graph.evaluate([translate(expression)], known)
        if not np.isfinite(value):
            return f": {mechanism.origins.get(where, where)}, '{expression}', is {value:g} there"
    return ""


def check_positive(mechanism: Mechanism, mass: Floats) -> None:
    """Raise DerivationError if a diagonal entry of M, ``mass`` (n, n), is negative.

    This finds a Lagrangian that is written with the opposite sign.
    """
    if mechanism.energy.lagrangian is not None:
        return
    for q, inertia in zip(mechanism.coordinates, np.diagonal(mass), strict=True):
        if inertia < 0:
            raise DerivationError(
                f"mechanism '{mechanism.name}': what moves along {q.name} has the mass or inertia {inertia:.6g} (SI) "
                "at the start; give masses and inertias that are positive"
            )


def check_quadratic(mechanism: Mechanism, graph: Graph, entries: Sequence[Node]) -> None:
    """Raise DerivationError if second derivatives of L by the velocities change with the velocities.

    The ``entries`` are evaluated, so that velocities that cancel out are allowed.
    """
    speeds = {names.velocity(c.name) for c in mechanism.coordinates}
    for values in samples(mechanism, 4):
        a = np.array(graph.evaluate(entries, values))
        b = np.array(graph.evaluate(entries, values | {s: 1.7 * values[s] + 0.3 for s in speeds}))
        usable = np.isfinite(a) & np.isfinite(b)
        if np.any(np.abs(a - b)[usable] > 1e-9 * np.max(np.abs(a[usable]), initial=1e-300)):
            raise DerivationError(
                f"mechanism '{mechanism.name}': the kinetic energy (or Lagrangian) is not quadratic in the velocities; "
                "supported are T = 1/2 qd.M(q,t).qd + a(q,t).qd + b(q,t), and potentials of the same form"
            )


def check_rank(mechanism: Mechanism, masses: Floats, regular: bool) -> None:
    """Raise DerivationError naming the coordinates if M is singular in every sampled state, ``masses`` (k, n, n).

    ``regular``: M is regular in exact arithmetic, and singular in double precision only.
    """
    directions = []
    for mass in masses:
        if not np.all(np.isfinite(mass)):
            continue
        scale = np.sqrt(np.abs(np.diag(mass)))
        scale[scale == 0] = 1.0
        scaled = mass / np.outer(scale, scale)
        sizes = np.abs(np.linalg.eigvalsh(scaled))  # the singular values alone take a fraction of the time
        if sizes.min() > RESOLVED * max(sizes.max(), 1e-300):
            return
        vectors = np.linalg.svd(scaled)[2]
        directions.append(np.abs(vectors[-1]))
    if directions:
        worst = np.max(directions, axis=0)
        culprits = [c.name for c, w in zip(mechanism.coordinates, worst, strict=True) if w > 1e-6]
        along = f"motion along {', '.join(culprits)}"
        raise DerivationError(
            f"mechanism '{mechanism.name}': the mass matrix is singular to double precision for every q; a {along} has "
            f"less than {RESOLVED:g} of the inertia that each of these coordinates has alone. Let coordinates begin at "
            "mass centres, give greater masses or inertias, or leave out this motion"
            if regular
            else f"mechanism '{mechanism.name}': the mass matrix is singular for every q; the {along} has no mass. "
            "Give what moves there a mass or inertia, or leave out coordinates"
        )


def check_agreement(
    mechanism: Mechanism,
    graph: Graph,
    masses: Floats,
    states: Sequence[State],
    forcing: Sequence[Node],
    solution: Solution | None,
) -> None:
    """Raise DerivationError if the accelerations do not solve M qdd = forcing in double precision.

    Two different expressions with one fingerprint, which is unlikely, would show here. The check is made in the first
    of the k ``states`` in which no pivot is bad; ``masses`` (k, n, n) are M in these states.
    """
    if solution is None:
        return
    for values, mass in zip(states, masses, strict=True):
        numbers = np.array(graph.evaluate([*forcing, *solution.x], values))
        f, qdd = np.split(numbers, 2)
        scale = np.abs(mass) @ np.abs(qdd) + np.abs(f)
        if not np.all(np.isfinite(scale)):
            continue
        if np.any(np.abs(mass @ qdd - f) > 1e-6 * scale):
            raise DerivationError(
                f"mechanism '{mechanism.name}': the derived accelerations do not solve M qdd = forcing; "
                "this is a fault of lag2fmu, please report it with the model"
            )
        return
