"""Robots of the package example-robot-data: accelerations as Pinocchio computes them, at random states.

Pinocchio: J. Carpentier et al., The Pinocchio C++ library, IEEE Int. Symp. System Integrations, 2019.
"""

from __future__ import annotations

import importlib.metadata
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from lag2fmu import derive, export, load, validate
from lag2fmu.cli import main
from lag2fmu.errors import Lag2FmuError
from lag2fmu.formats.robots.assembly import description_of
from lag2fmu.formats.robots.tree import Robot
from lag2fmu.formats.robots.urdf import read_urdf
from lag2fmu.graph.batches import evaluate
from lag2fmu.mechanism.record import complete

pytestmark = pytest.mark.toolchain

REFUSED = {
    "alex_psyonic_hands.urdf": "mimics 'index_q1': no such joint",
    "iris_simple.urdf": "nothing moves in this robot",
    "quadrotor_base.urdf": "nothing moves in this robot",
    "romeo.urdf": "the motion along LHand has no mass",
    "romeo_laas_small.urdf": "is not positive",
    "ur3.urdf": "the robot has no links",
}
"""The files that are no tree of rigid bodies that moves, with the reason that is given."""


def corpus() -> list[Path]:
    """All URDF files of the package."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("the package example-robot-data is not installed; 'make test-all' does so")
    return sorted(Path(str(file.locate())) for file in files if file.suffix == ".urdf")


def test_accelerations_of_all_robots_are_pinocchios() -> None:
    """1e-10 of the greatest acceleration; the files round quarter turns to 12 digits, which are exact here."""
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed; 'make test-all' does so")
    files, refused, worst = corpus(), {}, {}
    assert len(files) >= 69
    for path in files:
        try:
            worst[path.name] = difference(pin, path)
        except Lag2FmuError as error:
            refused[path.name] = str(error)
    assert refused.keys() == REFUSED.keys()
    assert not {name: text for name, text in refused.items() if REFUSED[name] not in text}
    assert not {name: error for name, error in worst.items() if error > 1e-10}


def test_a_robot_with_two_arms_goes_all_the_way(tmp_path: Path) -> None:
    """URDF to text, text to FMU, and the FMU validated: Baxter's 17 coordinates."""
    urdf = next(path for path in corpus() if path.name == "baxter.urdf")
    text = tmp_path / "baxter.toml"
    done = CliRunner().invoke(main, ["import", str(urdf), "-o", str(text)])
    assert done.exit_code == 0, done.output
    found, expected = load(text).description, load(urdf).description
    assert replace(found, visuals=()) == replace(expected, visuals=())
    seen = [[x.find() and x.find().resolve() for x in of.visuals] for of in (found, expected)]
    assert seen[0] == seen[1]
    assert any(seen[0])
    fmu = export(text, tmp_path / "baxter.fmu")
    assert len(fmu.mechanism.coordinates) == 17
    report = validate(fmu, stop_time=0.2)
    assert report.passed, report


def difference(pin: Any, path: Path) -> float:
    """The largest difference of the accelerations of ``path`` from Pinocchio's, as part of the greatest one."""
    robot = read_urdf(path)
    written = description_of(robot, path)
    mechanism = complete(replace(written, dampers=(), frictions=()))  # Pinocchio's have none
    equations, names = derive(mechanism), [q.name for q in mechanism.coordinates]
    assert equations.solution is not None
    rng, n = np.random.default_rng(1), len(names)
    q, v, force = rng.uniform(-1, 1, (3, n))
    values = {"t": 0.0, **{p.name: p.value for p in mechanism.parameters}}
    for kind, numbers in (("{}", q), ("{}_dot", v), ("Q_{}", force)):
        values |= dict(zip(map(kind.format, names), numbers, strict=True))
    found = evaluate(equations.graph, equations.solution.x, values)
    expected = by_pinocchio(pin, path, robot, dict(zip(names, zip(q, v, force, strict=True), strict=True)))
    return float(max(abs(found - expected)) / max(abs(expected)))


def by_pinocchio(pin: Any, path: Path, robot: Robot, state: dict[str, tuple[float, ...]]) -> NDArray[np.float64]:
    """The accelerations of the coordinates in ``state`` {joint: (q, qd, Q)}, in their order; mimics follow."""
    model = pin.buildModelFromUrdf(str(path))
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    q, v = pin.neutral(model), np.zeros(model.nv)
    leading, order = np.zeros((model.nv, len(state))), list(state)
    joints = {j.name: j for j in robot.joints}
    for k in range(1, model.njoints):
        own, factor, offset = joints[model.names[k]], 1.0, 0.0
        while own.mimic is not None:
            factor, offset, own = (
                factor * own.mimic.factor,
                factor * own.mimic.offset + offset,
                joints[own.mimic.leader],
            )
        name = re.sub(r"\W", "_", own.name)
        at, joint = factor * state[name][0] + offset, model.joints[k]
        q[joint.idx_q : joint.idx_q + joint.nq] = at if joint.nq == 1 else (np.cos(at), np.sin(at))
        v[joint.idx_v] = factor * state[name][1]
        leading[joint.idx_v, order.index(name)] = factor
    data = model.createData()
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    force = np.array([Q for *_, Q in state.values()]) - leading.T @ pin.nonLinearEffects(model, data, q, v)
    return np.linalg.solve(leading.T @ mass @ leading, force)
