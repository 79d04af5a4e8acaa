"""ModelStructure for every version of FMI: the unknowns in order, each with the names of its dependencies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from lag2fmu.fmu.scalar_variable import ScalarVariable

KNOWN = frozenset({"input", "parameter", "independent"})
"""The causalities of variables on which others depend; states are such knowns, too."""


class Unknown(NamedTuple):
    """An entry of ModelStructure; ``dependencies`` are names, None if it depends on everything and lists nothing.

    ``constant``: the only dependency enters with a constant factor.
    """

    name: str
    dependencies: tuple[str, ...] | None
    constant: bool = False


class Structure(NamedTuple):
    """The lists of ModelStructure: outputs, derivatives of the states, unknowns at initialization.

    ``calculated`` are further unknowns, which ModelStructure does not list; they have dependencies too.
    """

    outputs: tuple[Unknown, ...]
    derivatives: tuple[Unknown, ...]
    initial: tuple[Unknown, ...]
    calculated: tuple[Unknown, ...]


def structure(variables: Sequence[ScalarVariable], *, known_parameters: bool) -> Structure:
    """The structure of ``variables``, whose dependencies stand in their order.

    ``known_parameters``: outputs and derivatives list the parameters they depend on, too (FMI 3.0.2, section 2.4.8; in
    FMI 2.0.5, section 2.2.8, they do not).
    """
    known = KNOWN if known_parameters else KNOWN - {"parameter"}
    continuous = {v.name for v in variables if v.causality in known or v.state}
    exact = {v.name for v in variables if v.causality in ("input", "independent") or v.state or v.initial == "exact"}
    # states whose starts constraints determine; unknowns that depend on them depend on everything
    solved = {v.name for v in variables if v.initial == "approx" and v.state}
    return Structure(
        tuple(_unknown(v, continuous, set()) for v in variables if v.causality == "output"),
        tuple(_unknown(v, continuous, set()) for v in variables if v.derivative_of is not None),
        tuple(_unknown(v, exact, solved) for v in _at_start(variables, solved) if _is_initial_unknown(v)),
        tuple(_unknown(v, continuous, set()) for v in variables if v.causality not in KNOWN),
    )


def _at_start(variables: Sequence[ScalarVariable], solved: set[str]) -> Iterator[ScalarVariable]:
    """The same with dependencies in Initialization Mode, where constraints may move states that are not ``solved``."""
    moved = {v.name: {*v.start_dependencies} - solved for v in variables if v.start_dependencies}
    order = {v.name: i for i, v in enumerate(variables)}
    for v in variables:
        if moved.keys().isdisjoint(v.dependencies or ()):
            yield v
        else:
            listed = {used for name in v.dependencies or () for used in (name, *moved.get(name, ()))}
            yield v._replace(dependencies=tuple(sorted(listed, key=order.__getitem__)))


def _is_initial_unknown(v: ScalarVariable) -> bool:
    """Whether ``v`` is computed at initialization and listed: an output, a dependent parameter or a derivative."""
    listed = v.causality in ("output", "calculatedParameter") or v.derivative_of is not None
    return listed and v.initial in ("calculated", "approx")


def _unknown(v: ScalarVariable, knowns: set[str], solved: set[str]) -> Unknown:
    """The entry of ``v``; its dependencies are left out if it depends on a state that is ``solved`` for.

    They are left out too for variables that change at events, because at an event these may depend on everything.
    """
    if v.variability == "discrete" or v.dependencies is None or solved & {v.name, *v.dependencies}:
        return Unknown(v.name, None)
    dependencies = tuple(name for name in v.dependencies if name in knowns)
    is_velocity = v.derivative_of is not None and len(dependencies) == 1 and _is_velocity(v)
    return Unknown(v.name, dependencies, v.state or is_velocity)


def _is_velocity(v: ScalarVariable) -> bool:
    """Whether the derivative is a state itself (der_theta = theta_dot): its dependency has the constant factor 1."""
    return v.dependencies == (f"{v.derivative_of}_dot",)
