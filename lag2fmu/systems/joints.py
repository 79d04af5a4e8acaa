"""Ideal joints between places of FMUs: the record, the words that say one, and its element in a description.

SSP knows no joints. They stand in an annotation of the system, which other tools pass by.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite

from lag2fmu.description.joints import JOINTS, Kind
from lag2fmu.description.places import AXES
from lag2fmu.description.ports import JOINED, PLACE
from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.systems.components import Component, ComponentTerminal
from lag2fmu.systems.connections import End
from lag2fmu.xml_tree import XmlElement

ANNOTATION, SPACE = "org.lag2fmu.joints", "urn:lag2fmu:joints"
"""The type of the annotation, and the namespace of the elements in it."""
_GROUPS = {"point", "line", "plane", "axis", "turn"}
KINDS = {name: kind for name, kind in JOINTS.items() if {*kind.equations} <= _GROUPS} | {
    "slot": Kind(("line",), None, ("axis",), planar=("line",)),
    "rod": Kind(("rod",), None, (), planar=("rod",)),
}
"""The kinds of joints: those of the table ``joints`` of a mechanism that hold without a number more, and two of points.
The second place of a slot is on the axis. A rod keeps the distance that both places have at the start."""
Axis = tuple[float, float, float]
NUMBERS = ("damping", "stiffness", "rest")
"""The numbers of a joint's own force, in SI units; all are 0 by default."""


@dataclass(frozen=True)
class IdealJoint:
    """The terminals ``first`` and ``second`` of places, joined by a joint of one of the ``KINDS``.

    The ``axis``, a vector in the axes of the first place, is that of the second place too. It means what it means in a
    mechanism, see ``lag2fmu.description.joints.Joint``. A revolute joint that is turned by q (rad), and a prismatic
    one that is out by q (m), may have a force of its own, -``damping`` q' - ``stiffness`` (q - ``rest``).
    """

    first: End
    second: End
    kind: str
    axis: Axis
    damping: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether it has a force of its own."""
        return bool(self.damping or self.stiffness)

    def __str__(self) -> str:
        return f"{self.first}:{self.second}={self.kind}"


@dataclass(frozen=True)
class Ends:
    """A joint with the terminals of its two ends, as their components declare them."""

    joint: IdealJoint
    first: ComponentTerminal
    second: ComponentTerminal

    def inputs(self, component: str) -> Iterator[str]:
        """The inputs of the ``component`` that the joint may drive."""
        for end, terminal in ((self.joint.first, self.first), (self.joint.second, self.second)):
            if end.component == component:
                yield from (x for member, x in terminal.members.items() if member.startswith(("force", "torque")))


def joined(words: Iterable[str], components: Mapping[str, Component]) -> tuple[IdealJoint, ...]:
    """The joints in ``words`` such as 'arm.tip:load.hook=revolute:z'; the axis is x, y, z or three numbers.

    Numbers of its own force follow, as in 'a.tip:b.hook=revolute:z:damping=0.1:stiffness=40:rest=0.5'. Raises LoadError
    for words that say no joint, and for places that cannot be joined in this way.
    """
    found = []
    for word in words:
        where = f"--join {word}"
        places, equals, how = word.partition("=")
        first, colon, second = places.partition(":")
        if not (equals and colon):
            raise LoadError(f"{where}: expected COMPONENT.PLACE:COMPONENT.PLACE=KIND, e.g. a.tip:b.hook=revolute:z")
        kind, *more = (part.strip() for part in how.split(":"))
        axis = more.pop(0) if more and "=" not in more[0] else ""
        one, other = (_end(end.strip(), components, where) for end in (first, second))
        joint = IdealJoint(one, other, kind, _axis(axis, where), **_own(more, where))
        ends_of(joint, components, where)
        found.append(joint)
    return tuple(found)


def _end(word: str, components: Mapping[str, Component], where: str) -> End:
    """The terminal of the place in COMPONENT.PLACE."""
    name, point, place = word.partition(".")
    if not (point and place):
        raise LoadError(f"{where}: '{word}' is no COMPONENT.PLACE")
    if name not in components:
        raise LoadError(f"{where}: there is no component '{name}'; {suggestion(name, components)}")
    places = {x.removesuffix("_port"): x for x, t in components[name].terminals.items() if t.kind == PLACE}
    if place not in places:
        remedy = suggestion(place, places) if places else "export it with --port poses=NAME,forces=NAME"
        raise LoadError(f"{where}: '{name}' has no terminal of a place '{place}'; {remedy}")
    return End(name, places[place])


def _axis(word: str, where: str) -> Axis:
    """The vector in ``word``: x, y, z, or three numbers with commas; z if it is empty."""
    if not word or word in AXES:
        k = AXES.index(word or "z")
        return float(k == 0), float(k == 1), float(k == 2)
    try:
        x, y, z = (float(entry) for entry in word.split(","))
    except ValueError:
        raise LoadError(f"{where}: '{word}' is no axis; give x, y, z or three numbers, e.g. 1,0,0") from None
    if not 0.0 < x * x + y * y + z * z < float("inf"):
        raise LoadError(f"{where}: the axis {word} has no direction; give a vector that is not zero")
    return x, y, z


def _own(words: Iterable[str], where: str) -> dict[str, float]:
    """The numbers in ``words`` such as damping=0.1."""
    found = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or name not in NUMBERS:
            raise LoadError(f"{where}: '{word}' is no number of a joint; {suggestion(name, NUMBERS)}")
        found[name] = _number(value, f"{where}: {name}")
    return found


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise LoadError(f"{where}: '{text}' is no number") from None
    if not isfinite(value):
        raise LoadError(f"{where}: {text} is not finite")
    return value


def ends_of(joint: IdealJoint, components: Mapping[str, Component], where: str) -> Ends:
    """The terminals that the ``joint`` joins; raises LoadError, which begins with ``where``, if they do not fit it."""
    if joint.kind not in KINDS:
        raise LoadError(f"{where}: '{joint.kind}' is no joint between FMUs; {suggestion(joint.kind, KINDS)}")
    if joint.first == joint.second:
        raise LoadError(f"{where}: both ends are one place; join two places")
    if joint.acts and joint.kind not in ("revolute", "prismatic"):
        raise LoadError(f"{where}: damping and stiffness go with a revolute or a prismatic joint")
    ends = Ends(joint, *(_terminal(end, components, where) for end in (joint.first, joint.second)))
    _check_plane(ends, where)
    for end, terminal in ((joint.first, ends.first), (joint.second, ends.second)):
        missing = [*_missing(terminal, turning=joint.acts or not {*groups_of(ends)} <= {"point", "rod"})]
        if missing:
            name = end.connector.removesuffix("_port")
            options = " ".join(f"--port {key}={name}" for key in missing)
            raise LoadError(f"{where}: {end} lacks what this joint needs; export that FMU with {options}")
    return ends


def _check_plane(ends: Ends, where: str) -> None:
    """Raise LoadError for a joint of the plane with space, and for a kind that there is in space only."""
    first, second = is_planar(ends.first), is_planar(ends.second)
    if first != second:
        raise LoadError(f"{where}: one place moves in the plane and the other in space; join two of one kind")
    if first and not KINDS[ends.joint.kind].planar:
        known = ", ".join(name for name in KINDS if KINDS[name].planar)
        raise LoadError(f"{where}: there is no joint '{ends.joint.kind}' in the plane; give one of {known}")


def _terminal(end: End, components: Mapping[str, Component], where: str) -> ComponentTerminal:
    terminal = components[end.component].terminals.get(end.connector) if end.component in components else None
    if terminal is None or terminal.kind != PLACE:
        raise LoadError(f"{where}: {end} is no terminal of a place")
    if terminal.rule not in (JOINED, "bus"):  # FMUs made before there was a rule of joints are buses
        raise LoadError(f"{where}: {end} matches by '{terminal.rule}'; places that are joined match by '{JOINED}'")
    return terminal


def _missing(terminal: ComponentTerminal, *, turning: bool) -> Iterator[str]:
    """The keys of ports that the FMU would have to be exported with."""
    planar, members = is_planar(terminal), terminal.members
    if "position_x" not in members or (turning and not {"angle", "quaternion_0", "rotation_11"} & {*members}):
        yield "poses"
    if "force_x" not in members:
        yield "forces"
    if turning and ("torque" if planar else "torque_x") not in members:
        yield "torques"


def is_planar(terminal: ComponentTerminal) -> bool:
    """Whether the place moves in the plane."""
    return not any(member.endswith("_z") for member in terminal.members)


def groups_of(ends: Ends) -> tuple[str, ...]:
    """The groups of equations of the joint, see ``joint_shapes``."""
    kind = KINDS[ends.joint.kind]
    return kind.planar if is_planar(ends.first) else kind.equations


def read_joint(element: XmlElement, place: tuple[str, ...], where: str) -> IdealJoint:
    """The joint in an ``element`` of the annotation of the system at ``place``; raises LoadError for what is none."""
    try:
        x, y, z = map(float, element.get("axis").split())
    except ValueError:
        raise LoadError(f"{where}: the axis '{element.get('axis')}' of a joint is not three numbers") from None
    sides = [(element.get(f"{side}Element"), element.get(f"{side}Terminal")) for side in ("first", "second")]
    first, second = (End(".".join((*place, name)), terminal) for name, terminal in sides)
    own = {name: _number(element.get(name, "0"), f"{where}: {name} of a joint") for name in NUMBERS}
    return IdealJoint(first, second, element.get("kind"), (x, y, z), **own)


def attributes_of(joint: IdealJoint) -> dict[str, str]:
    """The attributes of the element of a ``joint``, which ``read_joint`` reads."""
    sides = {"first": joint.first, "second": joint.second}
    named = {f"{side}Element": end.component for side, end in sides.items()}
    return {
        "kind": joint.kind,
        **named,
        **{f"{side}Terminal": end.connector for side, end in sides.items()},
        "axis": " ".join(map(repr, joint.axis)),
        **{name: repr(value) for name in NUMBERS if (value := getattr(joint, name))},
    }
