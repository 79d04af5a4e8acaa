"""Is the geometry of a mechanism sound? Frames form trees on the world, positions fit, inertia tensors are positive."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.places import WORLD, Body, Frame, Rotation, remedy_for
from lag2fmu.errors import MechanismError
from lag2fmu.language.vocabulary import value_of
from lag2fmu.mechanism.order import in_order

Values = dict[str, float]
NamesIn = Callable[[str, sp.Expr], Collection[str]]
"""A function (place, expression) -> names in the expression, definitions written out; messages name the place."""
Matrix = list[list[float]]

ROUNDING = 1e-12
"""Within this relative error a norm counts as 1, and a principal moment as not negative."""

_NO_VALUE = (KeyError, ValueError, ArithmeticError)


def check_geometry(m: Description) -> None:
    """Raise MechanismError for the first fault of frames, bodies, points and the direction of gravity."""
    frames = {frame.name: frame for frame in m.frames}
    for frame in m.frames:
        _check_frame(frame)
    _check_parents(frames)
    for table, parts in (("bodies", m.bodies), ("points", m.points), ("visuals", m.visuals)):
        for part in parts:
            if part.frame is not None:
                _check_no_body(str(part.frame), frames, m.bodies, f"{table}.{part.name}.frame")
                _check_known(str(part.frame), frames, f"{table}.{part.name}.frame")
    for body in m.bodies:
        _check_body(body)
    for point in m.points:
        if point.frame is not None and len(point.position) != 3:
            raise MechanismError(
                f"points.{point.name}.position: has {len(point.position)} entries; on a frame it has 3"
            )
        if point.angle is not None and len(point.position) != 2:
            raise MechanismError(f"points.{point.name}.angle: goes with a position of 2 entries; in space use a frame")
    _check_entries(m)


def _check_frame(frame: Frame) -> None:
    where = f"frames.{frame.name}"
    if frame.name == WORLD:
        raise MechanismError(f"{where}: '{WORLD}' is the fixed frame; choose another name")
    if len(frame.origin) != 3:
        raise MechanismError(f"{where}.origin: has {len(frame.origin)} entries; give 3")
    if frame.quaternion is not None:
        if frame.rotations:
            raise MechanismError(f"{where}: 'rotations' and 'quaternion' exclude each other; leave one out")
        if len(frame.quaternion) != 4:
            raise MechanismError(f"{where}.quaternion: has {len(frame.quaternion)} entries; give 4, the scalar first")


def _check_parents(frames: dict[str, Frame]) -> None:
    """Raise MechanismError unless all parents exist, and the parents of each frame lead to the world."""
    sound = {WORLD}
    for name in frames:
        chain, walked = [name], {name}
        while chain[-1] not in sound:
            parent = str(frames[chain[-1]].parent)
            _check_known(parent, frames, f"frames.{chain[-1]}.parent")
            if parent in walked:
                circle = [*chain[chain.index(parent) :], parent]
                shown = circle if len(circle) <= 8 else [*circle[:4], "...", *circle[-3:]]
                raise MechanismError(
                    f"frames.{parent}.parent: is on itself: {' <- '.join(shown)}; put one of them on '{WORLD}'"
                )
            chain.append(parent)
            walked.add(parent)
        sound |= walked


def _check_no_body(name: str, frames: dict[str, Frame], bodies: Sequence[Body], where: str) -> None:
    """Raise MechanismError if ``name`` is that of a body which is its own place, as in the plane."""
    body = next((body for body in bodies if body.name == name and body.frame is None), None)
    if body is not None and name not in frames:
        turned = f", with the body's angle as in 'x + d*cos({body.angle})'" if body.angle is not None else ""
        raise MechanismError(
            f"{where}: '{name}' is a body, and no frame; leave 'frame' out and write the position in the world{turned}"
        )


def _check_known(name: str, frames: dict[str, Frame], where: str) -> None:
    if name != WORLD and name not in frames:
        raise MechanismError(f"{where}: there is no frame '{name}'; {remedy_for(name, [WORLD, *frames])}")


def _check_body(body: Body) -> None:
    """Raise MechanismError unless ``body`` has the keys of a particle or a planar or spatial body, and no others."""
    where = f"bodies.{body.name}"
    if body.frame is not None:
        _check_framed_body(body, where)
        return
    if body.position is None and (body.mass != 0 or body.inertia is None or body.angle is None):
        raise MechanismError(
            f"{where}: 'position' is missing; give it, or the 'frame' that carries the body, or only 'angle' and "
            "'inertia' of what has no mass"
        )
    if any(body.center):
        raise MechanismError(f"{where}.center: goes with 'frame'; add it to the position instead")
    if isinstance(body.inertia, tuple):
        raise MechanismError(f"{where}.inertia: an inertia tensor goes with 'frame'; a planar body has one inertia")
    if (body.inertia is None) != (body.angle is None):
        missing = "inertia" if body.inertia is None else "angle"
        raise MechanismError(f"{where}: '{missing}' is missing; a rigid body has both, a particle neither")
    if body.angle is not None and len(body.position or ()) == 3:
        raise MechanismError(
            f"{where}: a body with an angle is planar; give its position 2 entries, or put it on a frame"
        )


def _check_framed_body(body: Body, where: str) -> None:
    """Raise MechanismError unless a body on a frame has centre and tensor in the frame's axes, and no position."""
    for key in ("position", "angle"):
        if getattr(body, key) is not None:
            raise MechanismError(f"{where}: '{key}' and 'frame' exclude each other; leave one out")
    if len(body.center) != 3:
        raise MechanismError(f"{where}.center: has {len(body.center)} entries; give 3")
    if body.inertia is not None and not (isinstance(body.inertia, tuple) and len(body.inertia) == 6):
        raise MechanismError(
            f"{where}.inertia: a body of a frame has the 6 entries Ixx, Iyy, Izz, Ixy, Ixz, Iyz, got {body.inertia}; "
            "of a body whose axes are principal the last three are 0"
        )


def _check_entries(m: Description) -> None:
    """Raise MechanismError unless all positions have 2 entries, or all have 3."""
    framed = m.frames or {part.frame for part in m.places} != {None}
    fixed = {len(part.position) for part in m.places if part.frame is None and part.position is not None}
    if fixed - {2, 3} or len(fixed) > 1:
        raise MechanismError(
            f"bodies and points: positions have {sorted(fixed)} entries; give all of them 2, or all of them 3"
        )
    if fixed == {2} and framed:
        raise MechanismError("bodies and points: positions have 2 entries; beside frames they need 3")
    _check_gravity(m)


def _check_gravity(m: Description) -> None:
    direction = None if m.gravity is None else m.gravity.direction
    if direction is not None and (m.frames or m.places) and len(direction) != m.dimension:
        raise MechanismError(f"gravity.direction: has {len(direction)} entries, positions have {m.dimension}")


# ----------------------------------------------------------------------------- what depends on the parameters' values


def check_values(m: Description, names_in: NamesIn) -> tuple[str, ...]:
    """Raise MechanismError for axes, quaternions, masses and inertias that are impossible at the parameters' values.

    ``names_in`` tells what an expression uses, see ``Scope.names_in``. Returns warnings of tensors that no distribution
    of mass has, of springs that push away from rest, and of dampers that drive. Time is 0, and motion inputs have their
    start values. Expressions that depend on coordinates, or have no value there, are not checked.
    """
    values = values_of(m)
    for frame in m.frames:
        _check_rotations(frame, values)
        if frame.quaternion is not None:
            _check_quaternion(m, frame, names_in, values)
    for body in m.bodies:
        _check_mass(body, values)
    return (*(warning for body in m.bodies for warning in _check_inertia(body, values)), *_driving(m, values))


def _check_mass(body: Body, values: Values) -> None:
    """Raise MechanismError for a negative mass or moment of inertia; tensors are checked by ``_check_inertia``."""
    for key, unit, entry in (("mass", "kg", body.mass), ("inertia", "kg.m2", body.inertia)):
        numbers = None if entry is None or isinstance(entry, tuple) else _numbers((entry,), values)
        if numbers is not None and numbers[0] < 0:
            raise MechanismError(
                f"bodies.{body.name}.{key}: '{entry}' is {numbers[0]:g} {unit} at the values given, and negative; "
                "give a positive one"
            )


def _driving(m: Description, values: Values) -> Iterator[str]:
    """Warnings of negative stiffness and damping."""
    elements = [(f"springs.{s.name}.stiffness", s.stiffness, "pushes away from rest") for s in m.springs]
    elements += [
        (f"dampers.{d.name}.damping", d.damping, "drives the motion") for d in m.dampers if d.damping is not None
    ]
    units = {p.name: p.unit for p in m.parameters}
    for where, expression, effect in elements:
        numbers = _numbers((expression,), values)
        if numbers is not None and numbers[0] < 0:
            unit = units.get(str(expression))
            shown = f"{numbers[0]:g}" if unit is None else f"{unit.from_si(numbers[0]):g} {unit.name}"
            yield f"{where}: '{expression}' is {shown} at the values given; negative, it {effect}"


def values_of(m: Description) -> Values:
    """{name: SI value} of parameters, motion inputs, time, and of the definitions that follow from them.

    Raises MechanismError for definitions in a circle.
    """
    values = {"t": 0.0} | {u.name: u.start for u in m.motions} | {z.name: z.start for z in m.states if z.moves}
    values |= {p.name: p.value for p in m.parameters if p.value is not None}
    dependent = in_order([p for p in m.parameters if p.expression is not None], "parameters")
    followers = [(p.name, p.expression) for p in dependent]
    followers += [(d.name, d.expression) for d in in_order(m.definitions, "definitions")]
    for name, expression in followers:
        with suppress(*_NO_VALUE):
            values[name] = value_of(expression, values)
    return values


def _numbers(entries: tuple[sp.Expr, ...], values: Values) -> list[float] | None:
    try:
        return [value_of(entry, values) for entry in entries]
    except _NO_VALUE:
        return None


def _check_rotations(frame: Frame, values: Values) -> None:
    for i, turn in enumerate(frame.rotations):
        axis = Rotation(*turn).axis  # type: ignore[arg-type]
        if isinstance(axis, str):
            continue
        numbers = _numbers(axis, values)
        if numbers is not None and not any(numbers):
            raise MechanismError(
                f"frames.{frame.name}.rotations[{i}].axis: {list(axis)} is the zero vector, which is no axis"
            )


def _check_quaternion(m: Description, frame: Frame, names_in: NamesIn, values: Values) -> None:
    where, entries = f"frames.{frame.name}.quaternion", tuple(frame.quaternion or ())
    used = {name for i, entry in enumerate(entries) for name in names_in(f"{where}[{i}]", entry)}
    if any(q.name in used for q in m.coordinates):
        return  # a constraint keeps the norm, see ``norms``
    numbers = _numbers(entries, values)
    norm = 1.0 if numbers is None else math.hypot(*numbers)
    if not abs(norm - 1.0) <= ROUNDING:
        raise MechanismError(f"{where}: has the norm {norm!r} instead of 1; divide its entries by that, exactly")


def _check_inertia(body: Body, values: Values) -> Iterator[str]:
    """Raise MechanismError if a principal moment is negative or all are 0; warn if the triangle inequality is broken.

    One moment may be 0: a thin rod has none about its own axis. A body without mass needs no inequality, because it
    stands for an inertia about one axis, such as that of a gear.
    """
    numbers = _numbers(body.inertia, values) if isinstance(body.inertia, tuple) else None
    if numbers is None:
        return
    least, middle, greatest = principal_moments(*numbers)
    where, shown = f"bodies.{body.name}.inertia", ", ".join(f"{x:.6g}" for x in (least, middle, greatest))
    if not (greatest > 0 and least >= -ROUNDING * greatest):
        remedy = "Ixy is the entry of the tensor, minus the integral of x y dm" if any(numbers) else "leave it out"
        raise MechanismError(f"{where}: {numbers} is not positive, its principal moments are {shown} kg.m2; {remedy}")
    if body.mass != 0 and least + middle < greatest * (1 - ROUNDING):
        yield (
            f"{where}: {numbers} violates the triangle inequality, its principal moments are {shown} kg.m2; "
            "no body has a moment greater than the sum of the other two"
        )


def principal_moments(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> list[float]:
    """The eigenvalues of a symmetric matrix of 3 rows, ascending, by Jacobi's rotations.

    Source: G. H. Golub, C. F. Van Loan, Matrix Computations, section 8.5.
    """
    a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    for _ in range(12):  # sweeps; convergence is quadratic
        for i, j in ((0, 1), (0, 2), (1, 2)):
            if a[i][j]:
                _annihilate(a, i, j)
    return sorted(a[i][i] for i in range(3))


def _annihilate(a: Matrix, i: int, j: int) -> None:
    """Turn ``a`` in the plane of ``i`` and ``j`` such that a[i][j] vanishes."""
    angle = 0.5 * math.atan2(2 * a[i][j], a[j][j] - a[i][i])
    c, s = math.cos(angle), math.sin(angle)
    for row in a:
        row[i], row[j] = c * row[i] - s * row[j], s * row[i] + c * row[j]
    a[i], a[j] = (
        [c * x - s * y for x, y in zip(a[i], a[j], strict=True)],
        [s * x + c * y for x, y in zip(a[i], a[j], strict=True)],
    )
