"""The command line as a user meets it: exit codes, one clear sentence for bad input, nothing half-written."""

from __future__ import annotations

import json
import math
import os
import stat
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from lag2fmu.cli import main
from lag2fmu.verify.report import Check, Report

MODEL = "spring_mass_damper"


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """``run(*arguments)`` in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments: str) -> Result:
        return CliRunner().invoke(main, list(arguments), catch_exceptions=False)

    return invoke


def write(name: str, text: str) -> str:
    Path(name).write_text(text, "utf-8")
    return name


def test_models_are_listed(run) -> None:
    result = run("models")
    assert result.exit_code == 0
    assert "double_pendulum" in result.output
    assert "Elastic pendulum" in result.output


def test_a_command_has_one_thread_for_matrices_unless_the_user_says_so(run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    run("models")
    assert os.environ["OPENBLAS_NUM_THREADS"] == "3"
    monkeypatch.delenv("OPENBLAS_NUM_THREADS")
    run("models")
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Python knows PYTHONSAFEPATH since 3.11")
def test_workers_import_nothing_from_the_current_folder(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file there is the user's, whatever its name: processes of multiprocessing begin with -c, and import signal."""
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    write("signal.py", "raise SystemExit('the wrong signal')")
    run("models")
    done = subprocess.run([sys.executable, "-c", "import signal"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_new_writes_a_start_file_once(run) -> None:
    result = run("new", "my_cart")
    assert result.exit_code == 0
    assert "lag2fmu validate my_cart.toml" in result.output
    assert "theta_ddot" in run("show", "my_cart.toml").output
    for name, sentence in (("my_cart", "exists and is not overwritten"), ("my-cart", "is no name; use letters")):
        refused = run("new", name)
        assert refused.exit_code == 2
        assert sentence in refused.output
    assert sorted(path.name for path in Path().iterdir()) == ["mechanism.schema.json", "my_cart.toml"]


def test_show_walks_twelve_steps(run) -> None:
    text = run("show", "pendulum").output
    assert [line for line in text.splitlines() if line.startswith(("12.", " 1."))]
    assert text.count("\n") > 30
    equation = text.split("12. Equations of motion")[1]
    assert "theta_ddot" in equation
    assert "= Q_theta" in equation


def test_show_latex_and_toml(run) -> None:
    assert "\\ddot{\\theta}" in run("show", "pendulum", "--format", "latex").output
    toml = run("show", "pendulum", "--format", "toml")
    assert toml.exit_code == 0
    again = run("show", write("again.toml", toml.output), "--format", "toml")
    assert again.output == toml.output


IDLE = """<robot name="idle"><link name="a"/><link name="b"><inertial><mass value="2"/></inertial></link>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><dynamics damping="1" spring_stiffness="3"/></joint>
</robot>"""


@pytest.mark.parametrize("verb", ["show", "import", "linearize", "export --backend python"])
def test_what_an_import_leaves_out_is_told_by_every_verb(run, verb: str) -> None:
    """The warning stands on standard error as the file is run directly, and as its text is."""
    sentence = "warning: not taken from the imported file: spring_stiffness in the <dynamics> of the joint j"
    assert sentence in run(*verb.split(), write("idle.urdf", IDLE)).output
    run("import", "idle.urdf", "--force", "-o", "kept.toml")
    assert (
        sentence
        in run(*verb.split()[:1], "kept.toml", *verb.split()[1:], *["-o", "-"][: 2 * (verb == "import")]).output
    )


def test_simulate_overwrites_no_file_unless_it_is_asked_to(run) -> None:
    command = ("simulate", MODEL, "--stop-time", "0.1", "-o", "run.csv")
    assert run(*command).exit_code == 0
    again = run(*command)
    assert again.exit_code == 2
    assert "'run.csv' exists; overwrite it with --force" in again.output
    assert run(*command, "--force").exit_code == 0
    if os.name == "posix":  # a link is followed; a device is no file that could be lost
        Path("target.csv").write_text("old", "utf-8")
        Path("link.csv").symlink_to("target.csv")
        assert run(*command[:-1], "link.csv", "--force").exit_code == 0
        assert Path("link.csv").is_symlink()
        assert Path("target.csv").read_bytes() == Path("run.csv").read_bytes()
        assert run(*command[:-1], os.devnull).exit_code == 0
        assert Path(os.devnull).is_char_device()


def test_a_generalized_force_of_a_model_is_set_as_that_of_its_fmu(run) -> None:
    """x'' = (Q_x - k x - c x') / m is not 0 from rest at 0."""
    at_rest = ("simulate", MODEL, "--stop-time", "0.1", "-o", "-", "--set", "x=0")
    pushed, free = run(*at_rest, "--set", "Q_x=2"), run(*at_rest)
    assert "set Q_x = 2" in pushed.stderr
    ends = [float(result.stdout.splitlines()[-1].split(",")[1]) for result in (pushed, free)]
    assert ends[0] > 1e-4 > abs(ends[1])


def test_values_are_shown_once_they_are_known_to_fit(run) -> None:
    """A name that is none is no "set NAME = VALUE", of a model and of an FMU; a length turned negative is told."""
    run("export", MODEL, "-o", "some.fmu", "--page", "static")
    for model, name in ((MODEL, "Q_y"), (MODEL, "y"), ("some.fmu", "y")):
        refused = run("simulate", model, "--set", f"{name}=1")
        assert (refused.exit_code, "set y" in refused.stderr, f"'{name}'" in refused.stderr) == (2, False, True)
    turned = run("show", "pendulum", "--set", "l=-1")
    assert "warning: parameters.l: -1 m is negative; a length is not, but a place may be" in turned.stderr
    assert "warning" not in run("show", "pendulum", "--set", "g=-9.81").stderr


@pytest.mark.fmu
def test_a_guess_that_is_set_and_moved_is_told(run) -> None:
    """b is solved for: it is 130 deg nowhere near the crank's start, of the model as of its FMU."""
    command = ("simulate", "four_bar_linkage", "--stop-time", "0.01", "--set", "b=130 deg", "-o", "-")
    assert "constraints move what was set as a guess: b from 2.26893 to 2.35886" in run(*command).stderr
    assert "guess" not in run(*command[:4], "--set", "a=0.4", "-o", "-").stderr
    moved = run("linearize", "four_bar_linkage", "--set", "b_dot=9").stderr
    assert "constraints move what was set as a guess: b_dot from 9 to " in moved


def test_every_verb_of_a_model_takes_how_a_robot_stands(run) -> None:
    options = {name: {option.name for option in command.params} for name, command in main.commands.items()}
    assert [name for name, known in options.items() if ("settings" in known) != ("base" in known)] == ["ssp"]
    inertial = '<link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    robot = write("sledge.urdf", IDLE.replace('<link name="a"/>', inertial))
    assert "a_x_dot" in run("linearize", robot, "--base", "planar").output


def test_linearize_prints_and_writes_the_state_space(run) -> None:
    """A pendulum of 1 m swings with sqrt(g / l), at 0.498 Hz, about the bottom."""
    result = run("linearize", "pendulum", "--at", "equilibrium", "--input", "Q_theta", "-o", "a.json")
    assert result.exit_code == 0
    assert "0 ± 3.13209 i            3.13209  0.498488        0" in result.output
    assert "theta_dot  -9.81" in result.output
    assert "wrote a.json" in result.stderr
    assert "pendulum about an equilibrium" in result.output
    assert json.loads(Path("a.json").read_text("utf-8"))["outputs"][:2] == ["theta", "theta_dot"]
    assert "about its state at 0 s" in run("linearize", "pendulum").output
    # a force that holds the pendulum at its start makes that a state of rest: m g l sin(theta)
    held = run("linearize", "pendulum", "--set", f"Q_theta={9.81 * math.sin(0.5)!r}")
    assert "no equilibrium" not in held.output
    assert "no equilibrium" in run("linearize", "pendulum").output
    for arguments, sentence in (
        (("-o", "a.csv"), "its ending must be one of .json, .mat, .npz"),
        (("--at", "rest"), "cannot linearize at 'rest'; give 'start', 'equilibrium' or a time"),
        (("--output", "zeta"), "'zeta' is no output"),
        (("-o", "a.json"), "'a.json' exists; overwrite it with --force"),
    ):
        refused = run("linearize", "pendulum", *arguments)
        assert refused.exit_code == 2
        assert sentence in refused.stderr


def test_show_analysis(run) -> None:
    text = run("show", "pendulum", "--analysis").output
    assert "generalized_energy: energy T + V." in text
    assert "mode 1: 3.13209 rad/s" in text
    assert "\\paragraph{Hamiltonian}" in run("show", "pendulum", "--analysis", "--format", "latex").output
    refused = run("show", "pendulum", "--analysis", "--format", "toml")
    assert refused.exit_code == 2
    assert "leave out '--format toml'" in refused.stderr


def test_the_analysis_says_what_is_so(run) -> None:
    """No Routhian where constraints change momenta, no impacts where there are none, coupling on request."""
    disc = run("show", "rolling_disc", "--analysis").output
    assert "No momentum is conserved." in disc
    assert "L does not contain x, y, psi, but constraints act there" in disc
    assert "\n      R = " not in disc
    assert "generalized_energy = T + V" in disc
    assert "Coupling to other FMUs" not in disc
    clutch = run("show", "clutch_pair", "--coupling").output
    assert "between impacts" not in clutch
    assert "Momenta may be conserved without the forces of dry friction" in clutch
    assert "Coupling to other FMUs" in clutch


def test_show_applies_settings_and_structure(run) -> None:
    assert "s = 5" in run("show", "n_pendulum", "--set", "n=5").output
    assert "start = 0.25" in run("show", "pendulum", "--format", "toml", "--set", "theta=0.25").output


@pytest.mark.fmu
def test_show_large_mechanisms_by_structure(run) -> None:
    result = run("show", "n_pendulum", "--set", "n=20")
    assert result.exit_code == 0
    assert "its derivatives are not written out" in result.output


def test_show_writes_equations_on_frames_and_shortens_long_ones(run) -> None:
    text = run("show", "heavy_top").output
    assert "C*psi_ddot + C*phi_ddot*cos(theta) - C*phi_dot*theta_dot*sin(theta) = Q_psi" in text
    assert "V = g*l*m*cos(theta)" in text
    short, full = (run("show", "free_body", *options).output for options in ((), ("--full",)))
    assert "384 more characters; --full writes them" in short
    assert "--full" not in full
    assert len(full) > len(short) + 4 * 300
    assert "sources/ of the FMU computes them" in run("show", "six_axis_arm").output


def test_show_plot(run) -> None:
    assert run("show", "elastic_pendulum", "--plot", "start.png").exit_code == 0
    assert Path("start.png").stat().st_size > 10_000


@pytest.mark.fmu
def test_export_simulate_validate(run) -> None:
    assert run("export", MODEL, "-o", "x.fmu", "--output", "total_energy").output == (
        "wrote x.fmu, solver dopri5: the motion is not stiff at its start\n"
    )
    csv = run("simulate", "x.fmu", "--stop-time", "1", "--step", "0.1", "-o", "-", "--set", "x=0.2")
    lines = csv.stdout.splitlines()
    assert lines[0].startswith("time,x [m],x_dot [m/s]")
    assert "total_energy" in lines[0]
    assert len(lines) == 12
    assert lines[1].startswith("0.0,0.2,")
    assert run("simulate", "x.fmu", "-o", "run.csv", "--plot", "run.svg").exit_code == 0
    more = run("simulate", "x.fmu", "--stop-time", "1e-3", "--output", "p_x", "--output", "x_ddot", "-o", "-")
    assert more.stdout.splitlines()[0].endswith("p_x [kg.m/s],x_ddot [m/s2]"), more.output
    assert len(more.stdout.splitlines()) > 2, "the usual step is longer than the run"
    assert "did you mean 'kinetic_energy'" in run("simulate", "x.fmu", "--output", "kinetic_energi").output
    assert Path("run.svg").read_text("utf-8").startswith("<?xml")
    result = run("validate", "x.fmu", "--stop-time", "2", "--report", "r.json", "--report", "r.png")
    assert result.exit_code == 0
    assert "model exchange" in result.output
    assert json.loads(Path("r.json").read_text("utf-8"))["passed"] is True
    assert Path("r.png").stat().st_size > 10_000


@pytest.mark.fmu
def test_export_keeps_what_another_mechanism_wrote(run) -> None:
    """A copy writes a file of its own name; a file that holds something else is not overwritten without --force."""
    write("copy.toml", run("show", MODEL, "--format", "toml").output)
    assert run("export", "copy.toml").output.startswith("wrote copy.fmu")
    assert run("export", "copy.toml").exit_code == 0, "the same mechanism again"
    for path, found in (
        ("copy.fmu", f"holds the mechanism '{MODEL}'"),
        (write("x.fmu", "text"), "is no FMU of lag2fmu"),
    ):
        before = Path(path).read_bytes()
        refused = run("export", "pendulum", "-o", path)
        assert refused.exit_code == 2
        assert f"'{path}' exists and {found}; overwrite it with --force" in refused.stderr
        assert Path(path).read_bytes() == before
        assert run("export", "pendulum", "-o", path, "--force").exit_code == 0


@pytest.mark.fmu
def test_validate_exits_with_1_when_a_check_fails(run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_module("lag2fmu.verify.invariants"), "SAFETY", 1e-9)
    result = run("validate", MODEL, "--stop-time", "1")
    assert result.exit_code == 1
    assert "FAILED" in result.output


@pytest.mark.parametrize(
    ("checks", "status", "word"),
    [
        ((Check("good", 0.0, 1.0),), 0, "ok"),
        ((Check("good", 0.0, 1.0), Check("share not compared", 0.607, 0.2, extent=True)), 3, "not judged"),
        ((Check("bad", 2.0, 1.0), Check("share not compared", 0.607, 0.2, extent=True)), 1, "FAILED"),
    ],
)
def test_validate_exits_with_its_outcome(
    run, monkeypatch: pytest.MonkeyPatch, checks: tuple[Check, ...], status: int, word: str
) -> None:
    """Too little that was compared is neither 0 nor 1."""
    found = Report("A title", checks, (), (), {})
    monkeypatch.setattr(import_module("lag2fmu.cli.validating"), "validate", lambda *_, **__: found)
    result = run("validate", MODEL)
    assert result.exit_code == status
    assert word in result.output


@pytest.mark.fmu
def test_simulate_with_input_from_csv(run) -> None:
    """A constant force F on a mass at rest, spring and damper as they are: compared with the free run."""
    rows = "\n".join(f"{t / 10},1.5" for t in range(11))
    write("force.csv", f"time,Q_x\n{rows}\n")
    forced = run("simulate", MODEL, "--stop-time", "1", "--step", "0.01", "--input", "force.csv", "-o", "-").stdout
    free = run("simulate", MODEL, "--stop-time", "1", "--step", "0.01", "-o", "-").stdout
    assert forced.splitlines()[-1] != free.splitlines()[-1]


@pytest.mark.fmu
def test_simulate_takes_settings_of_the_solver_for_models_too(run) -> None:
    options = ("simulate", MODEL, "--stop-time", "1", "--step", "0.1", "-o", "-", "--set")
    loose, tight = (run(*options, f"solver_tolerance={value}", "--set", "x=0.2").stdout for value in ("1e-3", "1e-9"))
    assert loose.splitlines()[1] == tight.splitlines()[1]
    assert loose.splitlines()[-1] != tight.splitlines()[-1]
    refused = run(*options, "solver_max_step=-1")
    assert (refused.exit_code, "solver_max_step = -1.0 is below 0, the least" in refused.output) == (2, True)


@pytest.mark.fmu
def test_simulate_takes_a_solver_for_what_is_exported_here(run) -> None:
    coarse = run("simulate", MODEL, "--stop-time", "1", "--step", "0.5", "--solver", "rk4", "-o", "-").stdout
    chosen = run("simulate", MODEL, "--stop-time", "1", "--step", "0.5", "-o", "-").stdout
    assert coarse.splitlines()[1] == chosen.splitlines()[1]
    assert coarse.splitlines()[-1] != chosen.splitlines()[-1]
    assert "unknown solver 'rk5'" in run("simulate", MODEL, "--solver", "rk5").output
    run("export", MODEL, "--page", "static", "-o", "own.fmu")
    assert "its solver was chosen at its export" in run("simulate", "own.fmu", "--solver", "rk4").output
    assert "a system has none" in run("simulate", "a=own.fmu", "--solver", "rk4").output


@pytest.mark.fmu
def test_demo_prints_what_was_compared(run) -> None:
    result = run("demo", "--plot", "demo.png")
    assert result.exit_code == 0
    for words in ("Double pendulum", "co-simulation, step 0.1 s", "model exchange", "energy", "wrote demo.png"):
        assert words in result.output


RAISES = "from lag2fmu.mechanism import Mechanism\n\n\ndef raises():\n    return 1 / 0\n"
OTHER = "def other():\n    return 42\n"
NO_COORDINATES = (
    'from lag2fmu.mechanism import Mechanism\n\n\ndef bare():\n    return Mechanism("bare", coordinates=[])\n'
)
HEAD = "from lag2fmu.mechanism import *\n\n\n"
UNUSED = HEAD + (
    "def unused():\n    x, y = coordinate('x'), coordinate('y')\n"
    "    return Mechanism('unused', coordinates=[x, y], energy=Energy(x.dot**2, x**2))\n"
)
UNDEFINED = HEAD + (
    "def undefined():\n    import sympy\n    x = coordinate('x')\n"
    "    return Mechanism('undefined', coordinates=[x], energy=Energy(x.dot**2, sympy.Symbol('stiffness') * x**2))\n"
)
TWICE = HEAD + (
    "def twice():\n    x, m = coordinate('x'), parameter('x', 1.0)\n"
    "    return Mechanism('twice', coordinates=[x], parameters=[m], energy=Energy(x.dot**2, x**2))\n"
)
CLASH = HEAD + (
    "def clash():\n    x, m = coordinate('x'), parameter('Q_x', 1.0)\n"
    "    return Mechanism('clash', coordinates=[x], parameters=[m], energy=Energy(x.dot**2, x**2))\n"
)
UNIT = HEAD + (
    "def unit():\n    x = coordinate('x', 'metres')\n"
    "    return Mechanism('unit', coordinates=[x], energy=Energy(x.dot**2, x**2))\n"
)
DIMENSION = HEAD + (
    "def dimension():\n    x, m = coordinate('x', 'm'), parameter('m', 1.0, 'kg')\n"
    "    return Mechanism('dimension', coordinates=[x], parameters=[m], energy=Energy(m * x.dot**2, m * x),"
    " strict_units=True)\n"
)
QUARTIC = HEAD + (
    "def quartic():\n    x = coordinate('x', start=0.1)\n"
    "    return Mechanism('quartic', coordinates=[x], energy=Energy(x.dot**4 + x.dot**2, x**2))\n"
)
MASSLESS = HEAD + (
    "def massless():\n    x, y = coordinate('x'), coordinate('y')\n"
    "    return Mechanism('massless', coordinates=[x, y], energy=Energy(x.dot**2, x*y))\n"
)

BAD_MODELS = [
    ("raises", RAISES, r"line 5: ZeroDivisionError"),
    ("other", OTHER, "returned int instead of a Mechanism"),
    ("bare", NO_COORDINATES, "has none, and no prescribed motion; declare at least one generalized coordinate"),
    ("unused", UNUSED, "coordinates.y: appears in no energy"),
    ("undefined", UNDEFINED, "undefined symbol 'stiffness'"),
    ("twice", TWICE, "'x' is already taken by coordinates.x"),
    ("clash", CLASH, "'Q_x' is already taken by the external force of coordinate 'x'"),
    ("unit", UNIT, "unknown unit 'metres'"),
    ("dimension", DIMENSION, "energy.potential: "),
    ("quartic", QUARTIC, "not quadratic in the velocities"),
    ("massless", MASSLESS, "the motion along y has no mass"),
]


@pytest.mark.parametrize(("name", "text", "sentence"), BAD_MODELS, ids=[name for name, *_ in BAD_MODELS])
def test_a_bad_model_file_gets_one_sentence(run, name: str, text: str, sentence: str) -> None:
    result = run("export", write(f"{name}.py", text))
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert result.stderr.startswith("Error: ")
    assert "Traceback" not in result.output
    assert sorted(p.name for p in Path().iterdir()) == [f"{name}.py"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["export", "no_such_model"], "unknown model 'no_such_model'"),
        (["export", "doubel_pendulum"], "double_pendulum"),
        (["export", "missing.toml"], "does not exist"),
        (["export", MODEL, "--solver", "euler"], "unknown solver 'euler'; known are dopri5, dop853, rk4, ros2"),
        (["export", MODEL, "--wrong"], "No such option"),
        (["export", MODEL, "--set", "m=abc"], "'abc' is not a number"),
        (["export", MODEL, "--set", "m"], "expected NAME=VALUE"),
        (["export", MODEL, "--set", "m=nan"], "give a finite number"),
        (["export", MODEL, "--set", "mass=1"], "'mass' is no parameter"),
        (["export", MODEL, "--set", "m=1", "--set", "m=2"], "set twice"),
        (["export", "n_pendulum", "--set", "n=two"], "n expects int"),
        (["export", MODEL, "-o", "no/such/folder/x.fmu"], "does not exist"),
        (["export", MODEL, "-o", "x.zip"], "does not end in .fmu"),
        (["export", MODEL, "-o", "."], "is a folder"),
        (["export", MODEL, "--output", "kinetik_energy"], "known are kinetic_energy"),
        (["simulate", "nowhere.fmu"], "there is no such file"),
        (["simulate", MODEL, "--plot", "x.bmp"], "its ending must be one of"),
        (["simulate", MODEL, "-o", "out.xlsx"], "its ending must be one of .csv, .txt"),
        (["simulate", MODEL, "--input", "nowhere.csv"], "cannot read 'nowhere.csv'"),
        (["validate", "nowhere.fmu"], "nowhere.fmu"),
        (["validate", MODEL, "--report", "r.docx"], "its ending must be one of"),
        (["show"], "Missing argument"),
        (["show", "."], "'.' is a folder"),
        (["show", ""], "unknown model ''"),
        (["show", MODEL, "--plot", "x.jpg"], "its ending must be one of"),
        (["simulate", MODEL, "-o", ""], "is a folder; name a file"),
        (["simulate", MODEL, "--set", "x=0.5 kg"], "'kg' is no unit of 'x', which is in m"),
        (["frobnicate"], "No such command"),
    ],
    ids=lambda x: "-".join(x[:3]) if isinstance(x, list) else None,
)
def test_bad_usage_gets_one_sentence(run, arguments: list[str], sentence: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert not list(Path().iterdir())


def test_a_file_beside_the_name_is_suggested(run) -> None:
    write("winch.toml", "")
    result = run("show", "winch")
    assert (result.exit_code, "did you mean the file 'winch.toml'?" in result.stderr) == (2, True)


@pytest.mark.fmu
@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("t,Q_x\n0,1\n", "expected 'time'"),
        ("time,Q_y\n0,1\n1,2\n", "no input 'Q_y'"),
        ("time,Q_x\n0,1\n0.5,2\n0.2,3\n", "line 4"),
        ("time,Q_x\n0,1\n0.5,fast\n", "'fast' is not a finite number"),
        ("time,Q_x\n0,1\n0.5\n", "column 'Q_x' is missing"),
        ("time,Q_x\n", "no rows"),
    ],
    ids=["header", "name", "order", "number", "missing", "empty"],
)
def test_bad_input_tables_get_one_sentence(run, rows: str, sentence: str) -> None:
    result = run("simulate", MODEL, "--input", write("in.csv", rows))
    assert result.exit_code == 2
    assert sentence in result.stderr


@pytest.mark.fmu
def test_no_compiler_and_a_failing_one(run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    result = run("export", MODEL, "--compiler", "host")
    assert result.exit_code == 2
    assert "no C compiler found" in result.stderr
    broken = Path("broken")
    broken.write_text("#!/bin/sh\necho 'cannot allocate a register' >&2\nexit 3\n", "utf-8")
    broken.chmod(broken.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", os.defpath)
    monkeypatch.setenv("CC", str(broken.resolve()))
    result = run("export", MODEL, "--compiler", "host")
    assert result.exit_code == 2
    assert "exit code 3" in result.stderr
    assert "cannot allocate a register" in result.stderr
    assert [p.name for p in Path().iterdir()] == ["broken"]


@pytest.mark.fmu
def test_a_folder_that_cannot_be_written(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Permissions do not bind the superuser, so the refusal of the system is played."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    result = run("export", MODEL, "-o", "x.fmu")
    assert result.exit_code == 2
    assert "cannot write 'x.fmu': Permission denied" in result.stderr
    assert not list(Path().iterdir())


WITH_AN_END = """
import atexit, pathlib, sys
from lag2fmu import cli
from lag2fmu.__main__ import program

command = cli.main


def main():
    atexit.register(pathlib.Path(sys.argv.pop()).touch)
    command()


cli.main = main
program()
"""


@pytest.mark.parametrize(("argument", "code"), [("--version", 0), ("--nothing", 2)])
def test_the_program_ends_with_the_code_of_its_command(argument: str, code: int, tmp_path: Path) -> None:
    """All that it says is there, and what the command registers for the end of the process is done."""
    left = tmp_path / "left"
    command = [sys.executable, "-c", WITH_AN_END, argument, str(left)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert ("lag2fmu" in done.stdout) is (code == 0)
    assert ("--nothing" in done.stderr) is (code == 2)
    assert left.exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("argument", ["--help", "--version", "models"])
def test_output_to_a_full_device_gets_one_sentence(argument: str) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "lag2fmu", argument]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("Error: No space left on device")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(os.name != "posix", reason="closes an output as POSIX shells do")
def test_an_output_that_is_closed_is_no_error() -> None:
    command = ["/bin/sh", "-c", f"'{sys.executable}' -m lag2fmu models >&-"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
