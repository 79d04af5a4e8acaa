"""The parts that both writers of modelDescription.xml share: head, units, log categories, experiment, bounds."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from datetime import datetime, timezone

from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import BASE_UNITS, RADIAN, SECOND, Exponents, Unit
from lag2fmu.mechanism.record import Mechanism


def head(description: ModelDescription) -> dict[str, str]:
    """The attributes of the root that both versions have, from the description to the naming convention."""
    return {
        "description": _description(description.mechanism),
        **description.mechanism.imprint,
        "generationTool": f"lag2fmu {description.version}",
        **_generation_time(),
        "variableNamingConvention": "flat",
    }


def _description(mechanism: Mechanism) -> str:
    return f"{mechanism.title}. {mechanism.provenance}".strip()


def _generation_time() -> dict[str, str]:
    """generationDateAndTime, only where SOURCE_DATE_EPOCH asks for one: the same input gives the same bytes."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch.isdigit():
        return {}
    return {"generationDateAndTime": datetime.fromtimestamp(int(epoch), timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")}


def add_categories(root: ET.Element, description: ModelDescription) -> None:
    """LogCategories."""
    categories = ET.SubElement(root, "LogCategories")
    for name, text in description.interface.log_categories.items():
        ET.SubElement(categories, "Category", {"name": name, "description": text})


def add_experiment(root: ET.Element, description: ModelDescription) -> None:
    """DefaultExperiment; its step is none that the bound of steps in real time forbids."""
    experiment, bound = description.mechanism.experiment, description.bound
    step = experiment.step if bound is None else min(experiment.step, bound.longest)
    ET.SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0.0",
            "stopTime": repr(float(experiment.stop_time)),
            "tolerance": repr(float(experiment.tolerance)),
            "stepSize": repr(float(step)),
        },
    )


def add_units(root: ET.Element, variables: Iterable[ScalarVariable]) -> None:
    """One Unit per SI unit in use, each with the display units that the variables ask for."""
    units: dict[str, Unit] = {}
    displays: dict[str, dict[str, Unit]] = {}
    for variable in variables:
        unit = variable.unit
        if unit is not None and unit.si_name:
            units.setdefault(unit.si_name, unit)
            shown = display_unit(unit)
            if shown is not None:
                displays.setdefault(unit.si_name, {})[shown.name] = shown
    if not units:
        return
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(units):
        element = ET.SubElement(definitions, "Unit", {"name": name})
        if units[name].is_whole:  # the standard has whole exponents only
            exponents = _base_exponents(name, units[name].exponents)
            ET.SubElement(element, "BaseUnit", {b: str(e) for b, e in zip(BASE_UNITS, exponents, strict=True) if e})
        for shown in sorted(displays.get(name, {}).values(), key=lambda u: u.name):
            attributes = {"name": shown.name, "factor": repr(1.0 / shown.factor)}
            if shown.offset:
                attributes["offset"] = repr(-shown.offset / shown.factor)
            ET.SubElement(element, "DisplayUnit", attributes)


def _base_exponents(name: str, exponents: Exponents) -> Exponents:
    """The exponents of a unit; that of rad is 0 if the unit's name has no rad (a torque is N.m, not N.m/rad)."""
    return exponents if "rad" in name else (*exponents[:-1], 0)


def display_unit(unit: Unit) -> Unit | None:
    """The unit in which a variable is shown: the user's unit if it is not SI, degrees for angles; None for others."""
    if unit.si_name != unit.name:
        return unit
    if unit.exponents == RADIAN.exponents:
        return parse_unit("deg")
    if unit.exponents == (RADIAN / SECOND).exponents:
        return parse_unit("deg/s")
    return None


def unit_attributes(unit: Unit | None) -> dict[str, str]:
    """The attributes quantity, unit and displayUnit; none where the ``unit`` is not known."""
    if unit is None or not unit.si_name:
        return {}
    found = {"quantity": unit.quantity} if unit.quantity else {}
    shown = display_unit(unit)
    return found | {"unit": unit.si_name} | ({"displayUnit": shown.name} if shown is not None else {})


def number_attributes(**numbers: float | None) -> dict[str, str]:
    """The attributes of ``numbers`` that are given, in full precision."""
    return {key: repr(float(number)) for key, number in numbers.items() if number is not None}
