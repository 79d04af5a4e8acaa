"""modelDescription.xml: start values, units, and the dependencies of the model structure."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from archives import xml
from describing import described
from stepping import Stepping, bits

import lag2fmu
from lag2fmu.checking.schema import problems
from lag2fmu.errors import ExportError
from lag2fmu.fmu import Fmu, export, read_mechanism
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.versions.fmi2 import to_xml
from lag2fmu.fmu.versions.shared import add_units
from lag2fmu.formats.loading import bundled, load
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter

pytestmark = pytest.mark.fmu


@pytest.fixture(params=["double_pendulum", "cart_pole", "motion_driven_pendulum", "vertically_driven_pendulum"])
def full(request, exported) -> Fmu:
    """An FMU with all local variables promoted to outputs."""
    return exported(request.param, outputs=("all",))


def test_fmpy_finds_nothing(fmu: Fmu) -> None:
    assert problems(fmu.path) == []


def test_fmpy_finds_nothing_with_all_outputs(full: Fmu) -> None:
    assert problems(full.path) == []


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_start_values_are_those_of_the_library(kind: str, fmu: Fmu) -> None:
    """Bit for bit, before and after initialization."""
    starts = {
        v.get("name"): v[0].get("start") for v in xml(fmu).iter("ScalarVariable") if v[0].get("start") is not None
    }
    expected = bits([float(text) for text in starts.values()])
    with Stepping(fmu.path, kind) as host:
        assert bits(host.get(list(starts))) == expected
        host.start()
        assert bits(host.get(list(starts))) == expected


def test_awkward_start_values_survive(tmp_path) -> None:
    awkward = {"a": 0.1, "b": 1 / 3, "c": 5e-324, "d": 1.7976931348623157e308, "e": 2.0**53 + 2, "f": -0.0, "g": 1e22}
    parameters = [parameter(name, value) for name, value in awkward.items()]
    x = coordinate("x", start=math.pi, velocity=-math.e)
    mechanism = Mechanism(
        "awkward", coordinates=[x], parameters=parameters, energy=Energy(kinetic=x.dot**2 * (1 + parameters[0]) / 2)
    )
    fmu = export(mechanism, tmp_path / "awkward.fmu")
    with Stepping(fmu.path) as host:
        assert bits(host.get([*awkward, "x", "x_dot"])) == bits([*awkward.values(), math.pi, -math.e])
    assert read_mechanism(fmu.path) == mechanism


def test_units_are_defined_and_used(fmu: Fmu) -> None:
    root = xml(fmu)
    defined = {u.get("name"): {d.get("name") for d in u.iter("DisplayUnit")} for u in root.iter("Unit")}
    used: dict[str | None, set[str | None]] = {}
    for real in root.iter("Real"):
        if real.get("unit") is not None:
            used.setdefault(real.get("unit"), set()).update({real.get("displayUnit")} - {None})
        else:
            assert real.get("displayUnit") is None
    assert used == defined
    for base in root.iter("BaseUnit"):
        assert set(base.attrib) <= {"kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"}


def test_units_of_the_cart_pole(exported) -> None:
    root = xml(exported("cart_pole"))
    bases = {u.get("name"): {k: int(e) for k, e in u.find("BaseUnit").attrib.items()} for u in root.iter("Unit")}
    units = {v.get("name"): v[0].get("unit") for v in root.iter("ScalarVariable")}
    expected = {
        "x": {"m": 1},
        "x_dot": {"m": 1, "s": -1},
        "x_ddot": {"m": 1, "s": -2},
        "der_x_dot": {"m": 1, "s": -2},
        "theta": {"rad": 1},
        "der_theta": {"rad": 1, "s": -1},
        "theta_ddot": {"rad": 1, "s": -2},
        "Q_x": {"kg": 1, "m": 1, "s": -2},
        "Q_theta": {"kg": 1, "m": 2, "s": -2},
        "p_x": {"kg": 1, "m": 1, "s": -1},
        "p_theta": {"kg": 1, "m": 2, "s": -1},
        "kinetic_energy": {"kg": 1, "m": 2, "s": -2},
        "external_power": {"kg": 1, "m": 2, "s": -3},
        "I0": {"kg": 1, "m": 2},
        "c": {"kg": 1, "s": -1},
        "time": {"s": 1},
        "solver_step": {"s": 1},
    }
    assert {name: bases[units[name]] for name in expected} == expected
    shown = {d.get("name"): float(d.attrib["factor"]) for d in root.iter("DisplayUnit")}
    assert shown["deg"] == pytest.approx(180 / math.pi, rel=1e-15), "value in deg = factor * value in rad"


def unknowns(root: ET.Element, tag: str) -> dict[int, tuple[list[int], list[str]]]:
    """index -> (dependencies, kinds) of a list in ModelStructure, in its order."""
    found = {}
    for unknown in root.find("ModelStructure").find(tag):
        if "dependencies" not in unknown.attrib:  # on everything
            found[int(unknown.attrib["index"])] = ([], [])
            continue
        dependencies = [int(i) for i in unknown.attrib["dependencies"].split()]
        kinds = unknown.get("dependenciesKind", " ".join(["dependent"] * len(dependencies))).split()
        found[int(unknown.attrib["index"])] = (dependencies, kinds)
        assert len(kinds) == len(dependencies)
        assert dependencies == sorted(set(dependencies))
    return found


@pytest.mark.parametrize("outputs", [(), ("all",)])
@pytest.mark.parametrize("model", bundled())
def test_sets_and_order_of_the_model_structure(model: str, outputs: tuple[str, ...]) -> None:
    """FMI 2.0.5, section 2.2.8, computed anew from the attributes of the variables."""
    mechanism = load(model)
    root = ET.fromstring(to_xml(described(mechanism, outputs)[0]))
    variables = list(root.iter("ScalarVariable"))
    number = {v.get("name"): i for i, v in enumerate(variables, start=1)}
    outs = [i for i, v in enumerate(variables, start=1) if v.get("causality") == "output"]
    derivatives = {
        i: int(v[0].attrib["derivative"]) for i, v in enumerate(variables, start=1) if "derivative" in v[0].attrib
    }
    calculated = {i for i, v in enumerate(variables, start=1) if v.get("initial") in ("calculated", "approx")}
    parameters = {i for i, v in enumerate(variables, start=1) if v.get("causality") == "calculatedParameter"}
    states = set(derivatives.values())

    assert list(unknowns(root, "Outputs")) == outs
    assert list(unknowns(root, "Derivatives")) == sorted(derivatives)
    expected = (set(outs) | states | set(derivatives)) & calculated | parameters
    assert list(unknowns(root, "InitialUnknowns")) == sorted(expected)

    massless = {"x"} if model == "slides_problem_5_small" else set()
    names = {name for q in mechanism.coordinates if q.name not in massless for name in (q.name, f"{q.name}_dot")}
    names |= {z.name for z in mechanism.states} | ({"dissipated_energy"} if mechanism.hybrid else set())
    assert {variables[i - 1].get("name") for i in states} == names
    for derivative, state in derivatives.items():
        assert variables[derivative - 1].get("name") == f"der_{variables[state - 1].get('name')}"
    inputs = {number[v.get("name")] for v in variables if v.get("causality") in ("input", "independent")}
    exact = {i for i, v in enumerate(variables, start=1) if v.get("initial") == "exact"}
    for tag, knowns in (
        ("Outputs", inputs | states),
        ("Derivatives", inputs | states),
        ("InitialUnknowns", inputs | exact),
    ):
        for index, (dependencies, kinds) in unknowns(root, tag).items():
            assert set(dependencies) <= knowns, (tag, index)
            if index in states and tag != "InitialUnknowns":
                assert (dependencies, kinds) == ([index], ["constant"])


def test_dependencies_are_what_differences_show(full: Fmu) -> None:
    """What differs from zero somewhere is listed, and what is listed differs from zero somewhere.

    The second half not where terms cancel that the graph keeps apart: with moving supports, and in qd dL/dqd - L.
    """
    exactly = full.mechanism.name in ("double_pendulum", "cart_pole")
    root = xml(full)
    variables = [v.get("name") for v in root.iter("ScalarVariable")]
    generator = np.random.default_rng(2)
    with Stepping(full.path, "ModelExchange") as host:
        host.start()
        listed = unknowns(root, "Outputs") | unknowns(root, "Derivatives")
        inputs = [v.get("name") for v in root.iter("ScalarVariable") if v.get("causality") == "input"]
        knowns = [*host.states_of_derivatives, *inputs, "time"]
        size = np.zeros((len(listed), len(knowns)))
        for _ in range(8):
            host.set({name: generator.uniform(0.2, 1.2) for name in knowns if name != "time"})
            host.unit.setTime(generator.uniform(0.2, 5.0))
            for column, known in enumerate(knowns):
                found = host.derivative([variables[i - 1] for i in listed], {known: 1.0})
                size[:, column] = np.maximum(size[:, column], np.abs(found))
    # what cancels leaves rounding: the largest entries are about 10
    shown = {
        i: {known for known, x in zip(knowns, row, strict=True) if x > 1e-11}
        for i, row in zip(listed, size, strict=True)
    }
    for index, (dependencies, _) in listed.items():
        names = {variables[i - 1] for i in dependencies}
        assert shown[index] <= names, f"{variables[index - 1]} depends on {shown[index] - names} too"
        if exactly and variables[index - 1] != "generalized_energy":
            assert names == shown[index], f"{variables[index - 1]} does not depend on {names - shown[index]}"


def test_promotion_changes_causality_and_nothing_else(exported) -> None:
    plain, promoted = exported("pendulum"), exported("pendulum", outputs=("theta_ddot", "kinetic_energy"))

    def causality(fmu: Fmu) -> dict[str | None, str | None]:
        return {v.get("name"): v.get("causality") for v in xml(fmu).iter("ScalarVariable")}

    changed = {name for name, value in causality(promoted).items() if causality(plain)[name] != value}
    assert changed == {"theta_ddot", "kinetic_energy"}
    assert {causality(promoted)[name] for name in changed} == {"output"}
    assert list(causality(promoted)) == list(causality(plain))


def test_all_promotes_every_local_that_is_no_derivative(exported) -> None:
    root = xml(exported("pendulum", outputs=("all",)))
    locals_ = {v.get("name") for v in root.iter("ScalarVariable") if v.get("causality") == "local"}
    assert locals_ == {"der_theta", "der_theta_dot"}
    run = lag2fmu.simulate(exported("pendulum", outputs=("all",)), stop_time=0.1)
    assert {"theta_ddot", "p_theta", "total_energy", "external_power"} <= set(run.names)


@pytest.mark.parametrize("name", ["theta_dddot", "", "g", "Q_theta", "time", "der_theta"])
def test_what_cannot_be_promoted(name: str, tmp_path) -> None:
    with pytest.raises(ExportError, match=f"--output {name}:"):
        export(load("pendulum"), tmp_path / "pendulum.fmu", outputs=(name,))
    assert list(tmp_path.iterdir()) == []


def test_promoting_an_output_is_no_error(exported) -> None:
    assert xml(exported("pendulum", outputs=("x", "theta"))).get("guid") == xml(exported("pendulum")).get("guid")


def test_a_unit_of_broken_powers_has_no_base_unit() -> None:
    """The standard's base units have whole exponents; the display unit says what the number means."""
    root = ET.Element("fmiModelDescription")
    stiffness = ScalarVariable("K", 0, "parameter", "tunable", "exact", unit=parse_unit("N/mm^1.5"), start=1.0)
    add_units(root, [stiffness])
    (unit,) = root.iter("Unit")
    assert unit.get("name") == "kg/m^0.5/s2"
    assert [child.tag for child in unit] == ["DisplayUnit"]
    assert float(unit[0].get("factor", "")) == pytest.approx(1e-3**1.5)
