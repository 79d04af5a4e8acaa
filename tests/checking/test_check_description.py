"""Each rule on modelDescription.xml finds the fault that is seeded, in an FMU in which nothing is found otherwise."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from faults import Fault, index, spoiled, unknown, variable

from lag2fmu.checking import check_fmu

pytestmark = pytest.mark.fmu
MODEL = "motion_driven_pendulum"


def put(of: str | None = None, /, value: bool = False, **attributes: str | None) -> Fault:
    """Set attributes of a variable, of its type (``value``), or of the root; None removes one."""

    def fault(root: ET.Element) -> None:
        element = root if of is None else variable(root, of)
        _set(element[0] if value else element, attributes)

    return fault


def at(path: str, **attributes: str | None) -> Fault:
    """Set attributes of the first element at ``path``."""
    return lambda root: _set(root.find(path), attributes)


def knows(group: str, name: str, dependencies: str, kinds: str | None = None) -> Fault:
    """Set the dependencies of an unknown, given as names."""

    def fault(root: ET.Element) -> None:
        listed = " ".join(index(root, known) for known in dependencies.split())
        _set(unknown(root, group, name), {"dependencies": listed, "dependenciesKind": kinds})

    return fault


def _set(element: ET.Element, attributes: dict[str, str | None]) -> None:
    for key, text in attributes.items():
        if text is None:
            element.attrib.pop(key, None)
        else:
            element.set(key, text)


def reverse(root: ET.Element) -> None:
    unknowns = root.find("ModelStructure/InitialUnknowns")
    unknowns[:] = list(unknowns)[::-1]


def co_simulation_only(root: ET.Element) -> None:
    root.remove(root.find("ModelExchange"))


def reinit(root: ET.Element) -> None:
    co_simulation_only(root)
    variable(root, "theta")[0].set("reinit", "true")


def again(path: str) -> Fault:
    """Repeat the last child of the element at ``path``."""
    return lambda root: root.find(path).append(copy.deepcopy(root.find(path)[-1]))


def without(group: str, name: str) -> Fault:
    return lambda root: root.find(f"ModelStructure/{group}").remove(unknown(root, group, name))


def listed(group: str, number: str) -> Fault:
    return lambda root: root.find(f"ModelStructure/{group}").append(ET.Element("Unknown", {"index": number}))


def typed(attributes: dict[str, str], *items: dict[str, str], kind: str = "Real", name: str = "theta") -> Fault:
    """A type, with items, that the variable ``name`` is declared by."""

    def fault(root: ET.Element) -> None:
        definitions = ET.Element("TypeDefinitions")
        simple = ET.SubElement(definitions, "SimpleType", {"name": "Angle"} | attributes)
        declared = ET.SubElement(simple, kind)
        for item in items:
            ET.SubElement(declared, "Item", item)
        root.insert([child.tag for child in root].index("LogCategories"), definitions)
        variable(root, name)[0].set("declaredType", "Angle")

    return fault


def enumeration(start: str, *values: str) -> Fault:
    """The parameter m as an enumeration."""

    def fault(root: ET.Element) -> None:
        typed({}, *({"name": f"item{i}", "value": v} for i, v in enumerate(values)), kind="Enumeration")(root)
        variable(root, "theta")[0].attrib.pop("declaredType")
        m = variable(root, "m")
        m[0].tag, m[0].attrib = "Enumeration", {"declaredType": "Angle", "start": start}

    return fault


def alias(first: str, second: str, **attributes: str) -> Fault:
    def fault(root: ET.Element) -> None:
        variable(root, second).set("valueReference", variable(root, first).get("valueReference"))
        _set(variable(root, second)[0], dict(attributes))

    return fault


def constant_alias(root: ET.Element) -> None:
    variable(root, "x").attrib |= {"variability": "constant", "initial": "exact"}
    variable(root, "x")[0].set("start", "1.0")
    alias("x", "y")(root)


# The table of FMI-RULES: what public validators miss.
ELEVEN = {
    "initial unknowns unsorted": (reverse, "initial-unknowns-order"),
    "modelIdentifier a-b": (at("CoSimulation", modelIdentifier="a-b"), "model-identifier"),
    "stop before start": (at("DefaultExperiment", stopTime="-1.0"), "stop-time"),
    "reinit in co-simulation": (reinit, "co-simulation-only"),
    "start above max": (put("m", value=True, max="0.5"), "start-range"),
    "nominal below 0": (put("theta", value=True, nominal="-1.0"), "nominal"),
    "output depends on itself": (knows("Outputs", "x", "theta x"), "self-dependency"),
    "output depends on a parameter": (knows("Outputs", "x", "theta l"), "dependency-known"),
    "dependency twice": (knows("Outputs", "x", "theta theta"), "dependencies-duplicate"),
    "dependencies unsorted": (knows("Outputs", "y", "y0 theta"), "dependencies-order"),
    "serialize without get": (at("CoSimulation", canGetAndSetFMUstate="false"), "capabilities"),
}

OTHERS = {
    "schema": (put(guid=None), "schema"),
    "version": (put(fmiVersion="2.0.1"), "fmi-version"),
    "guid empty": (put(guid=""), "guid"),
    "guid short": (put(guid="{1}"), "guid-form"),
    "date without Z": (put(generationDateAndTime="2024-01-01T00:00:00+00:00"), "date"),
    "no event indicators": (put(numberOfEventIndicators=None), "event-indicators"),
    "step 0": (at("DefaultExperiment", stepSize="0"), "experiment"),
    "tolerance negative": (at("DefaultExperiment", tolerance="-1e-6"), "experiment"),
    "stop time NaN": (at("DefaultExperiment", stopTime="NaN"), "not-finite"),
    "start INF": (put("m", value=True, start="INF"), "not-finite"),
    "source twice": (again("CoSimulation/SourceFiles"), "source-duplicate"),
    "source that is not there": (at("CoSimulation/SourceFiles/File", name="absent.c"), "source-missing"),
    "log category twice": (again("LogCategories"), "log-category"),
    "unit twice": (again("UnitDefinitions"), "unit-duplicate"),
    "display unit of factor 0": (at("UnitDefinitions//DisplayUnit", factor="0"), "unit-factor"),
    "unit not defined": (put("m", value=True, unit="lb"), "unit-undefined"),
    "unit empty": (put("m", value=True, unit=""), "unit-undefined"),
    "displayUnit without unit": (put("theta", value=True, unit=None), "display-unit"),
    "displayUnit not defined": (put("theta", value=True, displayUnit="turn"), "display-unit"),
    "min above max": (put("m", value=True, min="3", max="2"), "min-max"),
    "start below min": (put("m", value=True, min="3"), "start-range"),
    "initial of an input": (put("y0", initial="exact"), "initial-given"),
    "no start of a parameter": (put("m", value=True, start=None), "start-missing"),
    "start of a calculated output": (put("x", value=True, start="1.0"), "start-forbidden"),
    "causality and variability": (put("m", variability="continuous"), "combination"),
    "two variables of a name": (put("m", name="l"), "name-duplicate"),
    "no name": (put("m", name=""), "name-empty"),
    "name with a blank": (put("m", name="m "), "name-blank"),
    "structured names": (
        lambda r: (put(variableNamingConvention="structured")(r), put("m", name="1m")(r)),
        "name-grammar",
    ),
    "derivative of nothing": (put("der_theta", value=True, derivative="99"), "derivative"),
    "derivative of itself": (put("der_theta", value=True, derivative="25"), "derivative"),
    "derivative of an input": (put("der_theta", value=True, derivative="5"), "derivative"),
    "unit of a derivative": (put("der_theta_dot", value=True, unit="m/s2"), "derivative-unit"),
    "reinit of an output": (put("x", value=True, reinit="true"), "reinit"),
    "multiple set of a parameter": (put("m", canHandleMultipleSetPerTimeInstant="true"), "multiple-set"),
    "second independent": (
        put("x", causality="independent", initial=None),
        "independent",
    ),
    "type not defined": (put("theta", value=True, declaredType="Angle"), "type-undefined"),
    "type of another kind": (typed({}, kind="Integer"), "type-kind"),
    "type with the name of a variable": (typed({"name": "theta"}), "type-name"),
    "items of one value": (enumeration("1", "1", "1"), "enumeration-item"),
    "start that is no item": (enumeration("7", "1", "2"), "enumeration-start"),
    "alias with another unit": (alias("x", "theta_ddot"), "alias-unit"),
    "alias with a second start": (alias("y0", "solver_max_step"), "alias-start"),
    "aliases that are both set": (alias("m", "l"), "alias-settable"),
    "constant with a varying alias": (constant_alias, "alias-constant"),
    "output not listed": (without("Outputs", "x"), "outputs"),
    "local variable listed as output": (listed("Outputs", "14"), "outputs"),
    "derivative not listed": (without("Derivatives", "der_theta"), "derivatives-unlisted"),
    "derivative without its attribute": (put("der_theta", value=True, derivative=None), "derivatives"),
    "initial unknown not listed": (without("InitialUnknowns", "x"), "initial-unknowns"),
    "exact state as initial unknown": (listed("InitialUnknowns", "3"), "initial-unknowns"),
    "index of nothing": (listed("Outputs", "99"), "structure-index"),
    "listed twice": (again("ModelStructure/Outputs"), "structure-duplicate"),
    "dependency on nothing": (
        lambda r: unknown(r, "Outputs", "x").set("dependencies", "2 99"),
        "dependencies-index",
    ),
    "dependency on a local": (knows("Outputs", "x", "theta p_theta"), "dependency-known"),
    "initial dependency on what is calculated": (knows("InitialUnknowns", "x", "theta l y"), "dependency-known"),
    "more kinds than dependencies": (knows("Outputs", "x", "theta", "dependent constant"), "kinds-length"),
    "kind fixed at initialization": (knows("InitialUnknowns", "x", "theta l", "fixed dependent"), "kinds-initial"),
    "state that depends on nothing": (knows("Outputs", "theta", ""), "state-output"),
}


@pytest.fixture(scope="module")
def good(exported) -> Path:
    return exported(MODEL).path


def test_nothing_is_found_without_a_fault(good: Path) -> None:
    assert check_fmu(good, run=False).findings == ()


@pytest.mark.parametrize(("fault", "rule"), ELEVEN.values(), ids=ELEVEN.keys())
def test_what_public_validators_miss(fault: Fault, rule: str, good: Path, tmp_path: Path) -> None:
    found = check_fmu(spoiled(good, tmp_path / "spoiled.fmu", fault), run=False)
    assert rule in {f.rule for f in found.findings}


@pytest.mark.parametrize(("fault", "rule"), OTHERS.values(), ids=OTHERS.keys())
def test_other_faults(fault: Fault, rule: str, good: Path, tmp_path: Path) -> None:
    found = check_fmu(spoiled(good, tmp_path / "spoiled.fmu", fault), run=False)
    assert rule in {f.rule for f in found.findings}
    for finding in found.findings:
        assert all((finding.place, finding.problem, finding.remedy))


def test_every_parameter_that_is_continuous_is_named(good: Path, tmp_path: Path) -> None:
    """Also beside another fault: fmpy stops at the first one, as in the Integers that PythonFMU writes by default."""

    def fault(root: ET.Element) -> None:
        put("m", value=True, max="0.5")(root)
        for name in ("m", "l"):
            put(name, variability=None)(root)

    found = check_fmu(spoiled(good, tmp_path / "spoiled.fmu", fault), run=False).findings
    assert [f.place.split()[-1] for f in found if f.rule == "combination"] == ["'m'", "'l'"]


def test_a_finding_names_its_line(good: Path, tmp_path: Path) -> None:
    path = spoiled(good, tmp_path / "spoiled.fmu", put("m", value=True, max="0.5"))
    (finding,) = check_fmu(path, run=False).findings
    lines = ET.tostring(ET.fromstring(_xml(path)), "unicode").splitlines()
    number = 2 + next(i for i, line in enumerate(lines) if '<ScalarVariable name="m"' in line)  # 1: declaration
    assert finding.place == f"modelDescription.xml:{number} 'm'"
    assert finding.problem == "start = 1 is outside of min = 0, max = 0.5"


def _xml(path: Path) -> bytes:
    from faults import DESCRIPTION, files_of

    return files_of(path)[DESCRIPTION]


def test_a_state_that_lists_itself_is_right(good: Path, tmp_path: Path) -> None:
    """With the factor 1, in words or by default; another kind is worth a warning."""
    path = tmp_path / "spoiled.fmu"
    assert check_fmu(spoiled(good, path, knows("Outputs", "theta", "theta")), run=False).findings == ()
    found = check_fmu(spoiled(good, path, knows("Outputs", "theta", "theta", "dependent")), run=False)
    assert [(f.rule, f.severity) for f in found.findings] == [("state-output", "warning")]
