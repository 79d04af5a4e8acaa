"""The problems of benchmarks/problems against what was published of them; docs/published.md has them all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks import closed_forms, nonsmooth
from benchmarks.library import PROBLEMS
from benchmarks.published_values import GONZALEZ, LINKAGE_ANGLE
from benchmarks.stranger import PROBLEMS as FOLDER
from benchmarks.stranger import model_of
from lag2fmu import linearize, simulate
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Trajectory

PAGE = Path(__file__).parent.parent.parent / "docs" / "published.md"
Run = Callable[..., Trajectory]


def problem(name: str) -> Mechanism:
    return load(str(FOLDER / f"{name}.toml"))


@pytest.fixture
def run(exported) -> Run:
    """``run(name, stop, tolerance, outputs, solver)``: the FMU's run in 1000 communication steps."""

    def of(
        name: str,
        stop: float,
        tolerance: float | None = None,
        outputs: tuple[str, ...] = (),
        solver: str | None = "dopri5",
    ) -> Trajectory:
        fmu = exported(problem(name), solver=solver)
        return simulate(fmu, stop_time=stop, step=stop / 1000, tolerance=tolerance, beside=outputs)

    return of


def test_the_page_has_every_problem() -> None:
    text = PAGE.read_text("utf-8")
    for title, _ in PROBLEMS.values():
        assert f"## {title}\n" in text
    for tool in ("siconos", "mujoco", "drake", "exudyn"):
        assert f"| {tool} | 0.001 |" in text


@pytest.mark.fmu
@pytest.mark.parametrize(("solver", "tolerance", "bar"), [("dopri5", 1e-10, 1e-6), ("radau5", 1e-8, 1e-6)])
def test_a_light_cart_meets_the_threshold_of_its_benchmark(solver: str, tolerance: float, bar: float, run: Run) -> None:
    """N. Parsons, 2026: the pole passes the vertical 11 times in 10 s, for a microsecond each."""
    motion = run("light_cart_pole", 10.0, tolerance, solver=solver)
    x, theta = closed_forms.light_cart_pole(motion.time)
    assert np.sqrt(((motion["x"] - x) ** 2 + (motion["theta"] - theta) ** 2).mean()) < bar


@pytest.mark.fmu
def test_the_pole_of_a_light_cart_turns_with_4429_radians_a_second(run: Run) -> None:
    passage = closed_forms.quarter_of_light_cart_pole()
    assert passage == pytest.approx(0.451524535681659, abs=2e-15)
    motion = run("light_cart_pole", passage, 1e-12)
    assert motion["theta_dot"][-1] == pytest.approx(-4429.4, abs=0.05)


@pytest.mark.fmu
@pytest.mark.parametrize(("solver", "tolerance"), [("dop853", None), ("dopri5", 1e-7)])
def test_a_planar_pendulum_keeps_its_energy(solver: str, tolerance: float | None, run: Run) -> None:
    """Within 5e-5 J, as the library wants it."""
    motion = run("planar_simple_pendulum", 10.0, tolerance, ("total_energy",), solver)
    assert np.abs(motion["total_energy"]).max() < 5e-5
    phi = closed_forms.pendulum(motion.time, -np.pi / 2, 0.0, np.sqrt(9.81))
    assert motion["x"] == pytest.approx(np.sin(phi), abs=2e-5)


@pytest.mark.fmu
def test_a_governor_keeps_its_angular_momentum(run: Run) -> None:
    """Its couplers are stiff and damped; the slider swings between 0.5 m and 0.744 m, as drawn for the benchmark."""
    motion = run("flyball_governor", 10.0, None, ("p_phi",))
    assert motion["p_phi"] == pytest.approx(np.full(1001, motion["p_phi"][0]), rel=1e-5)
    assert motion["s"].min() == pytest.approx(0.5, abs=1e-3)
    assert motion["s"].max() == pytest.approx(0.744, abs=2e-3)


@pytest.mark.fmu
def test_bricards_mechanism_keeps_its_energy(run: Run) -> None:
    """Within 1e-3 J; P3 swings from x = 1 m to -1 m and back in 5 s, as drawn for the benchmark."""
    motion = run("bricard", 10.0, None, ("total_energy",))
    assert np.ptp(motion["total_energy"]) < 1e-3
    assert motion["P3_x"][[0, 250, 500, 750, 1000]] == pytest.approx([1, -1, 1, -1, 1], abs=1e-3)


@pytest.mark.fmu
def test_a_spatial_slider_crank_moves_as_submitted(run: Run) -> None:
    """The most exact of the solutions that were submitted, and the energy."""
    motion = run("spatial_slider_crank", 5.0, 1e-10, ("total_energy",))
    for time, place in GONZALEZ.items():
        assert motion["s"][round(200 * time)] == pytest.approx(place, abs=5e-5)
    assert np.ptp(motion["total_energy"]) < 1e-9


def test_a_four_bar_linkage_with_a_spring_swings_as_published() -> None:
    small = linearize(problem("four_bar_with_spring"), at="equilibrium").state_space()
    angle = small.states[0].value
    assert angle == pytest.approx(LINKAGE_ANGLE, abs=5e-11)
    poles = np.sort_complex(np.linalg.eigvals(small.A))
    assert poles == pytest.approx(np.sort_complex(closed_forms.four_bar_poles(angle)), abs=1e-11)


SLOWLY = (pytest.mark.slow, pytest.mark.all_models)


@pytest.mark.fmu
@pytest.mark.parametrize(
    ("case", "bar"),
    [
        ("ball", 1e-12),
        ("block", 1e-12),
        ("rocking", 1e-8),
        ("column", 1e-9),
        pytest.param("woodpecker", 1e-5, marks=SLOWLY),
        pytest.param("cam", 1e-5, marks=SLOWLY),
        pytest.param("clearance", 1e-6, marks=SLOWLY),
    ],
)
def test_impacts_and_dry_friction_end_where_they_should(case: str, bar: float, exported) -> None:
    """In closed form, or where the independent path ends."""
    name, state, _ = nonsmooth.PROBLEMS[case]
    motion = simulate(exported(load(model_of(name))), stop_time=nonsmooth.END[case], step=0.01)
    assert motion[state][-1] == pytest.approx(nonsmooth.exact(case), abs=bar)
