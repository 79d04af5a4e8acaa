"""radau5 from inside, in a C host: observed order, constraints, Jacobian, and how many steps stiff linkages take."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from compiling import QUICK, UNOPTIMISED
from scipy.linalg import expm
from scipy.optimize import brentq
from stepping import Stepping

from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.translation_units import translation_units
from lag2fmu.formats.loading import load, with_values
from lag2fmu.mechanism import Body, Constraint, Damper, Energy, Mechanism, Spring, coordinate, parameter
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-ffp-contract=off"]
Run = tuple[float, float, float, np.ndarray]
"""Steps, the greatest residuals of positions and velocities, states (2n,) at the end."""


class Host:
    """The sources of an FMU with radau5 behind radau_host.c."""

    def __init__(self, mechanism: Mechanism, folder: Path) -> None:
        equations = derive(mechanism)
        _, sources = describe(mechanism, equations, lower(equations), "radau5")
        joined = translation_units(sources)
        for name, text in {**sources, **joined}.items():
            (folder / name).write_text(text, "utf-8")
        units = [str(folder / name) for name in joined]
        own = str(Path(__file__).with_name("radau_host.c"))
        command = [*QUICK, *STRICT, *UNOPTIMISED["zig"], f"-I{folder}", f"-I{fmi_headers()}", *units, own]
        self.program = folder / "host"
        done = subprocess.run([*command, "-lm", "-o", str(self.program)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    def _call(self, *arguments: object) -> list[float]:
        done = subprocess.run([str(self.program), *map(str, arguments)], capture_output=True, text=True, check=True)
        return [float(word) for word in done.stdout.split()]

    def adaptive(self, tolerance: float, stop: float, points: int = 1) -> Run:
        steps, positions, velocities, *states = self._call("adaptive", tolerance, stop, points)
        return steps, positions, velocities, np.array(states)

    def fixed(self, tolerance: float, stop: float, count: int) -> Run:
        steps, positions, velocities, *states = self._call("fixed", tolerance, stop, count)
        return steps, positions, velocities, np.array(states)

    def jacobian_error(self, stop: float) -> float:
        return self._call("jacobian", stop)[0]


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str | Mechanism], Host]:
    """``host(model)``, built once a session."""
    built: dict[str, Host] = {}

    def build(model: str | Mechanism) -> Host:
        mechanism = with_derived(load(model) if isinstance(model, str) else model)
        if mechanism.name not in built:
            built[mechanism.name] = Host(mechanism, tmp_path_factory.mktemp(mechanism.name))
        return built[mechanism.name]

    return build


def at_the_end(mechanism: Mechanism, stop: float) -> np.ndarray:
    """The states (2n,) by direct integration."""
    trajectory = integrate(mechanism, [0.0, stop], rtol=1e-12).trajectory
    names = [c.name for c in mechanism.coordinates]
    return np.array([trajectory[name][-1] for name in [*names, *(f"{name}_dot" for name in names)]])


def crank(rod: float | None) -> Mechanism:
    """A slider-crank at 20 rad/s whose rod is rigid or, with critical damping, has the stiffness ``rod`` in N/m."""
    a, b = coordinate("a", "rad", start=0.3, velocity=20.0), coordinate("b", "rad", guess=-0.15)
    x, q, s = coordinate("x", "m", guess=0.44, nominal=0.5), [], sp.Float(0.3)
    parameters, springs, dampers = [], [], []
    if rod:
        q = [s := coordinate("s", "m", start=0.3, velocity=0.0, nominal=0.3)]
        parameters = [k := parameter("k", rod, "N/m"), c := parameter("c", 2 * (0.075 * rod) ** 0.5, "N.s/m")]
        springs, dampers = [Spring("rod", k, elongation=s - 0.3)], [Damper("rod", c, rate=s.dot)]
    x_A, y_A = 0.15 * sp.cos(a), 0.15 * sp.sin(a)
    u, v = sp.cos(b), sp.sin(b)
    return Mechanism(
        f"crank_{rod or 0:.0f}",
        coordinates=[a, *q, b, x],
        parameters=parameters,
        springs=springs,
        dampers=dampers,
        gravity=9.81,
        bodies=[
            Body("crank", 0.36, (x_A / 2, y_A / 2), angle=a, inertia=0.0007),
            Body("rod", 0.15, (x_A + s / 2 * u, y_A + s / 2 * v), angle=b, inertia=0.001),
            Body("slider", 0.075, (x, 0)),
        ],
        constraints=[Constraint("loop_x", x_A + s * u - x), Constraint("loop_y", y_A + s * v)],
    )


CASES = {"slider_crank": (0.1, 300), "bricard": (1.0, 25), "rolling_disc": (1.0, 100)}
"""Model: stop time in s and number of steps. The second one's constraints are redundant, the third's nonholonomic."""


@pytest.mark.parametrize("model", CASES)
def test_order_under_constraints(model: str, host) -> None:
    stop, count = CASES[model]
    exact = at_the_end(with_derived(load(model)), stop)
    runs = [host(model).fixed(1e-11, stop, factor * count) for factor in (1, 2)]
    errors = [np.abs(states - exact).max() for _, _, _, states in runs]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.3), errors
    for _, positions, velocities, states in runs:
        assert positions < 1e-10
        assert velocities < 1e-10 * max(1.0, np.abs(states).max())


@pytest.mark.parametrize("model", [*CASES, "parallel_manipulator", "whipple_bicycle"])
def test_constraints_are_met(model: str, host) -> None:
    """At communication points, which solver steps pass over: in meters and radians, and by the second."""
    stop = 0.1 if model == "slider_crank" else 0.5
    _, positions, velocities, states = host(model).adaptive(1e-4, stop, 60)
    assert positions < 1e-10
    assert velocities < 1e-10 * max(1.0, np.abs(states).max())


@pytest.mark.parametrize("model", ["double_pendulum", *CASES, "andrews_squeezer", "four_bar_linkage"])
def test_the_jacobian_is_that_of_the_accelerations(model: str, host) -> None:
    assert host(model).jacobian_error(0.003 if model == "andrews_squeezer" else 0.05) < 1e-6


@pytest.mark.parametrize("stiffness", [1e8, 1e10])
def test_a_rod_that_is_nearly_rigid(stiffness: float, host) -> None:
    """It moves like a rigid one, whatever the tolerance, in steps that the motion of the crank asks for.

    Forces of 5 N bend it by 5e-8 m and 5e-10 m.
    """
    stop, places = 0.5, [0, 2, 3, 4, 6, 7]
    exact = at_the_end(crank(None), stop)
    for tolerance, most in ((1e-3, 100), (1e-5, 130), (1e-7, 300)):
        steps, positions, _, states = host(crank(stiffness)).adaptive(tolerance, stop)
        errors = np.abs(states[places] - exact) / np.maximum(np.abs(exact), 1.0)
        assert errors.max() < tolerance + 1e3 / stiffness
        assert abs(states[1] - 0.3) < 10 / stiffness
        assert positions < 1e-10
        assert steps < most


def test_errors_at_all_times_follow_the_tolerance(exported) -> None:
    """A block that decays with 100 /s and 9900 /s, in the transient and behind it, against its exponentials."""
    block = with_values(load("spring_mass_damper"), {"k": 1e6, "c": 1e4})
    A = np.array([[0.0, 1.0], [-1e6, -1e4]])
    exact = [expm(A * 0.001 * i) @ [0.1, 0.0] for i in range(1, 51)]
    tolerances, errors = 10.0 ** np.arange(-3, -11.5, -1.0), []
    for tolerance in tolerances:
        with Stepping(exported(block, solver="radau5").path) as s:
            s.start(tolerance=float(tolerance))
            found = [[*s.step(0.001)][:2] for _ in exact]
        errors.append((np.abs(np.array(found) - exact) / [0.1, 10.0]).max())
    assert max(errors / tolerances) < 1.0
    assert 0.8 < np.polyfit(np.log(tolerances), np.log(errors), 1)[0] < 1.2, errors


def relaxing() -> Mechanism:
    """Van der Pol's oscillator with mu = 1000, in time such that eps y'' = (1 - y^2) y' - y."""
    y = coordinate("y", start=2.0, velocity=-2.0 / 3.0)
    eps = parameter("eps", 1e-6)
    return Mechanism("relaxing", coordinates=[y], parameters=[eps], energy=Energy(eps * y.dot**2 / 2, y**2 / 2),
                     forces={y: (1 - y**2) * y.dot})  # fmt: skip


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-6, 1e-8])
def test_states_between_the_ends_of_long_steps(tolerance: float, exported) -> None:
    """Where accelerations show errors times 3e6 /s. Against y' = y / (1 - y^2) + O(eps), so ln y - y^2 / 2 = t + C."""
    times = 0.005 * np.arange(1, 141)
    y = [brentq(lambda y, t=t: np.log(y) - y**2 / 2 - t - np.log(2.0) + 2.0, 1.0, 2.0) for t in times]
    exact = np.array([y, [u / (1 - u**2) for u in y]]).T
    with Stepping(exported(relaxing(), solver="radau5").path) as s:
        s.start(tolerance=tolerance)
        found = np.array(s.steps(140, 0.005))
    errors = np.abs(found - exact).max(axis=0)
    assert errors[0] < tolerance + 2e-6
    assert errors[1] < 20 * tolerance + 2e-5


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
@pytest.mark.parametrize("step", [1e-4, 1e-3])
def test_states_after_a_force_on_a_stiff_damper_has_jumped(step: float, tolerance: float, exported) -> None:
    """Decays of 10 /s and 1e7 /s; what is left of the fast one, times 1e7, stays out of the states between."""
    A = np.array([[0.0, 1.0, 0.0], [-1e8, -1e7, 1e6], [0.0, 0.0, 0.0]])
    with Stepping(exported("spring_mass_damper", solver="radau5").path) as s:
        s.start({"k": 1e8, "c": 1e7}, tolerance=tolerance)
        start = s.step(0.05)[:2]
        s.set({"Q_x": 1e6})
        found = np.array(s.steps(100, step))[:, :2]
    exact = np.array([(expm(A * step * i) @ [*start, 1.0])[:2] for i in range(1, 101)])
    assert np.abs(found - exact).max() < tolerance


@pytest.mark.parametrize("model", ["bricard", "elastic"])
def test_a_rolled_back_run_repeats_itself_under_constraints(model: str, exported) -> None:
    """Linearization and accelerations that the next step begins with are part of the saved state."""
    mechanism = ELASTIC if model == "elastic" else load(model)
    with Stepping(exported(mechanism, solver="radau5").path) as s:
        s.start()
        s.steps(3, 0.013)
        assert s.repeats(5, 0.017)


ELASTIC = crank(1e8)
