"""Inverse dynamics: the mechanism whose motion is given, and whose drives bear what the motion needs.

Coordinates become prescribed motions; nothing else of the description changes. Places are guided along motions by
constraints, see ``guiding``. The force of a drive is that of ``dynamics.drives``. The other coordinates follow:
constraints determine them, or their own equations of motion where the mechanism has fewer drives than degrees of
freedom.
Source: J. J. Craig, Introduction to Robotics, 3rd edition, sections 6.5 and 10.2 (inverse dynamics, computed torque);
M. W. Spong, Partial feedback linearization of underactuated mechanical systems, IROS 1994, for passive coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from lag2fmu.analysis.evaluation import operating_inputs
from lag2fmu.analysis.guiding import guidable, guides
from lag2fmu.analysis.subspaces import RANK
from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.ports import Ports
from lag2fmu.description.symbols import FILTERED, Coordinate, Input, Parameter
from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError, MechanismError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.graph.batches import Floats, matrix
from lag2fmu.language.given import check_names, within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import SECOND
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.assembly import assembled
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.norms import norm_constraints
from lag2fmu.mechanism.record import Mechanism, complete

ALL = "all"
"""The word for as many coordinates as can be prescribed."""
TIME_CONSTANT = "time_constant"
"""The name of the parameter of filters."""


def inverse(
    model: Mechanism | str | Path, motions: str | Sequence[str] = ALL, *, time_constant: float | None = None
) -> Mechanism:
    """The mechanism NAME_inverse whose coordinates ``motions`` are prescribed and whose drives' forces are outputs.

    The FMU of it has inputs x, x_dot, x_ddot for each prescribed coordinate x, and the output F_x: what has to act on
    x, beside all that acts in ``model`` already, for this motion. With a ``time_constant`` (s) of a critically damped
    filter, which becomes a parameter, there is one input, x_target. "all" prescribes all coordinates or, of constrained
    ones, an independent choice, those with a given start first. What is not prescribed follows by constraints, or by
    its own equations of motion.

    A point or body NAME among the ``motions`` has the inputs NAME_x, NAME_y and in space NAME_z, with derivatives; an
    output that is an expression of positions has its own name. Then each coordinate q has an output F_q: Q_q = F_q of
    all of them moves the places so. Where places and coordinates leave a freedom, F holds the places alone: it is the
    force at the places that does so, as it acts along the coordinates.

    Raises LoadError as ``load`` does, DerivationError for names that are no coordinates, and for motions between which
    constraints leave no choice, MechanismError for contacts, stops or frictions on prescribed coordinates alone, and
    for a time constant that is not positive.
    Source: J. J. Craig, Introduction to Robotics, 3rd edition, section 6.5.
    """
    mechanism = _with_filter(as_mechanism(model), time_constant)
    motions = (motions,) if isinstance(motions, str) else motions
    check_names("inverse", motions)
    asked = tuple(dict.fromkeys(motions))
    chosen = asked
    try:
        guided, rest = _guided(mechanism, asked, filtered=time_constant is not None)
        equations = derive(guided)
        chosen = _independent(equations) if ALL in asked else _checked(equations, rest)
        given = {q.name: q for q in guided.coordinates}
        inputs = [_motion(given[name], filtered=time_constant is not None) for name in chosen]
        return complete(_prescribed(assembled(guided.description)[0], inputs, _passive(guided, chosen)))
    except MechanismError as error:
        remedy = "; prescribe fewer coordinates, or leave out stops, friction, contacts" if mechanism.hybrid else ""
        raise MechanismError(
            f"inverse dynamics of '{mechanism.name}' with {', '.join(chosen)} prescribed: {error}{remedy}"
        ) from error


def needed(mechanism: Mechanism) -> tuple[str, ...]:
    """The names of what the motions of ``mechanism`` need beside F_x: powers of drives (W) and multipliers."""
    norms = norm_constraints(mechanism) if mechanism.constraints else frozenset[str]()
    bearing = (c.name for c in mechanism.constraints if not c.massless and c.name not in norms)
    drives = carried(mechanism)
    if len(drives) > len(mechanism.driven):
        drives = tuple(name for name in drives if name in mechanism.ports.drives)
    return (*map(names.drive_power, drives), *map(names.multiplier, bearing))


def _with_filter(mechanism: Mechanism, time_constant: float | None) -> Mechanism:
    """``mechanism`` with the ``time_constant`` (s) of filters as a parameter; itself without one."""
    if time_constant is None:
        return mechanism
    if not within(time_constant, above=0):
        raise MechanismError(f"time_constant: {time_constant!r} s; give a positive time, such as 0.02")
    filtering = Parameter(TIME_CONSTANT, time_constant, SECOND, "of the filter of the prescribed motions")
    written = assembled(mechanism.description)[0]
    return complete(replace(written, parameters=(*written.parameters, filtering)))


def _guided(mechanism: Mechanism, asked: Sequence[str], *, filtered: bool) -> tuple[Mechanism, list[str]]:
    """``mechanism`` with guides of the places among what is ``asked``, and the other names.

    Raises DerivationError where the places cannot move in all directions that are asked for.
    """
    known = {q.name for q in mechanism.coordinates} | {ALL}
    places = [name for name in asked if name not in known and name in guidable(mechanism)]
    rest = [name for name in asked if name not in places]
    if not places:
        return mechanism, rest
    if ALL in rest:
        raise DerivationError(
            f"mechanism '{mechanism.name}': beside places '{ALL}' does not tell which coordinates; name them; "
            f"known are {', '.join(q.name for q in mechanism.coordinates)}"
        )
    found = guides(mechanism, places)
    moved = [replace(u, motion=FILTERED, time_constant=symbol(TIME_CONSTANT)) if filtered else u for u in found.motions]
    d = found.added(assembled(mechanism.description)[0], moved)
    ports = _ports(d.ports, moved, drives=[q.name for q in mechanism.coordinates])
    guided = complete(replace(d, ports=ports))
    _check_guided(mechanism, guided, places, [u.name for u in moved])
    return guided, rest


def _check_guided(mechanism: Mechanism, guided: Mechanism, places: Sequence[str], moved: Sequence[str]) -> None:
    """Raise DerivationError unless the ``places`` can be moved at will, by drives that hold nothing else."""
    before, told = derive(mechanism), ", ".join(places)
    if before.graph.symbols(before.constraints.residuals) & {*mechanism.driven}:
        raise DerivationError(
            f"mechanism '{mechanism.name}': motions of its own move its constraints, which drives of coordinates would "
            f"have to hold as well; prescribe coordinates in place of {told}"
        )
    if _rank(_jacobian(derive(guided))) < _rank(_jacobian(before)) + len(moved):
        raise DerivationError(
            f"mechanism '{mechanism.name}': at the start {told} cannot move along all of {', '.join(moved)} at will; "
            "name fewer places, or start elsewhere"
        )


def _passive(mechanism: Mechanism, chosen: Sequence[str]) -> tuple[Coordinate, ...]:
    """The coordinates that are not ``chosen``; constraints determine where they start, from guesses."""
    rest = tuple(q for q in mechanism.coordinates if q.name not in chosen)
    return tuple(replace(q, given=False, velocity_given=False) for q in rest) if mechanism.constraints else rest


def _prescribed(d: Description, inputs: Sequence[Input], passive: tuple[Coordinate, ...]) -> Description:
    """``d`` with ``inputs`` in place of all coordinates but the ``passive`` ones; the forces of their drives go out."""
    return replace(
        d,
        name=d.name + names.INVERSE,
        title=f"{d.title}, inverse dynamics",
        coordinates=passive,
        inputs=(*d.inputs, *inputs),
        ports=_ports(d.ports, inputs, [u.name for u in inputs]),
    )


def _ports(ports: Ports, inputs: Sequence[Input], drives: Sequence[str]) -> Ports:
    """``ports`` with the forces of ``drives``; a choice of inputs has the motions in place of their forces Q."""
    moved, drives = [u.name for u in inputs], tuple(dict.fromkeys((*ports.drives, *drives)))
    if ports.inputs is None:
        return replace(ports, drives=drives)
    forces = {names.generalized_force(name) for name in moved}
    return replace(ports, drives=drives, inputs=(*(x for x in ports.inputs if x not in forces), *moved))


def _motion(q: Coordinate, *, filtered: bool) -> Input:
    kind, T = (FILTERED, symbol(TIME_CONSTANT)) if filtered else (True, None)
    return Input(q.name, q.unit, q.start, kind, T, q.doc, q.minimum, q.maximum)


# ---------------------------------------------------------------------------------------------------- which coordinates


def _checked(equations: EquationsOfMotion, asked: Sequence[str]) -> tuple[str, ...]:
    """The coordinates ``asked`` for; raises DerivationError unless they can move independently."""
    m = equations.mechanism
    known = [q.name for q in m.coordinates]
    for name in asked:
        if name not in known:
            raise DerivationError(
                f"mechanism '{m.name}': '{name}' is no coordinate or place that can be prescribed; "
                f"{suggestion(name, [*known, *guidable(m)])}"
            )
    G = _jacobian(equations)
    free: list[str] = []
    for name in asked:
        if _is_free(G, [known.index(x) for x in (*free, name)]):
            free.append(name)
            continue
        rest = f"beside {', '.join(free)}" if free else "at the start"
        raise DerivationError(
            f"mechanism '{m.name}': the constraints leave no choice of the motion of '{name}' {rest}; leave it out, it "
            "follows"
        )
    return tuple(free)


def _independent(equations: EquationsOfMotion) -> tuple[str, ...]:
    """As many coordinates as can move independently at the start, those with given starts first."""
    coordinates = equations.mechanism.coordinates
    G = _jacobian(equations)
    order = sorted(range(len(coordinates)), key=lambda i: ({True: 0, None: 1, False: 2}[coordinates[i].given], i))
    free: list[int] = []
    for i in order:
        if _is_free(G, [*free, i]):
            free.append(i)
    return tuple(coordinates[i].name for i in sorted(free))


def _is_free(G: Floats, columns: Sequence[int]) -> bool:
    """Whether all motions along ``columns`` of G (m, n) are possible: the other columns span what all of them span."""
    return _rank(np.delete(G, columns, axis=1)) == _rank(G)


def _rank(G: Floats) -> int:
    return int(np.sum(np.linalg.svd(G, compute_uv=False) > RANK)) if G.size else 0


def _jacobian(equations: EquationsOfMotion) -> Floats:
    """G (m, n) at the start, by nominal values of the coordinates, with rows of unit length; no rows of equilibria."""
    m, n = equations.mechanism, len(equations.forcing)
    rows = [row for c, row in zip(m.constraints, equations.constraints.jacobian, strict=True) if not c.massless]
    G = matrix(equations.graph, rows, operating_inputs(equations), n) * [q.nominal for q in m.coordinates]
    length = np.linalg.norm(G, axis=1, keepdims=True)
    scaled: Floats = G / np.where(length > 0, length, 1.0)
    return scaled
