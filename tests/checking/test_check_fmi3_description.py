"""Each rule of FMI 3.0 on XML and folders finds the fault that is seeded, where nothing is found otherwise."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

import pytest
from faults import DESCRIPTION, Fault, written

from lag2fmu.checking import check_fmu
from lag2fmu.checking.description import read_document
from lag2fmu.checking.rulebooks import rulebook_of
from lag2fmu.checking.versions import described

GOOD = (Path(__file__).parent / "everything_fmi3.xml").read_bytes()
BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="everything"><SourceFileSet language="C99">
<SourceFile name="all.c"/><PreprocessorDefinition name="LEVEL" value="1"><Option value="1"/></PreprocessorDefinition>
<IncludeDirectory name="inc"/></SourceFileSet></BuildConfiguration></fmiBuildDescription>"""
CONFIGURATION = BUILD[BUILD.index("<BuildConfiguration") : BUILD.index("</fmiBuild")]
TERMINALS = """<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0"><GraphicalRepresentation>
<CoordinateSystem x1="-100" y1="-100" x2="100" y2="100" suggestedScalingFactorTo_mm="0.1"/>
<Icon x1="-100" y1="-100" x2="100" y2="100"/></GraphicalRepresentation><Terminals>
<Terminal name="flange" matchingRule="plug">
<TerminalMemberVariable variableName="s" memberName="s" variableKind="signal"/>
<TerminalMemberVariable variableName="u" memberName="f" variableKind="inflow"/>
<TerminalStreamMemberVariable inStreamMemberName="i" outStreamMemberName="o" inStreamVariableName="k"
 outStreamVariableName="total"/>
<TerminalGraphicalRepresentation iconBaseName="flange" x1="0" y1="0" x2="1" y2="1"/></Terminal>
<Terminal name="sensors" matchingRule="bus"/></Terminals></fmiTerminalsAndIcons>"""
MANIFEST = """<?xml version="1.0" encoding="UTF-8"?>
<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref"
 fmi-ls:fmi-ls-version="1.0" fmi-ls:fmi-ls-description="a run"><Related source="run.csv"/></fmiReferences>"""
BUILD_FILE, TERMINALS_FILE = "sources/buildDescription.xml", "terminalsAndIcons/terminalsAndIcons.xml"
MANIFEST_FILE = "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml"
FILES = {
    DESCRIPTION: GOOD,
    BUILD_FILE: BUILD.encode(),
    "sources/all.c": b"",
    "sources/inc/all.h": b"",
    TERMINALS_FILE: TERMINALS.encode(),
    "terminalsAndIcons/icon.png": b"",
    "terminalsAndIcons/flange.png": b"",
    MANIFEST_FILE: MANIFEST.encode(),
    "extra/org.fmi-standard.fmi-ls-ref/run.csv": b"",
    "documentation/index.html": b"",
    "documentation/licenses/license.txt": b"",
}


def element(root: ET.Element, name: str) -> ET.Element:
    """The variable, alias, type or unit ``name``, or the first element with this tag or path."""
    named = [e for e in root.iter() if e.get("name") == name]
    found = named[0] if named else root.find(name)
    assert found is not None, name
    return found


def put(of: str | None = None, /, **attributes: str | None) -> Fault:
    """Set attributes of an element, or of the root; None removes one."""

    def fault(root: ET.Element) -> None:
        target = root if of is None else element(root, of)
        for key, text in attributes.items():
            if text is None:
                del target.attrib[key]
            else:
                target.set(key, text)

    return fault


def knows(group: str, reference: str, **attributes: str | None) -> Fault:
    """Set attributes of an entry of ModelStructure."""
    return put(f"ModelStructure/{group}[@valueReference='{reference}']", **attributes)


def add(path: str, tag: str, **attributes: str) -> Fault:
    """Add an element at the end of the one at ``path``."""
    return lambda root: element(root, path).append(ET.Element(tag, attributes))


def listed(group: str, reference: str) -> Fault:
    """Add an entry behind the others of its group."""

    def fault(root: ET.Element) -> None:
        structure = element(root, "ModelStructure")
        last = max(i for i, entry in enumerate(structure) if entry.tag == group)
        structure.insert(last + 1, ET.Element(group, valueReference=reference))

    return fault


def gone(path: str) -> Fault:
    """Remove an element of the description."""

    def fault(root: ET.Element) -> None:
        target = element(root, path)
        parent = next(p for p in root.iter() if target in list(p))
        parent.remove(target)

    return fault


def again(name: str) -> Fault:
    """Repeat an element in its place."""

    def fault(root: ET.Element) -> None:
        target = element(root, name)
        parent = next(p for p in root.iter() if target in list(p))
        parent.insert(list(parent).index(target), copy.deepcopy(target))

    return fault


def both(*faults: Fault) -> Fault:
    def fault(root: ET.Element) -> None:
        for each in faults:
            each(root)

    return fault


HEAD = {
    "version of no such form": (put(fmiVersion="3.x"), "fmi-version"),
    "version with its revision": (put(fmiVersion="3.0.2"), "fmi-version"),
    "token empty": (put(instantiationToken=""), "guid"),
    "token short": (put(instantiationToken="{1}"), "guid-form"),
    "guid of 2.0": (put(guid="{1}"), "schema"),
    "number of event indicators as in 2.0": (put(numberOfEventIndicators="1"), "schema"),
    "date without Z": (put(generationDateAndTime="2024-01-01T00:00:00+00:00"), "date"),
    "serialize without get": (put("CoSimulation", canGetAndSetFMUState="false"), "capabilities"),
    "capability as FMI 2.0 spells it": (put("ModelExchange", canGetAndSetFMUstate="true"), "unknown-attribute"),
    "capability of another kind": (put("ModelExchange", hasEventMode="true"), "unknown-attribute"),
    "early return without updates": (put("CoSimulation", providesIntermediateUpdate="false"), "capabilities"),
    "evaluation without Event Mode": (
        put("CoSimulation", hasEventMode="false", providesEvaluateDiscreteStates="true"),
        "capabilities",
    ),
    "clocks without Event Mode": (put("CoSimulation", hasEventMode="false"), "clock-event-mode"),
    "own step size 0": (put("CoSimulation", fixedInternalStepSize="0"), "experiment"),
    "modelIdentifier": (put("ModelExchange", modelIdentifier="a-b"), "model-identifier"),
    "inverse unit with offset": (put("1/m", offset="1"), "unit-inverse"),
    "unit of a type": (put("Length", unit="lb"), "unit-undefined"),
    "type with displayUnit alone": (put("Length", unit=None), "display-unit"),
    "type with min above max": (put("Length", min="2000"), "min-max"),
    "type with the name of a variable": (put("Length", name="k"), "type-name"),
    "type twice": (again("Image"), "type-duplicate"),
    "type without room": (put("Image", maxSize="0"), "binary-size"),
    "items of one value": (put("touching", value="1"), "enumeration-item"),
    "stop before start": (put("DefaultExperiment", stopTime="-1"), "stop-time"),
    "tolerance NaN": (put("DefaultExperiment", tolerance="NaN"), "not-finite"),
    "annotation without domain": (put("Annotations/Annotation", type="note"), "annotation"),
}
VARIABLES = {
    "no such attribute": (put("k", aliases="1"), "schema"),
    "no such type": (lambda root: setattr(element(root, "k"), "tag", "Real"), "schema"),
    "continuous parameter": (put("k", variability="continuous"), "combination"),
    "constant input": (put("u", variability="constant"), "combination"),
    "calculated parameter that is exact": (put("kk", initial="exact", start="1"), "combination"),
    "continuous integer": (put("total", variability="continuous"), "variability"),
    "initial of time": (put("time", initial="exact"), "initial-given"),
    "no start of a parameter": (put("k", start=None), "start-missing"),
    "no start of an input": (put("u", start=None), "start-missing"),
    "start of what is calculated": (put("gap", start="1"), "start-forbidden"),
    "start of time": (put("time", start="0"), "start-forbidden"),
    "start above max": (put("k", start="7"), "start-range"),
    "an element's start above max": (put("x", start="1 2 3000"), "start-range"),
    "start INF": (put("x", start="1 INF 3"), "not-finite"),
    "start of odd digits": (put("ModelVariables/Binary/Start", value="0"), "binary-start"),
    "nominal of 0": (put("k", nominal="0"), "nominal"),
    "too few starts": (put("x", start="1 2"), "start-count"),
    "too many starts": (put("k", start="1 2"), "start-count"),
    "too many strings": (add("label", "Start", value="c"), "start-count"),
    "name twice": (put("k", name="kk"), "name-duplicate"),
    "alias with the name of a variable": (put("s", name="k"), "name-duplicate"),
    "alias without a name": (put("s", name=""), "name-empty"),
    "alias with a foreign displayUnit": (put("s", displayUnit="turn"), "display-unit"),
    "name that is not structured": (put("k", name="1k"), "name-grammar"),
    "equal value references": (put("kk", valueReference="5"), "reference-duplicate"),
    "no independent variable": (gone("time"), "independent"),
    "two independent variables": (put("gap", causality="independent", variability="continuous"), "independent"),
    "independent array": (add("time", "Dimension", start="1"), "independent"),
    "type not defined": (put("x", declaredType="Size"), "type-undefined"),
    "type of another kind": (put("k", declaredType="Mode"), "type-kind"),
    "start that is no item": (put("first", start="7"), "enumeration-start"),
    "unit not defined": (put("u", unit="lb"), "unit-undefined"),
    "derivative of nothing": (put("v", derivative="99"), "derivative"),
    "derivative of itself": (put("v", derivative="3"), "derivative"),
    "derivative of an integer": (put("gap", derivative="17"), "derivative"),
    "derivative of another size": (
        put("ModelVariables/Float64[@name='v']/Dimension", valueReference=None, start="2"),
        "derivative-size",
    ),
    "unit of a derivative": (put("v", unit="m"), "derivative-unit"),
    "reinit of no state": (put("gap", reinit="true"), "reinit"),
    "multiple set of a parameter": (put("k", canHandleMultipleSetPerTimeInstant="true"), "multiple-set"),
    "intermediate update of a parameter": (put("k", intermediateUpdate="true"), "intermediate-update"),
    "dimension without size": (add("k", "Dimension"), "dimension"),
    "dimension of both kinds": (add("k", "Dimension", start="1", valueReference="1"), "dimension"),
    "dimension of size 0": (add("k", "Dimension", start="0"), "dimension"),
    "dimension by no variable": (add("k", "Dimension", valueReference="99"), "dimension-parameter"),
    "dimension by a Float64": (add("gap", "Dimension", valueReference="5"), "dimension-parameter"),
    "dimension by an output": (add("gap", "Dimension", valueReference="17"), "dimension-parameter"),
    "structural parameter that starts at 0": (put("n", start="0"), "dimension-parameter"),
    "structural parameter with dimensions": (add("n", "Dimension", start="1"), "structural-parameter"),
    "clock that is a parameter": (put("tick", causality="parameter"), "clock-causality"),
    "clock that is tunable": (put("tick", variability="tunable"), "clock-variability"),
    "output clock with an interval": (
        put("impact", intervalVariability="constant", intervalDecimal="1"),
        "clock-output",
    ),
    "output clock with a priority": (put("impact", priority="1"), "clock-output"),
    "constant clock without interval": (put("tick", intervalDecimal=None, shiftDecimal=None), "clock-interval"),
    "triggered clock with interval": (put("impact", intervalDecimal="1"), "clock-interval"),
    "clock of interval 0": (put("tick", intervalDecimal="0"), "clock-interval"),
    "clock with counter alone": (put("counted", resolution=None), "clock-interval"),
    "clock with fractions unsaid": (put("counted", supportsFraction=None), "clock-interval"),
    "clocks that is empty": (put("count_before", clocks=""), "clocks"),
    "clocks that are none": (put("count_before", clocks="5"), "clocks"),
    "continuous variable of a clock": (put("gap", clocks="12"), "clocks"),
    "clock of itself": (put("impact", clocks="13"), "clocks"),
    "previous of nothing": (put("count", previous="99"), "previous"),
    "previous of another type": (put("count", previous="17"), "previous"),
    "previous without clock": (put("total", previous="15"), "previous"),
    "two of one previous": (put("total", previous="15", clocks="12"), "previous"),
}
STRUCTURE = {
    "output not listed": (gone("ModelStructure/Output[@valueReference='8']"), "outputs"),
    "local listed as output": (listed("Output", "7"), "outputs"),
    "index in place of a reference": (listed("Output", "99"), "structure-reference"),
    "output twice": (again("ModelStructure/Output"), "structure-duplicate"),
    "initial unknown not listed": (gone("ModelStructure/InitialUnknown[@valueReference='6']"), "initial-unknowns"),
    "exact state as initial unknown": (listed("InitialUnknown", "2"), "initial-unknowns"),
    "indicator as initial unknown": (listed("InitialUnknown", "7"), "initial-unknowns"),
    "no derivative": (put("v", derivative=None), "derivatives"),
    "two derivatives of one state": (
        both(put("gap", derivative="2"), listed("ContinuousStateDerivative", "7")),
        "derivatives",
    ),
    "state that is an input": (put("x", causality="input", initial="exact"), "derivatives"),
    "clocked state without previous": (put("count", previous=None), "clocked-state"),
    "clocked state not listed": (gone("ModelStructure/ClockedState"), "clocked-state"),
    "indicator that is discrete": (put("gap", variability="discrete"), "event-indicator"),
    "indicator that is an input": (put("gap", causality="input", start="0"), "event-indicator"),
    "dependency twice": (knows("Output", "8", dependencies="2 2", dependenciesKind=None), "dependencies-duplicate"),
    "dependency on nothing": (knows("Output", "14", dependencies="99"), "dependencies-reference"),
    "more kinds than dependencies": (knows("Output", "8", dependenciesKind="dependent dependent"), "kinds-length"),
    "kinds alone": (knows("Output", "8", dependencies=None), "kinds-length"),
    "kind fixed at initialization": (
        knows("InitialUnknown", "3", dependenciesKind="fixed dependent"),
        "kinds-initial",
    ),
    "factor for an enumeration": (knows("Output", "8", dependenciesKind="constant"), "kinds-type"),
    "output depends on itself": (knows("Output", "17", dependencies="17"), "self-dependency"),
    "dependency on an indicator": (knows("Output", "14", dependencies="7"), "dependency-known"),
    "initial dependency on what is calculated": (knows("InitialUnknown", "6", dependencies="7"), "dependency-known"),
    "order of the groups": (
        lambda root: element(root, "ModelStructure").append(ET.Element("Output", valueReference="2")),
        "schema",
    ),
}
Replace = Mapping[str, str | bytes | None]


def changed(name: str, text: str, old: str, new: str) -> Replace:
    """The file ``name``, with one piece of its text in another way."""
    assert old in text
    return {name: text.replace(old, new)}


def built(old: str, new: str) -> Replace:
    return changed(BUILD_FILE, BUILD, old, new)


def terminal(old: str, new: str) -> Replace:
    return changed(TERMINALS_FILE, TERMINALS, old, new)


def manifest(old: str, new: str) -> Replace:
    return changed(MANIFEST_FILE, MANIFEST, old, new)


FOLDERS: dict[str, tuple[Replace, str]] = {
    "folder of 2.0": ({"binaries/win64/everything.dll": b""}, "platform-tuple"),
    "static library without words": ({"binaries/x86_64-linux-gnu12/everything.a": b""}, "static-linking"),
    "unknown platform": ({"binaries/plan9/everything.so": b""}, "binary-folder"),
    "another name of the library": ({"binaries/x86_64-linux/other.so": b""}, "binary-name"),
    "licenses without entry": (
        {"documentation/licenses/license.txt": None, "documentation/licenses/mit.txt": b""},
        "license",
    ),
    "diagram as SVG alone": ({"documentation/diagram.svg": b""}, "diagram"),
    "icon of 2.0": ({"model.png": b""}, "icon"),
    "icon as SVG alone": ({"terminalsAndIcons/icon.svg": b"", "terminalsAndIcons/icon.png": None}, "icon"),
    "header of FMI": ({"sources/fmi3Functions.h": b""}, "sources-header"),
    "sources that nobody lists": ({BUILD_FILE: None}, "sources-unlisted"),
    "build description with another root": (built("fmiBuildDescription", "build"), "build-root"),
    "build description of another version": (built('fmiVersion="3.0"', 'fmiVersion="2.0"'), "build-version"),
    "build of another model": (built('modelIdentifier="everything"', 'modelIdentifier="x"'), "build-identifier"),
    "build of no source": (built('<SourceFile name="all.c"/>', ""), "build-empty"),
    "source that is not there": (built("all.c", "absent.c"), "source-missing"),
    "source twice": (built('<SourceFile name="all.c"/>', '<SourceFile name="all.c"/>' * 2), "source-duplicate"),
    "include directory that is not there": (built('"inc"', '"absent"'), "include-missing"),
    "value that is no option": (built('value="1"><', 'value="3"><'), "build-option"),
    "two fallbacks": (built(CONFIGURATION, 2 * CONFIGURATION), "build-platform"),
    "malformed build description": ({BUILD_FILE: b"<a"}, "xml"),
    "terminals with another root": (terminal("fmiTerminalsAndIcons", "terminals"), "terminals-root"),
    "terminals of another version": (terminal('fmiVersion="3.0"', 'fmiVersion="2.0"'), "terminals-version"),
    "terminal of no variable": (terminal('variableName="s"', 'variableName="y"'), "terminal-variable"),
    "terminal of a local variable": (terminal('variableName="s"', 'variableName="gap"'), "terminal-causality"),
    "terminal of an unknown kind": (terminal('"signal"', '"heat"'), "terminal-kind"),
    "terminal of an unknown rule": (terminal('"plug"', '"glue"'), "terminal-rule"),
    "terminal twice": (terminal('"sensors"', '"flange"'), "terminal-duplicate"),
    "member without a name": (terminal('memberName="f" ', ""), "terminal-member-name"),
    "members of one name": (terminal('memberName="f"', 'memberName="s"'), "terminal-member-name"),
    "stream without flow": (terminal('"inflow"', '"signal"'), "terminal-stream"),
    "stream in the wrong direction": (
        terminal('inStreamVariableName="k"', 'inStreamVariableName="total"'),
        "terminal-causality",
    ),
    "coordinates upside down": (terminal('x2="100" y2="100" s', 'x2="-200" y2="100" s'), "coordinate-system"),
    "coordinate that is no number": (terminal('y2="100"/>', 'y2="high"/>'), "schema"),
    "terminal with an unknown attribute": (terminal('name="sensors"', 'name="sensors" colour="red"'), "schema"),
    "terminal with an undeclared prefix": (terminal('name="sensors"', 'name="sensors" acme:colour="red"'), "schema"),
    "source with an unknown attribute": (
        built('<SourceFile name="all.c"/>', '<SourceFile name="all.c" path="."/>'),
        "schema",
    ),
    "icon of a terminal": (terminal('"flange" x1', '"absent" x1'), "icon-missing"),
    "icon of the FMU": ({"terminalsAndIcons/icon.png": None}, "icon-missing"),
    "manifest without namespace": (manifest("fmi-ls-manifest", "manifest"), "manifest"),
    "manifest without version": (manifest(' fmi-ls:fmi-ls-version="1.0"', ""), "manifest"),
    "manifest in another folder": (manifest("org.fmi-standard.fmi-ls-ref", "org.example"), "manifest-name"),
    "reference that is not there": (manifest("run.csv", "absent.csv"), "manifest-source"),
}
SCHEMA_OR_OWN = {"schema", "name-grammar"}
"""Rules that fmpy tells of; they need the whole check."""


def found_in(description: bytes) -> set[str]:
    """The rules of our own that modelDescription.xml breaks."""
    document = read_document(description)
    rules = rulebook_of(document)
    findings = list(rules.on_description(described(document)))
    assert all(f.place and f.problem and f.remedy for f in findings)
    return {f.rule for f in findings}


def archived(path: Path, changes: Replace) -> Path:
    files: dict[str, bytes] = {}
    for name, data in (FILES | dict(changes)).items():
        if data is not None:
            files[name] = data.encode() if isinstance(data, str) else data
    return written(files, path)


def test_nothing_is_found_without_a_fault(tmp_path: Path) -> None:
    found = check_fmu(archived(tmp_path / "x.fmu", {}))
    assert found.findings == (), str(found)
    assert found_in(GOOD) == set()


IN_XML = HEAD | VARIABLES | STRUCTURE


@pytest.mark.parametrize(("fault", "rule"), IN_XML.values(), ids=IN_XML)
def test_faults_of_the_description(fault: Fault, rule: str, tmp_path: Path) -> None:
    root = ET.fromstring(GOOD)
    before = ET.tostring(root)
    fault(root)
    assert ET.tostring(root) != before
    text = ET.tostring(root, "UTF-8", xml_declaration=True)
    found = found_in(text)
    if rule in SCHEMA_OR_OWN:
        found |= {f.rule for f in check_fmu(archived(tmp_path / "x.fmu", {DESCRIPTION: text}), run=False).findings}
    assert rule in found


@pytest.mark.parametrize(("changes", "rule"), FOLDERS.values(), ids=FOLDERS)
def test_faults_of_folders_and_files(changes: Replace, rule: str, tmp_path: Path) -> None:
    found = check_fmu(archived(tmp_path / "x.fmu", changes), run=False)
    assert rule in {f.rule for f in found.findings}
    others = {f.rule for f in found.findings if f.severity == "error"} - {rule}
    assert others <= {"binary-format", "icon-missing"}
