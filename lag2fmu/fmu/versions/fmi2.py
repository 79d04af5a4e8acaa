"""FMI 2.0: modelDescription.xml by the rules of FMI 2.0.5, sections 2.2, 3.3 and 4.3."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from lag2fmu.fmu.elements import ENUMERATIONS
from lag2fmu.fmu.model_description import Interface, ModelDescription, heeds_steps
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.structure import Unknown, structure
from lag2fmu.fmu.versions.shared import (
    add_categories,
    add_experiment,
    add_units,
    head,
    number_attributes,
    unit_attributes,
)
from lag2fmu.fmu.versions.version import CATEGORIES, Version
from lag2fmu.fmu.xml_text import document

INTERFACE = Interface(
    capabilities={
        "ModelExchange": {"providesDirectionalDerivative": "true", "completedIntegratorStepNotNeeded": "true"},
        "CoSimulation": {
            "providesDirectionalDerivative": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "2",
        },
    },
    log_categories=CATEGORIES,
)


def to_xml(description: ModelDescription) -> bytes:
    """modelDescription.xml, UTF-8: values in SI units with the user's unit as displayUnit; FMI 2.0.5, section 2.2."""
    indicators = description.interface.event_indicators
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": "2.0",
            "modelName": description.mechanism.title,
            "guid": description.guid,
            **head(description),
            **({} if indicators is None else {"numberOfEventIndicators": str(indicators)}),
        },
    )
    _capabilities(root, description)
    add_units(root, description.variables)
    _types(root, description.variables)
    add_categories(root, description)
    add_experiment(root, description)
    variables = ET.SubElement(root, "ModelVariables")
    index = {v.name: i for i, v in enumerate(description.variables, start=1)}
    for variable in description.variables:
        _scalar_variable(variables, variable, index)
    _structure(root, description.variables, index)
    return document(root)


def _capabilities(root: ET.Element, description: ModelDescription) -> None:
    common = {
        "modelIdentifier": description.model_identifier,
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
    }
    for kind, offered in description.interface.capabilities.items():
        capabilities = dict(offered)
        if kind == "ModelExchange" and heeds_steps(description):
            capabilities["completedIntegratorStepNotNeeded"] = "false"
        parent = ET.SubElement(root, kind, common | capabilities)
        if description.source_files:
            files = ET.SubElement(parent, "SourceFiles")
            for file in description.source_files:
                ET.SubElement(files, "File", {"name": file})


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
    nominal = None if variable.nominal == 1.0 else variable.nominal
    real = unit_attributes(variable.unit)
    real |= number_attributes(min=variable.minimum, max=variable.maximum, nominal=nominal, start=variable.start)
    if variable.derivative_of is not None:
        real["derivative"] = str(index[variable.derivative_of])
    return real


def _structure(root: ET.Element, variables: tuple[ScalarVariable, ...], index: dict[str, int]) -> None:
    """ModelStructure: Outputs, Derivatives and InitialUnknowns, each in ascending order (section 2.2.8)."""
    found = structure(variables, known_parameters=False)
    parent = ET.SubElement(root, "ModelStructure")
    _unknowns(parent, "Outputs", found.outputs, index)
    _unknowns(parent, "Derivatives", found.derivatives, index)
    _unknowns(parent, "InitialUnknowns", found.initial, index)


def _unknowns(structure: ET.Element, tag: str, unknowns: Iterable[Unknown], index: dict[str, int]) -> None:
    """The element ``tag`` with its unknowns, left out if there are none."""
    parent = None
    for unknown in unknowns:
        parent = ET.SubElement(structure, tag) if parent is None else parent
        attributes = {"index": str(index[unknown.name])}
        if unknown.dependencies is not None:
            attributes["dependencies"] = " ".join(str(index[name]) for name in unknown.dependencies)
        if unknown.constant:
            attributes["dependenciesKind"] = "constant"
        ET.SubElement(parent, "Unknown", attributes)


FMI2 = Version("2.0", "fmi2", INTERFACE, to_xml, folders=lambda platform: platform.folders, icon="model.png")
