"""Dampers in time stepping: those that are linear act with the velocities at both ends of a step.

A linear damper pulls by D qd, where D is the Hessian of its dissipation R. In the middle of a step of the length h the
velocity is qd + change/2, so that M change = h (f - D (qd + change/2)) becomes (M + h/2 D) change = h (f - D qd). No
damper, however stiff, makes such a step grow. Source: Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical
Systems, 2008, section 10.1 (the scheme of Moreau and Jean with theta = 1/2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.parts import Energies, Variables
from lag2fmu.dynamics.quadratic import QuadraticForm, second_degree
from lag2fmu.dynamics.row_tables import ImplicitDampers
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import ADD


def implicit_dampers(equations: EquationsOfMotion, forcing: Callable[[Energies], tuple[Node, ...]]) -> ImplicitDampers:
    """The dampers of ``equations``: dissipation of second degree in the velocities, and drives with a gain of a rate.

    ``forcing`` gives the right side of M qdd = forcing, (n,), of these energies, see ``terms.forcing``.

    Dissipation that is no polynomial is left to the other forces, and so are forces along a coordinate that depend on
    other velocities than its own.
    """
    g, v = equations.graph, equations.variables
    half, entries = g.symbol("half step"), dict(equations.entries)
    energies, drives = _without_drives(g, v, equations.parts)
    linear, others = list[Node](), list[Node]()
    for term in (*_terms(g, energies.dissipation), *drives):
        form = second_degree(g, term, v.qd)
        (others if form is None else linear).append(term)
        for pair, value in _entries(form):
            entries[pair] = g.add(entries.get(pair, g.zero), g.multiply(half, value))
    pulls = enumerate(reverse(g, {g.total(linear): g.one}, v.qd))
    drag = {i: pull for i, pull in pulls if pull != g.zero}
    if not drag:
        return ImplicitDampers(half, equations.entries, drag, equations.forcing)
    return ImplicitDampers(half, entries, drag, forcing(replace(energies, dissipation=g.total(others))))


def _without_drives(g: Graph, v: Variables, energies: Energies) -> tuple[Energies, Sequence[Node]]:
    """``energies`` without the forces along a coordinate that are linear in its velocity, and their dissipation."""
    effort, direct, dissipation = dict(energies.effort), list[Node](), list[Node]()
    for i, (q, qd, force) in enumerate(zip(v.q, v.qd, energies.direct, strict=True)):
        kept, gain = _split(g, v, i, g.add(force, effort.pop(q, g.zero)))
        direct.append(kept)
        dissipation.append(g.multiply(g.constant(-1 / 2), g.multiply(gain, g.multiply(qd, qd))))
    return replace(energies, direct=tuple(direct), effort=effort), dissipation


def _split(g: Graph, v: Variables, i: int, force: Node) -> tuple[Node, Node]:
    """The ``force`` along coordinate ``i`` as rest + gain * its velocity: the rest, and the gain."""
    kept, gains = list[Node](), list[Node]()
    for term in _terms(g, force):
        linear = v.moves(g, term) and second_degree(g, g.multiply(v.qd[i], term), v.qd) is not None
        slopes = reverse(g, {term: g.one}, v.qd) if linear else [g.zero]
        own = slopes[i] if sum(slope != g.zero for slope in slopes) == 1 else g.zero
        kept.append(g.substitute([term], {v.qd[i]: g.zero})[0] if own != g.zero else term)
        gains.append(own)
    return g.total(kept), g.total(gains)


def _terms(g: Graph, node: Node) -> Iterator[Node]:
    """The terms of a sum."""
    stack = [node]
    while stack:
        term = stack.pop()
        if g.code[term] == ADD:
            stack += g.operands[term]
        else:
            yield term


def _entries(form: QuadraticForm | None) -> Iterator[tuple[tuple[Node, Node], Node]]:
    """Each entry of a form once."""
    for a, row in form.rows.items() if form else ():
        yield from (((a, b), value) for b, value in row.items() if a <= b)
