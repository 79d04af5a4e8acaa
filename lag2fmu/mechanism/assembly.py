"""Mechanisms made of mechanisms: what the parts of a description bring, written out under their names in the whole.

Energies, generalized forces and gravity are added up: the Lagrangian of the whole is the sum of those of its parts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.events import IMPACTS
from lag2fmu.description.parts import Energy, Force, Gravity
from lag2fmu.description.subsystems import Part
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import check_identifier, suggestion
from lag2fmu.language.units import DIMENSIONLESS, Unit
from lag2fmu.mechanism.loads import with_inputs
from lag2fmu.mechanism.placing import placed
from lag2fmu.mechanism.renaming import SHARED, renamed

MAX_PARTS = 1000
"""The most parts that are read; a part of a part counts each time that it is used."""


class Settable(NamedTuple):
    """What a setting of a part can set: an entry of ``table`` in ``unit``; ``rate``: its velocity at the start."""

    table: str
    unit: Unit
    rate: bool = False


def assembled(written: Description) -> tuple[Description, dict[str, str]]:
    """``written`` without parts, whose entries stand behind its own, and the origins of these entries.

    The origins are {place of an entry: place of the part or joint that brings it}. Raises MechanismError, naming the
    part, for names that are unknown or clash, and for more than MAX_PARTS parts.
    """
    if not written.parts:
        return written, {}
    _check_parts(written)
    whole = _opened(replace(written, parts=()))
    own = {*(q.name for q in written.coordinates), *written.driven}
    origins = {f"coordinates.{x}": f"joints.{j.name}" for j in whole.joints for x in j.coordinate_names if x not in own}
    for part in written.parts:
        try:
            brought = _brought(part, whole, replaced=written.gravity is not None)
        except MechanismError as error:
            raise MechanismError(f"{part.place}: {error}") from error
        whole = _merged(whole, brought, part, origins)
    return whole, origins


def _check_parts(written: Description) -> None:
    """Raise MechanismError for names of parts that are no identifiers or stand twice, and for too many parts."""
    for name, times in Counter(part.name for part in written.parts).items():
        check_identifier(name, "parts")
        if times > 1:
            raise MechanismError(f"parts: the name '{name}' is used twice; rename one")
    counts: dict[int, int] = {}

    def count(d: Description) -> int:
        if id(d) not in counts:
            counts[id(d)] = sum(1 + count(_mechanism(part)) for part in d.parts)
        return counts[id(d)]

    if count(written) > MAX_PARTS:
        raise MechanismError(f"parts: there are {count(written)} with those of parts; at most {MAX_PARTS} are read")


def _mechanism(part: Part) -> Description:
    if not isinstance(part.of, Description):
        found = type(part.of).__name__
        raise MechanismError(f"{part.place}: expected a Mechanism or a Description, got {found} '{part.of}'")
    return part.of


def _opened(d: Description) -> Description:
    """``d`` with the coordinates that joints on a parent bring."""
    known = {*(q.name for q in d.coordinates), *d.driven}
    brought = {q.name: q for joint in d.joints for q in joint.own_coordinates() if q.name not in known}
    return replace(d, coordinates=(*d.coordinates, *brought.values()))


def _brought(part: Part, whole: Description, replaced: bool) -> Description:
    """The description that ``part`` brings to ``whole``; ``replaced``: the gravity of the whole replaces the part's."""
    d = _opened(assembled(_mechanism(part))[0])
    _check_shared(d, part, whole)
    if replaced:
        d = _without_gravity(d, part)
    return placed(_with_settings(renamed(d, part.prefix, part.share), d, part), str(part.parent), whole)


def _check_shared(d: Description, part: Part, whole: Description) -> None:
    """Raise MechanismError unless part and whole both have what is shared, in the same table and the same unit."""
    tables = {x.name: table for table in SHARED for x in getattr(d, table)}
    for name in part.share:
        if name not in tables:
            remedy = suggestion(name, tables)
            raise MechanismError(f"share: '{name}' is no parameter, input or table of the part; {remedy}")
        table = tables[name]
        (own,) = (x for x in getattr(d, table) if x.name == name)
        found = next((x for x in getattr(whole, table) if x.name == name), None)
        if found is None:
            raise MechanismError(f"share: the whole has no {table}.{name}; write it there, or leave '{name}' out here")
        _check_alike(own, found, f"{table}.{name}")


def _check_alike(own: Any, found: Any, label: str) -> None:
    """Raise MechanismError unless what part and whole share under this ``label`` is of one dimension and one kind."""
    units = [x.unit for x in (own, found) if isinstance(getattr(x, "unit", None), Unit)]
    if len(units) == 2 and units[0].dimension != units[1].dimension:
        raise MechanismError(
            f"share: {label} is in {units[0].name or 1} here and in {units[1].name or 1} in the whole; "
            "give both one unit, or do not share it"
        )
    if getattr(own, "motion", False) != getattr(found, "motion", False):
        raise MechanismError(f"share: {label} is a motion in one of part and whole only; make both the same")


def _without_gravity(d: Description, part: Part) -> Description:
    """``d`` without its gravity, which that of the whole replaces, and without parameters of this gravity alone."""
    entries = [(x.table, {s.name for s in x.expression.free_symbols}) for x in d.entries()]
    used = {name for table, found in entries if table != "gravity" for name in found}
    idle = {name for table, found in entries if table == "gravity" for name in found} - used
    for item in part.settings:
        if item.name in idle - set(part.share):
            raise MechanismError(
                f"set.{item.name}: belongs to the part's gravity, for which the whole has its own; leave it out"
            )
    kept = tuple(p for p in d.parameters if p.name not in idle or p.name in part.share)
    return replace(d, gravity=None, parameters=kept)


# -------------------------------------------------------------------------------------------------------- settings


def settable(d: Description) -> dict[str, Settable]:
    """{name: Settable} of all parameters and starts of the mechanism ``d``, those of its parts included.

    Raises MechanismError if its parts do not fit into it.
    """
    d = _opened(assembled(d)[0])
    found = {p.name: Settable("parameters", _unit(p)) for p in d.parameters}
    found |= {u.name: Settable("inputs", _unit(u)) for u in (*d.inputs, *(u for _, u in with_inputs(d)[1]))}
    found |= {z.name: Settable("states", _unit(z)) for z in d.states}
    found |= {q.name: Settable("coordinates", _unit(q)) for q in d.coordinates}
    return found | {names.velocity(q.name): Settable("coordinates", _unit(q), rate=True) for q in d.coordinates}


def _unit(part: Any) -> Unit:
    return part.unit if isinstance(part.unit, Unit) else DIMENSIONLESS


def _with_settings(d: Description, before: Description, part: Part) -> Description:
    """``d`` with the settings of ``part``; ``before`` is ``d`` with the names that it has in the part."""
    if not part.set:
        return d
    known = settable(before)
    for name, value in part.settings:
        where = f"set.{name}"
        if name in part.share:
            raise MechanismError(f"{where}: is shared, so that the whole says its value; leave out one of the two")
        if name not in known:
            raise MechanismError(f"{where}: is no parameter or start of the part; {suggestion(name, known)}")
        of = known[name]
        if of.table != "parameters" and not value.is_number:
            raise MechanismError(f"{where}: '{value}' is no number; only a parameter may follow those of the whole")
        if of.table == "inputs" and part.prefix + name not in {u.name for u in d.inputs}:
            loads, inputs = with_inputs(d)
            d = replace(d, loads=tuple(loads), inputs=(*d.inputs, *(u for _, u in inputs)))
        changed: Any = {of.table: tuple(_set(x, part.prefix + name, value, of) for x in getattr(d, of.table))}
        d = replace(d, **changed)
    return d


def _set(record: Any, name: str, value: sp.Expr, of: Settable) -> Any:
    """``record`` with the ``value``, if it is called ``name``; a start stays exact or a guess."""
    if (names.velocity(record.name) if of.rate else record.name) != name:
        return record
    if of.table != "parameters":
        return replace(record, **{"velocity" if of.rate else "start": float(value)})
    if value.is_number:
        return replace(record, value=float(value), expression=None)
    return replace(record, value=None, expression=value)


# --------------------------------------------------------------------------------------------------------- merging


def _merged(whole: Description, brought: Description, part: Part, origins: dict[str, str]) -> Description:
    """``whole`` with the entries that ``part`` has ``brought`` behind its own; adds them to ``origins``."""
    tables: dict[str, Any] = {}
    for name, of in table_keys().items():
        if not of.many or name in ("parts", "forces"):
            continue
        own, new = getattr(whole, name), getattr(brought, name)
        _check_clash(own, new, name, part, origins)
        tables[name] = (*own, *new)
        origins |= {f"{name}.{x.name}": f"parts.{part.name}" for x in new}
    return replace(
        whole,
        **tables,
        forces=_forces(whole.forces, brought.forces),
        energy=_energy(whole.energy, brought.energy),
        gravity=_gravity(whole.gravity, brought.gravity, part),
        ports=whole.ports.with_those_of(brought.ports),
        not_taken=(*whole.not_taken, *(f"{what} ({part.name})" for what in brought.not_taken)),
        impacts=max(whole.impacts, brought.impacts, key=IMPACTS.index),
    )


def _check_clash(own: Iterable[Any], new: Iterable[Any], table: str, part: Part, origins: Mapping[str, str]) -> None:
    taken = {label_of(x) for x in own}
    for x in new:
        if x.name in taken:
            other = origins.get(f"{table}.{x.name}", "the whole")
            name = x.name.removeprefix(part.prefix)
            raise MechanismError(
                f"{part.place}: its {table}.{name} becomes {table}.{x.name}, which {other} has too; rename one of them"
            )


def _forces(own: Iterable[Force], brought: Iterable[Force]) -> tuple[Force, ...]:
    """The forces of both; those on one coordinate are added up."""
    new = {force.coordinate: force for force in brought}
    both = [
        replace(x, expression=x.expression + new.pop(x.coordinate).expression) if x.coordinate in new else x
        for x in own
    ]
    return (*both, *new.values())


def _energy(a: Energy, b: Energy) -> Energy:
    """The sum of both energies; it is a Lagrangian if one of them is a Lagrangian."""

    def total(*terms: Any) -> Any:
        given = [x for x in terms if x is not None]
        return sp.Add(*given) if given else None

    dissipation = total(a.dissipation, b.dissipation)
    if a.lagrangian is None and b.lagrangian is None:
        return Energy(total(a.kinetic, b.kinetic), total(a.potential, b.potential), dissipation)
    minus = [None if x.potential is None else -x.potential for x in (a, b)]
    return Energy(None, None, dissipation, total(a.lagrangian, b.lagrangian, a.kinetic, b.kinetic, *minus))


def _gravity(whole: Gravity | None, brought: Gravity | None, part: Part) -> Gravity | None:
    if whole is not None and brought is not None and whole != brought:
        raise MechanismError(
            f"{part.place}: its gravity is another one than that of a part before it, and a mechanism has one; write "
            "[gravity] in the whole, which replaces theirs"
        )
    return whole if brought is None else brought
