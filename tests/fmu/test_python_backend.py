"""The python backend: the same ports and the same motion as the c backend, behaviour as the standard wants it."""

from __future__ import annotations

import ast
import filecmp
import importlib
import os
import subprocess
import sys
import textwrap
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from stepping import ERROR, Stepping, bits

import lag2fmu
from lag2fmu.checking.schema import problems
from lag2fmu.codegen.python_sources import printable
from lag2fmu.dynamics import derive, lower
from lag2fmu.errors import BuildError, ExportError, SimulationError
from lag2fmu.fmu import Fmu, ModelDescription, export
from lag2fmu.fmu.backends.python import INTERFACE, check_choices, python_fmu
from lag2fmu.formats.loading import load, with_values
from lag2fmu.mechanism import Constraint, Energy, Mechanism, coordinate, parameter
from lag2fmu.reference import Trajectory

pytestmark = pytest.mark.fmu

MODELS = ["double_pendulum", "cart_pole", "heavy_top", "motion_driven_pendulum"]
PARTS = ("name", "valueReference", "causality", "variability", "initial", "start", "unit", "displayUnit", "quantity")
FATAL = ERROR + 1


@pytest.fixture(scope="module")
def in_python(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """``in_python(model, **arguments of export)``: the path of its FMU; that of a name is made once."""

    def write(mechanism: Mechanism, **arguments: Any) -> Path:
        path = tmp_path_factory.mktemp("python") / f"{mechanism.name}.fmu"
        return export(mechanism, path, backend="python", **arguments).path

    @cache
    def of_name(name: str, **arguments: Any) -> Path:
        return write(load(name), **arguments)

    return lambda model, **arguments: (of_name if isinstance(model, str) else write)(model, **arguments)


@pytest.fixture
def pendulum(in_python) -> Iterator[Stepping]:
    with Stepping(in_python("double_pendulum")) as host:
        yield host


def entries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def module_of(path: Path) -> tuple[str, str]:
    """The name and the text of the module with the equations."""
    files = entries(path)
    name = files["resources/slavemodule.txt"].decode()
    return name, files[f"resources/{name}.py"].decode()


# ------------------------------------------------------------------------------------------------- what it looks like


@pytest.mark.parametrize("model", MODELS)
def test_the_ports_are_those_of_the_c_backend(model: str, in_python, exported: Callable[..., Fmu]) -> None:
    def ports(path: Path) -> list[tuple[Any, ...]]:
        description = fmpy.read_model_description(str(path), validate=False)
        derived = [None if v.derivative is None else v.derivative.name for v in description.modelVariables]
        keys = (*PARTS, "description", "min", "max", "nominal")
        return [(*(getattr(v, k) for k in keys), d) for v, d in zip(description.modelVariables, derived, strict=True)]

    own, native = ports(in_python(model)), ports(exported(model).path)
    assert own == native
    assert len(own) > 10


@pytest.mark.parametrize("model", [*MODELS, "six_axis_arm", "spring_mass_damper"])
def test_the_description_is_valid(model: str, in_python) -> None:
    path = in_python(model)
    assert problems(path) == []
    description = fmpy.read_model_description(str(path))
    co_simulation = description.coSimulation
    assert description.modelExchange is None
    assert co_simulation.needsExecutionTool
    assert co_simulation.canGetAndSetFMUstate
    assert co_simulation.canSerializeFMUstate
    assert not co_simulation.providesDirectionalDerivative
    assert not co_simulation.canInterpolateInputs
    assert co_simulation.maxOutputDerivativeOrder == 0


def test_what_it_needs_is_told(in_python) -> None:
    files = entries(in_python("double_pendulum", platform="all"))
    text = files["documentation/externalDependencies.txt"].decode()
    assert "LD_PRELOAD" in text
    assert "GUID" in text
    assert b"MIT License" in files["documentation/licenses/pythonfmu.txt"]
    assert {"binaries/linux64/double_pendulum.so", "binaries/win64/double_pendulum.dll"} <= files.keys()
    page = files["documentation/index.html"].decode()
    assert "resources/" in page
    assert "model exchange" not in page
    assert not any(name.startswith("sources/") for name in files)


def test_the_same_input_gives_the_same_bytes(in_python, tmp_path: Path) -> None:
    again = export(load("cart_pole"), tmp_path / "cart_pole.fmu", backend="python").path
    assert filecmp.cmp(again, in_python("cart_pole"), shallow=False)
    other = export(with_values(load("cart_pole"), {"M": 2.0}), tmp_path / "other.fmu", backend="python")
    assert other.description.guid not in in_python("cart_pole").read_bytes().decode("latin-1")
    assert module_of(other.path)[0] != module_of(again)[0]


@pytest.mark.parametrize("model", ["double_pendulum", "six_axis_arm"])
def test_the_equations_can_be_read(model: str, in_python) -> None:
    """A docstring for everything, the mechanism's own names, and few names that are not."""
    _, text = module_of(in_python(model))
    mechanism, tree = load(model), ast.parse(text)
    assert mechanism.title in str(ast.get_docstring(tree))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert len(functions) == 3
    assert all(ast.get_docstring(function) for function in functions)
    assigned = {n.id for n in ast.walk(functions[0]) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    assert {q.name for q in mechanism.coordinates} <= assigned
    program = lower(derive(mechanism))
    temporaries = {name for name in assigned if name[0] == "v" and name[1:].isdigit()}
    assert len(temporaries) < program.operations("mechanism_dynamics") / 3


def test_a_changed_file_changes_the_motion(in_python, tmp_path: Path) -> None:
    """What the module's docstring tells: edit, rename, pack. Gravity is taken out, the bob keeps its velocity."""
    files = entries(in_python("pendulum"))
    name, text = module_of(in_python("pendulum"))
    del files[f"resources/{name}.py"]
    changed = text.replace("Q_theta, = inputs", "Q_theta, = inputs; t_theta = 0").replace(
        "= parameters\n\n", "= parameters\n    g = 0.0\n\n"
    )
    assert changed != text
    files |= {"resources/mine.py": changed.encode(), "resources/slavemodule.txt": b"mine"}
    path = tmp_path / "changed.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        for entry, content in files.items():
            archive.writestr(entry, content)
    run = lag2fmu.simulate(path, stop_time=1.0, step=0.1, values={"theta_dot": 0.5})
    assert run["theta"] == pytest.approx(run["theta"][0] + 0.5 * run.time, abs=1e-12)


# ----------------------------------------------------------------------------------------------------------- numbers


@pytest.mark.parametrize("solver", ["dopri5", "dop853", "rk4"])
@pytest.mark.parametrize("model", MODELS)
def test_the_motion_is_that_of_the_c_backend(model: str, solver: str, in_python, exported) -> None:
    """At tolerance 1e-10 within 1e-8, all outputs, with forces and parameters that are not those of the start."""
    mechanism = load(model)
    time = np.linspace(0.0, 2.0, 41)
    force = f"Q_{mechanism.coordinates[0].name}"
    arguments: dict[str, Any] = {
        "stop_time": 2.0,
        "step": 0.05,
        "tolerance": 1e-10,
        "values": {next(p.name for p in mechanism.parameters if p.value is not None): 1.25},
        "inputs": Trajectory.of(time, {force: 0.1 * np.sin(3 * time)}),
        "hold": True,
        "outputs": [*(v.name for v in exported(model).description.variables if v.causality in ("output", "local"))],
    }
    own = lag2fmu.simulate(in_python(model, solver=solver), **arguments)
    native = lag2fmu.simulate(exported(model, solver=solver), **arguments)
    assert own.names == native.names
    for name in own.names:
        assert own[name] == pytest.approx(native[name], rel=1e-8, abs=1e-8 * max(1.0, np.abs(native[name]).max()))


def test_validate_takes_it(in_python) -> None:
    report = lag2fmu.validate(in_python("cart_pole"), stop_time=2.0)
    assert report.passed
    assert "The FMU offers co-simulation only." in report.notes


def test_the_result_does_not_depend_on_the_communication_step(in_python) -> None:
    path = in_python("double_pendulum")
    ends = [lag2fmu.simulate(path, stop_time=1.0, step=h, tolerance=1e-9)["theta1"][-1] for h in (1e-3, 0.05, 1.0)]
    assert ends == pytest.approx([ends[0]] * 3, abs=1e-7)


def test_two_fmus_of_one_name_in_one_process(in_python) -> None:
    """They differ in a parameter's start value only; each behaves as it does alone."""
    first = in_python("double_pendulum")
    second = in_python(with_values(load("double_pendulum"), {"l1": 2.0}))
    with Stepping(first) as a, Stepping(second) as b:
        a.start()
        b.start()
        together = [(bits(a.step(0.1)), bits(b.step(0.1))) for _ in range(5)]
        assert (a.get(["l1"]), b.get(["l1"])) == ([1.0], [2.0])
    with Stepping(first) as a:
        assert [bits(x) for x in a.start().steps(5, 0.1)] == [x for x, _ in together]
    with Stepping(second) as b:
        assert [bits(x) for x in b.start().steps(5, 0.1)] == [x for _, x in together]


def test_a_pole_gives_a_discarded_step(in_python, tmp_path: Path) -> None:
    """x'' = 2 k x^3 from x = 1, x' = 1 is 1/(1 - t) with k = 1 m-2 s-2: the run ends at t = 1, undoing a step."""
    x, m, k = coordinate("x", start=1.0, velocity=1.0), parameter("m", 1.0), parameter("k", 1.0)
    burst = Mechanism("burst", coordinates=[x], parameters=[m, k], energy=Energy(m * x.dot**2 / 2, -m * k * x**4 / 2))
    path = in_python(burst)
    with Stepping(path) as host:
        host.start(tolerance=1e-8)
        assert host.steps(9, 0.1)[-1][0] == pytest.approx(10.0, rel=1e-5)
        before = bits(host.get(host.states))
        with pytest.raises(FMICallException, match="discard"):
            host.step(0.2)
        assert bits(host.get(host.states)) == before  # where fmi2LastSuccessfulTime is
        assert host.unit.getRealStatus(2) == pytest.approx(0.9)
        assert host.unit.getBooleanStatus(3)
        assert "x" in host.sentences[-1]
    with pytest.raises(SimulationError, match=r"fmi2DoStep: at time (0\.99|1\.00)"):
        lag2fmu.simulate(path, stop_time=2.0, step=0.1)


# ------------------------------------------------------------------------------------------------------ saved states


def test_a_rolled_back_run_repeats_bit_for_bit(pendulum: Stepping) -> None:
    pendulum.start({"Q_theta1": 0.3, "m1": 1.5}, tolerance=1e-8)
    pendulum.steps(4, 0.07)
    saved, time = pendulum.unit.getFMUstate(), pendulum.time
    later = [bits(x) for x in pendulum.steps(5, 0.11)]
    pendulum.set({"Q_theta1": -4.0, "m1": 9.0})
    pendulum.step(0.2)
    pendulum.unit.setFMUstate(saved)
    pendulum.time = time
    assert pendulum.get(["Q_theta1", "m1"]) == [0.3, 1.5]
    assert [bits(x) for x in pendulum.steps(5, 0.11)] == later
    pendulum.unit.freeFMUstate(saved)


def test_saving_disturbs_nothing(in_python) -> None:
    def run(save: bool) -> list[str]:
        with Stepping(in_python("double_pendulum")) as host:
            host.start()
            found = []
            for _ in range(5):
                found.append(bits(host.step(0.07)))
                if save:
                    state = host.unit.getFMUstate()
                    host.unit.setFMUstate(state)
                    host.unit.freeFMUstate(state)
            return found

    assert run(save=True) == run(save=False)


def test_a_state_restores_in_another_process(pendulum: Stepping, in_python, tmp_path: Path) -> None:
    pendulum.start({"m1": 1.5}, tolerance=1e-8).steps(4, 0.07)
    saved = pendulum.unit.getFMUstate()
    (tmp_path / "state").write_bytes(pendulum.unit.serializeFMUstate(saved))
    here = bits(pendulum.step(0.3))
    script = f"""
        from pathlib import Path
        from stepping import Stepping, bits
        with Stepping(Path({str(in_python("double_pendulum"))!r})) as host:
            host.start()
            host.unit.setFMUstate(host.unit.deSerializeFMUstate(Path({str(tmp_path / "state")!r}).read_bytes()))
            host.time = {pendulum.time - 0.3!r}
            print(bits(host.step(0.3)))
    """
    assert run_alone(script) == here


def run_alone(script: str) -> str:
    """What ``script`` prints in a process of its own; it must end well."""
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("damage", ["flipped", "cut", "foreign", "empty"])
def test_a_wrong_state_is_refused(damage: str, pendulum: Stepping, in_python) -> None:
    pendulum.start().step(0.1)
    block = bytearray(pendulum.unit.serializeFMUstate(pendulum.unit.getFMUstate()))
    if damage == "flipped":
        block[-3] ^= 1
    elif damage == "cut":
        del block[-8:]
    elif damage == "empty":
        block.clear()
    else:
        with Stepping(in_python("cart_pole")) as other:
            block[:] = other.unit.serializeFMUstate(other.start().unit.getFMUstate())
    with pytest.raises(FMICallException, match="fatal"):
        pendulum.unit.setFMUstate(pendulum.unit.deSerializeFMUstate(bytes(block)))
    said = {"flipped": "is damaged", "cut": "is damaged", "foreign": "another GUID", "empty": "is not a state"}
    assert said[damage] in pendulum.log[-2][2]


# -------------------------------------------------------------------------------------------- parameters, life, errors


def test_parameters_are_tuned_as_in_c(in_python, exported) -> None:
    def run(path: Path) -> list[list[float]]:
        with Stepping(path) as host:
            host.start(tolerance=1e-10)
            first = host.steps(3, 0.1)
            host.set({"m1": 3.0, "g": 1.6, "Q_theta2": 0.4})
            return [*first, *host.steps(5, 0.1), host.get(["p_theta1", "total_energy", "theta2_ddot"])]

    own, native = run(in_python("double_pendulum")), run(exported("double_pendulum").path)
    for a, b in zip(own, native, strict=True):
        assert a == pytest.approx(b, rel=1e-8, abs=1e-8)


def test_a_dependent_parameter_follows(in_python) -> None:
    m, r = parameter("m", 2.0, "kg"), parameter("r", 0.5, "m")
    inertia = parameter("J", m * r**2 / 2, "kg.m2")
    phi = coordinate("phi", "rad")
    wheel = Mechanism("wheel", coordinates=[phi], parameters=[m, r, inertia], energy=Energy(inertia * phi.dot**2 / 2))
    with Stepping(in_python(wheel)) as host:
        host.start()
        assert host.get(["J"]) == [0.25]
        host.set({"r": 1.0, "Q_phi": 3.0})
        assert host.get(["J", "phi_ddot"]) == [1.0, 3.0]
        assert host.step(1.0) == pytest.approx([1.5, 3.0], rel=1e-14)


def test_reset_is_a_new_instance(pendulum: Stepping, in_python) -> None:
    pendulum.start({"m1": 5.0, "theta1": 1.0, "solver_tolerance": 1e-4}, start_time=3.0).steps(3, 0.2)
    pendulum.unit.reset()
    names = [v.name for v in pendulum.description.modelVariables]
    with Stepping(in_python("double_pendulum")) as fresh:
        assert bits(pendulum.start().get(names)) == bits(fresh.start().get(names))
        assert [bits(x) for x in pendulum.steps(3, 0.1)] == [bits(x) for x in fresh.steps(3, 0.1)]


def test_settings_of_the_solver_count(in_python) -> None:
    def end(**settings: float) -> float:
        values = {"solver_max_step": 2.0, **settings}
        return float(lag2fmu.simulate(in_python("pendulum"), stop_time=2.0, step=2.0, values=values)["theta"][-1])

    exact = end(solver_tolerance=1e-12)
    assert abs(end(solver_tolerance=1e-3) - exact) > 10 * abs(end() - exact) > 0
    assert abs(end(solver_tolerance=1e-3, solver_max_step=1e-3) - exact) < 1e-9


WRONG: dict[str, tuple[Callable[[Stepping], object], str]] = {
    "reference": (lambda h: h.unit.getReal([4711]), "no Real variable with value reference 4711"),
    "set reference": (lambda h: h.unit.setReal([4711], [0.0]), "no Real variable with value reference 4711"),
    "integer": (lambda h: h.unit.getInteger([1]), "variables of type Real only"),
    "not finite": (lambda h: h.set({"m1": float("nan")}), "m1 cannot be set to nan"),
    "calculated": (lambda h: h.set({"x2": 1.0}), "x2 is calculated"),
    "time": (lambda h: h.set({"time": 1.0}), "time is the independent variable"),
    "state, late": (lambda h: h.set({"theta1": 1.0}), 'theta1 is fixed in state "step complete"'),
    "setting, late": (lambda h: h.set({"solver_step": 1.0}), "solver_step is fixed"),
    "setup, late": (lambda h: h.unit.setupExperiment(), "expected one of the states: instantiated"),
    "negative step": (lambda h: h.unit.doStep(0.0, -0.1), "the communication step is -0.1"),
    "gap": (lambda h: h.unit.doStep(0.5, 0.1), "the communication point is 0.5 s"),
    "past the end": (lambda h: h.unit.doStep(0.0, 2.0), "after the stop time 1 s"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_call_is_refused_with_a_sentence(case: str, pendulum: Stepping) -> None:
    """fmi2Fatal is what PythonFMU's library makes of it; a reset repairs the instance."""
    act, sentence = WRONG[case]
    pendulum.start(stop_time=1.0)
    with pytest.raises(FMICallException, match="fatal"):
        act(pendulum)
    status, category, said = pendulum.log[-2]
    assert (status, category) == (FATAL, "logStatusFatal")
    assert sentence in said
    pendulum.unit.reset()
    assert pendulum.start().step(0.1) == pytest.approx(pendulum.get(pendulum.states))


def test_a_bound_is_kept(in_python) -> None:
    m = parameter("m", 1.0, "kg", minimum=0.1)
    x = coordinate("x", "m", start=0.0)
    with Stepping(
        in_python(Mechanism("bounded", coordinates=[x], parameters=[m], energy=Energy(m * x.dot**2 / 2)))
    ) as host:
        host.start()
        with pytest.raises(FMICallException):
            host.set({"Q_x": 1.0, "m": 0.01})
        assert "expected a finite number from 0.10000000000000001 to inf, and nothing was set" in host.log[-2][2]
        assert host.get(["Q_x"]) == [0.0]


def test_a_singular_mass_matrix_names_the_coordinate(in_python) -> None:
    m, x, y = parameter("m", 1.0, "kg"), coordinate("x", "m", start=1.0), coordinate("y", "m")
    kinetic = m * x.dot**2 / 2 + m * x**2 * y.dot**2 / 2
    with Stepping(in_python(Mechanism("weak", coordinates=[x, y], parameters=[m], energy=Energy(kinetic)))) as host:
        host.start({"x": 0.0})
        with pytest.raises(FMICallException, match="discard"):
            host.step(0.1)
        assert host.log[-1][1] == "logSingularLinearSystems"
        assert "does not determine the acceleration of y;" in host.log[-1][2]


def test_many_instances_and_many_errors(in_python) -> None:
    """PythonFMU's library drops references that it does not own; without remedy 20 instances end the process."""
    script = f"""
        from pathlib import Path
        from fmpy.fmi1 import FMICallException
        from stepping import Stepping
        for _ in range(200):
            with Stepping(Path({str(in_python("pendulum"))!r})) as host:
                host.start().step(0.1)
                for _ in range(3):
                    try:
                        host.unit.getReal([4711])
                    except FMICallException:
                        host.unit.reset()
                        host.start().step(0.1)
                host.unit.fmi2FreeInstance(host.unit.component)
                host.unit.instantiate()
        print("done")
    """
    assert run_alone(script) == "done"


# ------------------------------------------------------------------------------------------------- what it cannot do


@pytest.mark.parametrize(
    ("platform", "compiler", "remedy"),
    [
        ("darwin", "zig", "no library for 'darwin'"),
        ("aarch64-linux", "zig", "no library for 'aarch64-linux'"),
        ("host", "host", "compiles nothing"),
    ],
)
def test_what_pythonfmu_does_not_have_is_refused(platform: str, compiler: str, remedy: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=remedy):
        export(load("pendulum"), tmp_path / "x.fmu", backend="python", platform=platform, compiler=compiler)
    assert list(tmp_path.iterdir()) == []


def test_a_machine_without_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Darwin")
    monkeypatch.setattr("platform.machine", lambda: "arm64")
    with pytest.raises(ExportError, match=r"no library for this machine \(darwin\)"):
        check_choices("rk4", "host", "zig")
    assert check_choices("rk4", "all", "zig") == ("linux64", "win64")


def test_a_solver_of_the_c_backend_alone_is_refused() -> None:
    with pytest.raises(ExportError, match="--solver radau5: the python backend has dopri5, dop853, rk4 only"):
        check_choices("radau5", "host", "zig")


def test_an_unknown_backend_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="unknown backend 'rust'; known are c, python"):
        export(load("pendulum"), tmp_path / "x.fmu", backend="rust")


BLANK = ModelDescription(load("pendulum"), (), "pendulum", "", "dopri5", "0", INTERFACE)


def test_equations_of_another_form_are_refused() -> None:
    equations = derive(load("pendulum"))
    program = lower(equations)
    assert printable(program)
    other = program._replace(functions=tuple(replace(f, arrays=("M", "f", "G")) for f in program.functions))
    with pytest.raises(ExportError, match="the python backend cannot write the equations of 'pendulum'"):
        python_fmu(equations, other, ["linux64"], BLANK)


def test_constraints_are_refused() -> None:
    mechanism = load("pendulum")
    constrained = replace_constraints(mechanism)
    equations = replace(derive(mechanism), mechanism=constrained)
    with pytest.raises(ExportError, match="without constraints and events, with energies and outputs; use --backend c"):
        python_fmu(equations, lower(derive(mechanism)), ["linux64"], BLANK)


def replace_constraints(mechanism: Mechanism) -> Mechanism:
    theta = coordinate("theta", "rad")
    return Mechanism(
        mechanism.name,
        coordinates=[theta],
        energy=Energy(theta.dot**2 / 2),
        constraints=[Constraint("stop", theta.dot - 1, "nonholonomic")],
    )


def test_without_pythonfmu_there_is_a_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def absent(name: str) -> object:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.files", absent)
    with pytest.raises(BuildError, match="pip install pythonfmu"):
        export(load("pendulum"), tmp_path / "x.fmu", backend="python")


def test_the_command_line_exports_and_refuses(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from lag2fmu.cli import main

    path = tmp_path / "p.fmu"
    done = CliRunner().invoke(main, ["export", "pendulum", "--backend", "python", "-o", str(path)])
    assert (done.exit_code, path.is_file()) == (0, True)
    done = CliRunner().invoke(main, ["export", "pendulum", "--backend", "python", "--platform", "darwin"])
    assert done.exit_code == 2
    assert "PythonFMU brings those for linux64 and win64" in done.output
