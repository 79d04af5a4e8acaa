"""The laws along a run find every fault that is planted in the engine, and none where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.faults import FAULTS, STEPPED, Fault, planted

from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.errors import SimulationError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.formats.text import read, read_file
from lag2fmu.mechanism import Mechanism
from lag2fmu.verify.law_checks import law_checks
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Task
from lag2fmu.verify.time_stepping import own_step

pytestmark = pytest.mark.fmu

FAMILIES = Path(__file__).parents[1] / "hybrid_truth" / "families"
THROWN = {"disc": {"x_dot": -10.0}}
"""Start values (m/s) with which a disc still slides behind its first impact."""
STOPS = {"puck": 0.05, "row_of_blocks": 1.0}
"""Until when (s) a model runs, where its fault shows soon and makes a whole run take 10 s or minutes."""
QUICK = ("restitution is applied twice", "a gap closes late", "an impact is lost")
BUNDLED = ("backlash_slider_crank", "block_on_belt", "bouncing_ball", "brake", "braked_wheel", "clutch_pair")
BUNDLED += ("coulomb_oscillator", "crane", "falling_rod", "gripper", "hopper_leg", "impact_oscillator")
BUNDLED += ("newtons_cradle", "pendulum_with_stop", "rocking_block", "sliding_sphere", "stack_of_blocks", "woodpecker")


def _mechanism(model: str) -> Mechanism:
    file = FAMILIES / f"{model}.toml"
    return with_values(read_file(file) if file.exists() else as_mechanism(model), THROWN.get(model, {}))


def _found(path: Path) -> bool:
    """Whether a law is seen broken, or the FMU gives its run up, which ends ``validate`` with a sentence."""
    try:
        return "FAILED" in {check.outcome for check in _judged(path)}
    except SimulationError as error:
        return "grows beyond all bounds" in str(error)


def _judged(path: Path) -> list[Check]:
    """What the laws say of the FMU's default run, or of its beginning."""
    m = with_derived(read_mechanism(path))
    stop = STOPS.get(m.name, m.experiment.stop_time)
    step = own_step(m, path) / 10  # as short as ``validate`` chooses it
    checks = list(law_checks(Task(m, path, stop, m.experiment.tolerance, None, solver_step=step)))
    assert checks
    assert all(check.evidence == "laws" for check in checks)
    return checks


@pytest.mark.parametrize(
    "fault", [pytest.param(f, id=f.name, marks=() if f.name in QUICK else pytest.mark.slow) for f in FAULTS]
)
def test_a_planted_fault_is_found(fault: Fault, exported, tmp_path: Path) -> None:
    assert _found(planted(fault, exported(_mechanism(fault.model)).path, tmp_path / "faulty.fmu"))


@pytest.mark.parametrize(
    "fault", [pytest.param(f, id=f.name, marks=() if f.model == "bouncing_ball" else pytest.mark.slow) for f in STEPPED]
)
def test_a_fault_in_time_stepping_is_found(fault: Fault, exported, tmp_path: Path) -> None:
    """The same FMU without the fault obeys the laws."""
    right = exported(_mechanism(fault.model), solver="moreau").path
    assert "FAILED" not in {check.outcome for check in _judged(right)}
    assert _found(planted(fault, right, tmp_path / "faulty.fmu"))


def test_there_are_twenty_faults() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 20


@pytest.mark.parametrize(
    ("model", "fmi"),
    [
        *(pytest.param(m, "3.0", marks=() if m == "bouncing_ball" else pytest.mark.slow) for m in BUNDLED),
        pytest.param("newtons_cradle", "2.0", marks=pytest.mark.slow),
    ],
)
def test_bundled_models_obey_the_laws(model: str, fmi: str, exported) -> None:
    """No false alarm. By FMI 2.0 ``validate`` judges all others by these laws, in test_models.py."""
    assert {check.outcome for check in _judged(exported(model, fmi=fmi).path)} == {"ok"}


TUMBLING = """
mechanism = {{ name = "tumbling" }}
coordinates.psi = {{ unit = "rad", start = 0.001, velocity = {0!r} }}
coordinates.theta = {{ unit = "rad", start = 0.5, velocity = {1!r} }}
coordinates.phi = {{ unit = "rad", velocity = {2!r} }}
coordinates.x = {{ unit = "m" }}
frames.ball.rotations = [["z", "psi"], ["x", "theta"], ["z", "phi"]]
bodies.ball = {{ frame = "ball", mass = 0, inertia = [1, 1, 1, 0, 0, 0] }}
bodies.block = {{ mass = 1, position = ["x", 0, 0] }}
frictions.floor = {{ on = "x_dot", force = 1 }}
"""
"""A ball turns about an axis beside a block that rests; where theta is 0, Euler's angles are singular."""


def test_a_pulse_between_two_points_is_no_fault(exported) -> None:
    """psi turns by half a turn within 1 ms, as the axis of phi passes the vertical at 0.5 mrad, with 1 rad/s."""
    c, s = np.cos((0.001, 0.5)), np.sin((0.001, 0.5))
    axes = [[0, c[0], s[1] * s[0]], [0, s[0], -s[1] * c[0]], [1, 0, c[1]]]  # of psi, theta and phi
    ball = read(TUMBLING.format(*np.linalg.solve(axes, [-1.0, 0.0, 0.0]).tolist()), "tumbling")
    path = exported(ball).path
    assert {check.outcome for check in law_checks(Task(with_derived(ball), path, 1.0, 1e-6, None))} == {"ok"}


ON_A_BELT = """
mechanism = { name = "on_a_belt" }
coordinates.a = { unit = "m", velocity = 0.295 }
coordinates.b = { unit = "m", velocity = 0.295 }
energy.kinetic = "a_dot**2/2 + b_dot**2/2"
forces.a = "-a - 1.2*(a - b)"
forces.b = "-b - 1.2*(b - a)"
frictions.a = { on = "a_dot - 0.295", force = "1/(1 + 3*abs(a_dot - 0.295))" }
frictions.b = { on = "b_dot - 0.295", force = "1.3/(1 + 3*abs(b_dot - 0.295))" }
"""
"""Two blocks on a belt by U. Galvanetto, S. R. Bishop, Meccanica 34 (1999) 337-347; one comes to rest at 18.72 s."""


def test_what_an_interpolant_is_wrong_by_is_no_fault(exported) -> None:
    """Within the last step before that time velocities are off by 3 tolerances, up and down."""
    belt = read(ON_A_BELT, "on_a_belt")
    path = exported(belt).path
    assert {check.outcome for check in law_checks(Task(with_derived(belt), path, 25.0, 1e-6, None))} == {"ok"}
