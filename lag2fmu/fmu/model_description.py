"""modelDescription.xml from the variable table, by the rules of FMI 2.0.5, sections 2.2, 3.3 and 4.3."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone

from lag2fmu.fmu.elements import ENUMERATIONS
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.xml_text import document
from lag2fmu.language.unit_table import BASE_UNITS, Exponents
from lag2fmu.language.units import RADIAN, SECOND, Unit, parse_unit
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Interface:
    """What an FMU of a backend offers: ``capabilities`` {kind of FMU: attributes} beside those that all have.

    ``log_categories`` {name: description}; ``event_indicators``: their number, None where the attribute is left out.
    """

    capabilities: Mapping[str, Mapping[str, str]]
    log_categories: Mapping[str, str]
    event_indicators: int | None


@dataclass(frozen=True)
class ModelDescription:
    """What modelDescription.xml says: the mechanism, its variables in order, the identifier and the GUID.

    ``source_files`` are the names of the files in sources/ that have to be compiled.
    """

    mechanism: Mechanism
    variables: tuple[ScalarVariable, ...]
    model_identifier: str
    guid: str
    solver: str
    version: str
    interface: Interface
    source_files: tuple[str, ...] = ()


def to_xml(description: ModelDescription) -> bytes:
    """modelDescription.xml, UTF-8: values in SI units with the user's unit as displayUnit; FMI 2.0.5, section 2.2."""
    indicators = description.interface.event_indicators
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": description.mechanism.title,
            "guid": description.guid,
            "description": _description(description.mechanism),
            "generationTool": f"lag2fmu {description.version}",
            **_generation_time(),
            "variableNamingConvention": "flat",
            **({} if indicators is None else {"numberOfEventIndicators": str(indicators)}),
        },
    )
    _capabilities(root, description)
    _units(root, description.variables)
    _types(root, description.variables)
    categories = ET.SubElement(root, "LogCategories")
    for name, text in description.interface.log_categories.items():
        ET.SubElement(categories, "Category", {"name": name, "description": text})
    experiment = description.mechanism.experiment
    ET.SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0.0",
            "stopTime": repr(float(experiment.stop_time)),
            "tolerance": repr(float(experiment.tolerance)),
            "stepSize": repr(float(experiment.step)),
        },
    )
    variables = ET.SubElement(root, "ModelVariables")
    index = {v.name: i for i, v in enumerate(description.variables, start=1)}
    for variable in description.variables:
        _scalar_variable(variables, variable, index)
    _structure(root, description.variables, index)
    return document(root)


def _description(mechanism: Mechanism) -> str:
    return f"{mechanism.title}. {mechanism.source}".strip()


def _generation_time() -> dict[str, str]:
    """generationDateAndTime, only where SOURCE_DATE_EPOCH asks for one: the same input gives the same bytes."""
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not epoch.isdigit():
        return {}
    return {"generationDateAndTime": datetime.fromtimestamp(int(epoch), timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")}


def heeds_steps(mechanism: Mechanism) -> bool:
    """Whether an FMU in model exchange has to hear of the importer's steps.

    What drifts off the constraints beyond the importer's tolerance is brought back by an event, and singular positions
    are passed with what was known at the last step. Ranges that are left and motions without velocities are noticed.
    """
    bounded = any(c.minimum is not None or c.maximum is not None for c in mechanism.coordinates)
    return bool(mechanism.constraints or mechanism.motions) or bounded


def _capabilities(root: ET.Element, description: ModelDescription) -> None:
    common = {
        "modelIdentifier": description.model_identifier,
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    }
    for kind, offered in description.interface.capabilities.items():
        capabilities = dict(offered)
        if kind == "ModelExchange" and heeds_steps(description.mechanism):
            capabilities["completedIntegratorStepNotNeeded"] = "false"
        parent = ET.SubElement(root, kind, common | capabilities)
        if description.source_files:
            files = ET.SubElement(parent, "SourceFiles")
            for file in description.source_files:
                ET.SubElement(files, "File", {"name": file})


# ------------------------------------------------------------------------------------------------------------- units


def _units(root: ET.Element, variables: Iterable[ScalarVariable]) -> None:
    """One Unit per SI unit in use, each with the display units that the variables ask for."""
    units: dict[str, Unit] = {}
    displays: dict[str, dict[str, Unit]] = {}
    for variable in variables:
        unit = variable.unit
        if unit is not None and unit.si_name:
            units.setdefault(unit.si_name, unit)
            shown = _display_unit(unit)
            if shown is not None:
                displays.setdefault(unit.si_name, {})[shown.name] = shown
    if not units:
        return
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(units):
        element = ET.SubElement(definitions, "Unit", {"name": name})
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


def _display_unit(unit: Unit) -> Unit | None:
    """What a variable is shown in: the user's unit if it is not SI, degrees for angles."""
    if unit.si_name != unit.name:
        return unit
    if unit.exponents == RADIAN.exponents:
        return parse_unit("deg")
    if unit.exponents == (RADIAN / SECOND).exponents:
        return parse_unit("deg/s")
    return None


def _types(root: ET.Element, variables: Iterable[ScalarVariable]) -> None:
    """TypeDefinitions of the enumerations in use, if any (section 2.2.3)."""
    used = sorted({v.type for v in variables} & {*ENUMERATIONS})
    if not used:
        return
    definitions = ET.SubElement(root, "TypeDefinitions")
    for name in used:
        simple = ET.SubElement(definitions, "SimpleType", {"name": name, "description": ENUMERATIONS[name].doc})
        parent = ET.SubElement(simple, "Enumeration")
        for item, (value, doc) in ENUMERATIONS[name].items.items():
            ET.SubElement(parent, "Item", {"name": item, "value": str(value), "description": doc})


# --------------------------------------------------------------------------------------------------------- variables


def _scalar_variable(parent: ET.Element, variable: ScalarVariable, index: dict[str, int]) -> None:
    attributes = {"name": variable.name, "valueReference": str(variable.value_reference)}
    if variable.doc:
        attributes["description"] = variable.doc
    attributes |= {"causality": variable.causality, "variability": variable.variability}
    if variable.initial is not None:
        attributes["initial"] = variable.initial
    element = ET.SubElement(parent, "ScalarVariable", attributes)
    if variable.type in ENUMERATIONS:
        ET.SubElement(element, "Enumeration", {"declaredType": variable.type})
    elif variable.type == "Integer":
        ET.SubElement(element, "Integer", {} if variable.minimum is None else {"min": str(int(variable.minimum))})
    else:
        ET.SubElement(element, "Real", _real(variable, index))


def _real(variable: ScalarVariable, index: dict[str, int]) -> dict[str, str]:
    """The attributes of <Real>."""
    real: dict[str, str] = {}
    if variable.unit is not None and variable.unit.si_name:
        name = variable.unit.si_name
        real |= {"quantity": variable.unit.quantity} if variable.unit.quantity else {}
        real["unit"] = name
        shown = _display_unit(variable.unit)
        real |= {"displayUnit": shown.name} if shown is not None else {}
    for key, number in (
        ("min", variable.minimum),
        ("max", variable.maximum),
        ("nominal", variable.nominal),
        ("start", variable.start),
    ):
        if number is not None and (key != "nominal" or number != 1.0):
            real[key] = repr(float(number))
    if variable.derivative_of is not None:
        real["derivative"] = str(index[variable.derivative_of])
    return real


def _structure(root: ET.Element, variables: tuple[ScalarVariable, ...], index: dict[str, int]) -> None:
    """ModelStructure: Outputs, Derivatives and InitialUnknowns, each in ascending order (section 2.2.8)."""
    structure = ET.SubElement(root, "ModelStructure")
    continuous = {v.name for v in variables if v.causality in ("input", "independent") or v.state}
    exact = continuous | {v.name for v in variables if v.initial == "exact"}
    # states whose starts constraints determine: what depends on them depends on everything, which no list says
    solved = {v.name for v in variables if v.initial == "approx" and v.state}
    outputs = [v for v in variables if v.causality == "output"]
    derivatives = [v for v in variables if v.derivative_of is not None]
    initial = [v for v in variables if _is_initial_unknown(v)]
    _unknowns(structure, "Outputs", outputs, continuous, set(), index)
    _unknowns(structure, "Derivatives", derivatives, continuous, set(), index)
    _unknowns(structure, "InitialUnknowns", initial, exact, solved, index)


def _unknowns(
    structure: ET.Element,
    tag: str,
    unknowns: Sequence[ScalarVariable],
    knowns: set[str],
    solved: set[str],
    index: dict[str, int],
) -> None:
    """The element ``tag`` with its unknowns; the dependencies of those that need what is ``solved`` are not listed."""
    if not unknowns:
        return
    parent = ET.SubElement(structure, tag)
    for unknown in unknowns:
        if solved & {unknown.name, *(unknown.dependencies or ())}:
            ET.SubElement(parent, "Unknown", {"index": str(index[unknown.name])})
        else:
            _unknown(parent, unknown, knowns, index)


def _is_initial_unknown(v: ScalarVariable) -> bool:
    """Whether ``v`` is computed at initialization and listed: an output, a dependent parameter or a derivative."""
    listed = v.causality in ("output", "calculatedParameter") or v.derivative_of is not None
    return listed and v.initial in ("calculated", "approx")


def _unknown(parent: ET.Element, unknown: ScalarVariable, knowns: set[str], index: dict[str, int]) -> None:
    """An entry of ModelStructure. What changes at events may depend on everything then, which no list says."""
    if unknown.variability == "discrete":
        ET.SubElement(parent, "Unknown", {"index": str(index[unknown.name])})
        return
    dependencies = sorted(index[name] for name in unknown.dependencies or () if name in knowns)
    attributes = {"index": str(index[unknown.name]), "dependencies": " ".join(map(str, dependencies))}
    if unknown.state or (unknown.derivative_of is not None and len(dependencies) == 1 and _is_velocity(unknown)):
        attributes["dependenciesKind"] = "constant"
    ET.SubElement(parent, "Unknown", attributes)


def _is_velocity(unknown: ScalarVariable) -> bool:
    """Whether the derivative is a state itself (der_theta = theta_dot): its dependency has the constant factor 1."""
    return unknown.dependencies is not None and unknown.dependencies == (f"{unknown.derivative_of}_dot",)
