"""Amounts, units, vectors, poses and ports in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import sympy as sp

from lag2fmu.description.events import Stop
from lag2fmu.description.places import Frame
from lag2fmu.description.symbols import Coordinate
from lag2fmu.language.units import Unit
from lag2fmu.language.writer import to_text
from lag2fmu.mechanism.ports import input_names
from lag2fmu.mechanism.ranges import open_bounds
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.energies import EnergyFunctions


def amount(value: float, q: Coordinate) -> str:
    """``value``, in SI units, with the name of the unit."""
    return f"{value:.6g} {getattr(q.unit, 'si_name', '')}".strip()


def unit_text(unit: Unit | None) -> str:
    """The unit of the equations and, if values are given in another unit, that one too."""
    if unit is None or not unit.si_name:
        return ""
    return f" [{unit.si_name}]" if unit.name == unit.si_name else f" [{unit.si_name}; given in {unit.name}]"


def vector(entries: Sequence[sp.Expr]) -> str:
    """The entries of a vector, of any length, in parentheses."""
    return f"({', '.join(to_text(sp.sympify(x)) for x in entries)})"


def pose(frame: Frame) -> str:
    """Origin and rotation of a frame in words."""
    if frame.quaternion is not None:
        return f"origin {vector(frame.origin)}, quaternion {vector(frame.quaternion)}"
    turns = [
        f"{axis if isinstance(axis, str) else vector(axis)} by {to_text(angle)}" for axis, angle in frame.rotations
    ]
    return f"origin {vector(frame.origin)}" + (f", turned about {', then '.join(turns)}" if turns else "")


def axes(m: Mechanism) -> str:
    """The coordinate system and the direction of gravity."""
    fixed = "fixed Cartesian axes " + "xyz"[: m.dimension]
    if m.gravity is None:
        return fixed
    if m.gravity.direction is None:
        return f"{fixed}, gravity along -{'xyz'[m.dimension - 1]}"
    return f"{fixed}, gravity along ({', '.join(to_text(d) for d in m.gravity.direction)})"


def coordinate_words(q: Coordinate, starting: Coordinate, stops: Iterable[Stop]) -> str:
    """The coordinate ``q`` in words, with default values and those that may be misread; ``starting`` has its start.

    A bound at which one of the ``stops`` holds the coordinate is not said to be none.
    """
    remarks = [] if starting.start == q.start else [f"starts at {amount(starting.start, q)}, by the constraints"]
    if q.nominal_from not in ("", "given"):
        remarks.append(f"nominal {amount(q.nominal, q)}, from {q.nominal_from}")
    ends = zip(("min", "max"), open_bounds(q, stops), strict=True)
    bounds = [f"{key} {amount(x, q)}" for key, x in ends if x is not None]
    if bounds:
        remarks.append(f"{' and '.join(bounds)} {'is no stop' if len(bounds) == 1 else 'are no stops'}")
    return "; ".join([f"{q.doc or 'generalized coordinate'}{unit_text(q.unit)}", *remarks])


def freedom(m: Mechanism) -> str:
    """The degrees of freedom s in words: the number of coordinates minus that of independent constraints."""
    if not m.constraints:
        return f"s = {len(m.coordinates)}"
    energies = EnergyFunctions(m)
    jacobian = energies.constraints(energies.state(0.0, *energies.start()))[3]
    rank = int(np.linalg.matrix_rank(jacobian, tol=1e-8))
    redundant = f", {len(jacobian) - rank} of {len(jacobian)} constraints redundant" * (rank < len(jacobian))
    return f"s = {len(m.coordinates)} coordinates - {rank} constraints = {len(m.coordinates) - rank}{redundant}"


def port_sentences(m: Mechanism) -> Iterator[str]:
    """Sentences on the inputs that are left out, on places and on drives; none if the table is empty."""
    hidden = [name for name in input_names(m) if name in m.hidden_inputs]
    if hidden:
        yield f"no inputs of the FMU, but kept at their start values: {', '.join(hidden)}"
    words = {
        "forces": "force in at",
        "torques": "torque in on",
        "poses": "pose out of",
        "velocities": "velocity out of",
    }
    words |= {"accelerations": "acceleration out of"}
    for field, places in m.ports.listed().items():
        if places:
            yield f"ports: {words[field]} {', '.join(places)}"
    if m.ports.drives:
        yield f"ports: force out that carries {', '.join(m.ports.drives)}"
