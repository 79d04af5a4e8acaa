"""MJCF files of the packages dm_control and gymnasium: all that describe what moves come in, and move as in MuJoCo.

The packages are not needed beside their files: 'pip install --no-deps dm_control gymnasium' is enough.
'make test-all' does so.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import kkt
import numpy as np
import pytest
from numpy.typing import NDArray

from lag2fmu import derive, load
from lag2fmu.dynamics import EquationsOfMotion
from lag2fmu.errors import LoadError
from lag2fmu.graph import batches
from lag2fmu.graph.graph import Node
from lag2fmu.mechanism.record import Mechanism, complete

mujoco = pytest.importorskip("mujoco", reason="the optional package mujoco is not installed; 'make test-all' does so")

pytestmark = pytest.mark.toolchain

Floats = NDArray[np.float64]

PACKAGES = ("dm_control", "gymnasium")
REFUSED = ("nothing moves in this robot", "MuJoCo refuses it: ")
"""What is said of files that hold a scene or a part of a robot alone, and of those whose meshes are not beside them."""
STATES, TOLERANCE = 10, 1e-10
FREE, BALL = 0, 1


def corpus() -> list[Path]:
    """All MJCF files of the packages."""
    files: list[Path] = []
    for package in PACKAGES:
        try:
            found = importlib.metadata.files(package) or []
        except importlib.metadata.PackageNotFoundError:
            pytest.skip(f"the package {package} is not installed; pip install --no-deps {package}")
        files += [Path(str(file.locate())) for file in found if file.suffix == ".xml"]
    return [path for path in sorted(files) if b"<mujoco" in path.read_bytes()]


def test_all_files_come_in_and_move_as_in_mujoco() -> None:
    """Accelerations and sensors, with contacts, limits, dry friction, equalities and the medium off; controls saturate.

    1e-10 of the greatest acceleration or reading, or what rounding makes of accelerations if that is more. Only the
    adhesion of the fruit fly's feet is no actuator here.
    """
    files, refused, left_out, worst = corpus(), dict[str, str](), dict[str, str](), dict[str, float]()
    whole = 0
    assert len(files) >= 70
    for path in files:
        try:
            mechanism = load(path)
        except LoadError as error:
            refused[path.name] = str(error)
            continue
        whole += not any(what.startswith(("the actuator", "the sensor")) for what in mechanism.not_taken)
        left_out |= {what: path.name for what in mechanism.not_taken if what.startswith(("the actuator", "the equal"))}
        worst[str(path)] = max(differences(mechanism, path))
    assert len(worst) >= 50
    assert whole >= 0.9 * len(worst)  # 46 of 51, with all actuators and sensors
    assert not [error for error in refused.values() if not any(words in error for words in REFUSED)]
    assert not {name: error for name, error in worst.items() if not error <= TOLERANCE}
    assert all(what.startswith("the actuator adhere_") and "fl" in name for what, name in left_out.items()), left_out


def differences(mechanism: Mechanism, path: Path) -> Iterator[float]:
    """The largest differences of accelerations and of sensors from MuJoCo's, at each state."""
    model = bare(path)
    open_chain = complete(replace(mechanism.description, constraints=(), joints=(), frictions=()))
    equations, state, rng = derive(open_chain), mujoco.MjData(model), np.random.default_rng(82)
    fixed = {p.name: p.value for p in equations.mechanism.parameters} | {"t": 0.0}
    fixed |= {u.name: 0.0 for u in equations.mechanism.inputs}
    fixed |= {f"Q_{q.name}": 0.0 for q in equations.mechanism.coordinates}
    controls = [u.name for u in equations.mechanism.inputs if u.name.startswith("u_")]
    taken = [k for k in range(model.nu) if model.actuator_trntype[k] != mujoco.mjtTrn.mjTRN_BODY]
    values, told = list[dict[str, float]](), []
    for _ in range(STATES):
        state.qpos[:], state.qvel[:] = 0.5 * rng.normal(size=model.nq), rng.normal(size=model.nv)
        state.act[:] = rng.uniform(-0.3, 0.3, size=model.na)
        state.ctrl[taken] = 3 * rng.normal(size=len(taken))
        mujoco.mj_normalizeQuat(model, state.qpos)
        mujoco.mj_forward(model, state)
        given = dict(zip(controls, state.ctrl[taken], strict=True))
        given |= dict(zip([z.name for z in equations.mechanism.states], state.act, strict=True))
        values.append(fixed | given | coordinates(equations.mechanism, model, state))
        scale = max(1.0, float(np.abs(state.qacc).max())) * max(1.0, rounding(model, state) / TOLERANCE)
        told.append((state.qpos.copy(), state.qacc.copy(), state.sensordata.copy(), scale))
    rows = together(equations, kkt.parts(equations), values)
    for numbers, given, (qpos, qacc, _, scale) in zip(rows, values, told, strict=True):
        found = kkt.solved(equations, numbers)[0]
        yield float(np.abs(accelerations(model, qpos, found) - qacc).max()) / scale
        given |= {f"{q.name}_ddot": x for q, x in zip(equations.mechanism.coordinates, found, strict=False)}
    yield from readings(equations, model, [sensors for _, _, sensors, _ in told], values)


def together(equations: EquationsOfMotion, nodes: Sequence[Node], values: Sequence[dict[str, float]]) -> Floats:
    """The values (states, k) of ``nodes`` (k,) at all states with these ``values`` by name."""
    columns = {name: np.array([given[name] for given in values]) for name in values[0]}
    found = batches.evaluate(equations.graph, nodes, columns)
    return np.broadcast_to(found.T, (len(values), len(nodes)))


def rounding(model: Any, state: Any) -> float:
    """The relative error of accelerations by rounding: that of a double by the condition number of the mass matrix.

    The matrix is scaled to a diagonal of 1. Where the axes of the first and the last of three hinges coincide it is
    singular without armature. A wing of the fruit fly comes near it: 1.8e7 in the ninth state.
    Source: N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd edition, section 10.1.
    """
    inverse = np.empty((model.nv, model.nv))
    mujoco.mj_solveM(model, state, inverse, np.eye(model.nv))
    scale = 1 / np.sqrt(np.diag(inverse))
    return float(np.finfo(float).eps * np.linalg.cond(scale[:, None] * inverse * scale))


def readings(
    equations: EquationsOfMotion, model: Any, measured: Sequence[Floats], values: Sequence[dict[str, float]]
) -> Iterator[float]:
    """The differences of the sensors that are outputs, relative to the greatest reading of a sensor, at each state."""
    told = {output.doc: output.names for output in equations.mechanism.outputs}
    sensors = [model.sensor(k) for k in range(model.nsensor)]
    compared = [(sensor, told[f"sensor {sensor.name}"]) for sensor in sensors if f"sensor {sensor.name}" in told]
    nodes = [equations.outputs[name] for _, names in compared for name in names]
    for row, sensordata in zip(together(equations, nodes, values), measured, strict=True) if nodes else ():
        numbers = iter(row)
        for sensor, names in compared:
            expected = sensordata[sensor.adr[0] : sensor.adr[0] + sensor.dim[0]]
            found = np.array([next(numbers) for _ in names])
            if sensor.cutoff[0] and np.abs(expected).max() >= sensor.cutoff[0]:
                continue
            same = -1 if len(found) == 4 and found @ expected < 0 else 1  # e and -e are one orientation
            yield float(np.abs(same * found - expected).max()) / max(1.0, float(np.abs(expected).max()))


def bare(path: Path) -> Any:
    """The model without what is not compared."""
    model, bits = mujoco.MjModel.from_xml_path(str(path)), mujoco.mjtDisableBit
    model.opt.disableflags |= sum(
        int(getattr(bits, f"mjDSBL_{name}")) for name in ("CONTACT", "LIMIT", "FRICTIONLOSS", "EQUALITY")
    )
    model.opt.density = model.opt.viscosity = 0.0
    model.opt.wind[:] = 0.0
    return model


def coordinates(mechanism: Mechanism, model: Any, state: Any) -> dict[str, float]:
    """The values of the coordinates, which are in the order of MuJoCo's joints, and their velocities."""
    names, values = iter(q.name for q in mechanism.coordinates), dict[str, float]()
    for joint in range(model.njnt):
        kind, at, dof = model.jnt_type[joint], model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        along = {FREE: 3, BALL: 0}.get(kind, 1)
        for k in range(along):
            name = next(names)
            values |= {name: state.qpos[at + k], f"{name}_dot": state.qvel[dof + k]}
        if kind in (FREE, BALL):
            q, w = state.qpos[at + along : at + along + 4], state.qvel[dof + along : dof + along + 3]
            rates = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
            for e, rate in zip(q, rates, strict=True):
                name = next(names)
                values |= {name: e, f"{name}_dot": rate}
    return values


def accelerations(model: Any, qpos: Any, found: Any) -> Any:
    """MuJoCo's accelerations from those of our coordinates: of a quaternion, twice the vector part of e* e''."""
    result, column = np.zeros(model.nv), 0
    for joint in range(model.njnt):
        kind, at, dof = model.jnt_type[joint], model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        along = {FREE: 3, BALL: 0}.get(kind, 1)
        result[dof : dof + along] = found[column : column + along]
        column += along
        if kind in (FREE, BALL):
            q, e = qpos[at + along : at + along + 4], found[column : column + 4]
            result[dof + along : dof + along + 3] = 2 * (q[0] * e[1:] - e[0] * q[1:] - np.cross(q[1:], e[1:]))
            column += 4
    return result
