"""Parameter sets and their mappings: what a binding of a system gives to which of its names.

Source: System Structure and Parameterization 2.0, Modelica Association 2024, sections 5.2.4 to 5.2.7.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from lag2fmu.errors import LoadError
from lag2fmu.systems.components import EnumeratedType, LinearUnit, linear_unit
from lag2fmu.systems.source import Source
from lag2fmu.systems.wires import SAME, Affine, Transformation, ValueTable, conversion
from lag2fmu.xml_tree import XmlElement

Units = Mapping[str, LinearUnit]
_FLAGS = {"true": 1.0, "1": 1.0, "false": 0.0, "0": 0.0}
_ENDS = ("source", "target")
"""The attributes of an entry in a table."""


@dataclass(frozen=True)
class Given:
    """A value that a binding gives: a number in ``unit``, or a text.

    On its way to its target a number is converted to the target's unit, unless ``keeps`` says that it is not, and then
    goes through ``map``.
    """

    where: str
    value: float | str
    unit: LinearUnit | None
    map: Transformation = SAME
    keeps: bool = False

    def item_of(self, enumerated: EnumeratedType) -> float | str:
        """The value for a target that is ``enumerated``: a text names an item. Raises LoadError if there is none."""
        if not isinstance(self.value, str):
            return self.value
        items = dict(enumerated.items)
        if self.value not in items:
            raise LoadError(f"{self.where}: '{self.value}' is no item of '{enumerated.name}': {', '.join(items)}")
        return float(items[self.value])

    def in_unit(self, wanted: LinearUnit | None) -> float | str:
        """The value for a target in the unit ``wanted``; raises LoadError for one that does not convert."""
        if isinstance(self.value, str):
            return self.value
        converted = SAME if self.keeps else conversion(self.where, self.unit, wanted)
        return self.map(converted(self.value))


def units_of(root: XmlElement) -> dict[str, LinearUnit]:
    """The units {name: unit} that a description or a parameter set defines."""
    return {unit.get("name"): linear_unit(unit) for unit in root.all("Units", "Unit")}


def transformation(
    element: XmlElement, where: str, items: Sequence[EnumeratedType | None] = (None, None)
) -> Transformation:
    """The transformation that ``element``, a connection or an entry of a mapping, has.

    ``items`` are the enumerations of what gives and of what hears. Raises LoadError, which begins with ``where``, for
    entries that are none. Source: System Structure and Parameterization 2.0, section 5.1.4.
    """
    for child in element.children:
        if child.tag == "LinearTransformation":
            factor, offset = (child.get(name, default) for name, default in (("factor", "1"), ("offset", "0")))
            return Affine(number(factor, where), number(offset, where))
        if child.tag.endswith("MappingTransformation"):
            kind, entries = child.tag.removesuffix("MappingTransformation"), list(child.all("MapEntry"))
            ends = [[_whole(e.get(x), kind, where, y) for e in entries] for x, y in zip(_ENDS, items, strict=True)]
            return ValueTable(where, tuple(zip(*ends, strict=True)))
    return SAME


def _whole(text: str, kind: str, where: str, items: EnumeratedType | None) -> int:
    """The number that a ``text`` in a table of this ``kind`` stands for: a whole number, a truth value or an item."""
    if kind == "Integer" and _is_whole(text):
        return int(text)
    known: Mapping[str, float] = _FLAGS if kind == "Boolean" else dict(items.items) if items else {}
    if kind == "Integer" or text not in known:
        listed = "whole numbers" if kind == "Integer" else ", ".join(known) or "known of variables of FMUs alone"
        raise LoadError(f"{where}: '{text}' is no value in a {kind}MappingTransformation; these are {listed}")
    return int(known[text])


def given_by(binding: XmlElement, source: Source) -> Iterator[tuple[str, Given]]:
    """(name of a target, what it gets) for all values of a ParameterBinding.

    Raises LoadError for files that cannot be read, and for values that are no numbers or texts.
    """
    if binding.get("sourceBase", "SSD") != "SSD":
        raise LoadError(f"{source.label}: parameters within a component (sourceBase='component') are not read here")
    reference, inline = binding.get("source"), next(binding.all("ParameterValues", "ParameterSet"), None)
    if inline is None and not reference:
        raise LoadError(f"{source.label}:{binding.line}: a ParameterBinding has neither source nor ParameterSet")
    parameters = inline if inline is not None else source.xml(reference)
    units, prefix = units_of(parameters), binding.get("prefix")
    entries = _mapping(binding, source)
    for parameter in parameters.all("Parameters", "Parameter"):
        name = prefix + parameter.get("name")
        where = f"{source.label}: the parameter '{name}'"
        value, unit = _value(parameter, where)
        if entries is None:
            yield name, Given(where, value, units.get(unit))
        for entry in entries or ():
            if entry.get("source") == name:
                keeps = entry.get("suppressUnitConversion") in ("true", "1")
                yield entry.get("target"), Given(where, value, units.get(unit), transformation(entry, where), keeps)


def _mapping(binding: XmlElement, source: Source) -> list[XmlElement] | None:
    """The entries of the binding's mapping; None without one."""
    mapping = binding.child("ParameterMapping")
    if mapping is None:
        return None
    found = source.xml(mapping.get("source")) if mapping.get("source") else mapping.child("ParameterMapping")
    return [] if found is None else list(found.all("MappingEntry"))


def _value(parameter: XmlElement, where: str) -> tuple[float | str, str]:
    """(value, name of its unit) of a Parameter."""
    for child in parameter.children:
        text = child.get("value")
        if child.tag == "String" or (child.tag == "Enumeration" and not _is_whole(text)):
            return text, ""
        if child.tag == "Boolean" and text in _FLAGS:
            return _FLAGS[text], ""
        if "value" in child.attributes:
            return number(text, where), child.get("unit")
    raise LoadError(f"{where} has no value")


def _is_whole(text: str) -> bool:
    return text.lstrip("+-").isdigit()


def number(text: str, where: str) -> float:
    """``text`` as a number; raises LoadError, which begins with ``where``."""
    try:
        return float(text)
    except ValueError:
        raise LoadError(f"{where}: '{text}' is no number") from None
