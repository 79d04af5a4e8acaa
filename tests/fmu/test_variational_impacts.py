"""Variational methods over impacts: a step ends at the event, and the next one starts with the momenta after it."""

from collections.abc import Callable

import numpy as np
import pytest

from lag2fmu import export, simulate
from lag2fmu.errors import ExportError
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load, with_values

pytestmark = pytest.mark.fmu


@pytest.mark.parametrize(("solver", "order"), [("verlet", 2), ("lobatto4", 4)])
def test_the_energy_stays_where_it_is_over_150_impacts(solver: str, order: int, exported: Callable[..., Fmu]) -> None:
    """It oscillates by an error of the method's order, no more at the end than at the beginning."""
    stopped = with_values(load("pendulum_with_stop"), {"e": 1.0})
    names = ("total_energy", "hinge_lower_impacts", "hinge_lower_gap")
    ranges = []
    for step in (1e-2, 5e-3):
        fmu = exported(stopped, solver=solver)
        run = simulate(fmu, stop_time=200.0, step=0.5, values={"solver_step": step}, outputs=names)
        energy = run["total_energy"]
        assert run["hinge_lower_impacts"][-1] == 150
        assert run["hinge_lower_gap"].min() >= 0.0
        assert np.ptp(energy[200:]) <= 1.01 * np.ptp(energy[:200])
        ranges.append(np.ptp(energy))
    assert np.log2(ranges[0] / ranges[1]) == pytest.approx(order, abs=0.1)


def test_a_ball_comes_to_rest(exported: Callable[..., Fmu]) -> None:
    """Its arcs are parabolas, which the method has exactly; at rest the contact is a constraint of the action."""
    names = ("y", "floor_mode", "floor_force", "total_energy", "dissipated_energy")
    run = simulate(exported("bouncing_ball", solver="verlet"), stop_time=5.0, step=1e-3, outputs=names)
    assert run.time[run["floor_mode"] != 1][0] == pytest.approx(4.0637, abs=1e-3)
    assert (run["y"][-1], run["floor_force"][-1]) == (0.0, pytest.approx(0.5 * 9.81, rel=1e-12))
    assert np.ptp(run["total_energy"] + run["dissipated_energy"]) < 1e-12


@pytest.mark.parametrize(
    ("solver", "model", "words"),
    [
        ("gauss4", "bouncing_ball", "takes no constraint, which a contact or stop is while it is closed"),
        ("verlet", "block_on_belt", "the forces of frictions.belt belong to none"),
        ("verlet", "gripper", "the forces of .*constraints.holonomic.* belong to none"),
    ],
)
def test_what_belongs_to_no_action_is_refused(solver: str, model: str, words: str, tmp_path) -> None:
    with pytest.raises(ExportError, match=words):
        export(load(model), tmp_path / "x.fmu", solver=solver)
