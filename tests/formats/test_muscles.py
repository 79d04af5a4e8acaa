"""Muscles of MJCF: accelerations and rates of activation are MuJoCo's at random states, on all pieces of the curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from kkt import solve

from lag2fmu import derive, load
from lag2fmu.reference.equations import Equations

MJCF = """<mujoco><worldbody>
<body><joint name="a" axis="0 1 0" range="-90 90" limited="true"/>
<geom type="capsule" size=".05" fromto="0 0 0 .5 0 0"/>
<body pos=".5 0 0"><joint name="b" axis="0 1 0" range="-100 60" limited="true"/>
  <geom type="capsule" size=".05" fromto="0 0 0 .4 0 0"/></body></body></worldbody>
<tendon><fixed name="t"><joint joint="a" coef=".05"/><joint joint="b" coef="-.03"/></fixed></tendon>
<actuator><muscle name="plain" joint="a" gear=".1"/>
<muscle name="own" joint="b" gear="-.05" force="300" lmin=".6" lmax="1.5" vmax="2" fpmax="1.1" fvmax="1.3"
  timeconst=".02 .05" forcerange="-200 0"/>
<muscle name="smooth" tendon="t" tausmooth=".3" fvmax="1" lengthrange="-.05 .08"/>{more}</actuator></mujoco>"""


def written(folder: Path, more: str = "") -> Path:
    path = folder / "arm.xml"
    path.write_text(MJCF.replace("{more}", more), "utf-8")
    return path


def test_muscles_are_those_of_mujoco(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    path = written(tmp_path)
    model, mechanism = mujoco.MjModel.from_xml_path(str(path)), load(path)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    data, equations, generator = mujoco.MjData(model), Equations(mechanism), np.random.default_rng(0)
    names, lengths, speeds = ("plain", "own", "smooth"), [], []
    for _ in range(200):
        q, v, z = generator.uniform(-4, 4, 2), generator.uniform(-25, 25, 2), generator.uniform(0, 1, 3)
        u = generator.uniform(-0.2, 1.2, 3)
        data.qpos[:], data.qvel[:], data.ctrl[:], data.act[:] = q, v, u, z
        mujoco.mj_forward(model, data)
        inputs = {f"u_{name}": x for name, x in zip(names, u, strict=True)}
        inputs |= {f"act_{name}": x for name, x in zip(names, z, strict=True)}
        state = equations.energies.state(0.0, q, v, inputs)
        solved = equations.solved(state)
        assert solved[0] == pytest.approx(data.qacc, rel=1e-12, abs=1e-10)
        assert equations.energies.further(state, solved) == pytest.approx(data.act_dot, rel=1e-12, abs=1e-10)
        unit = np.diff(model.actuator_lengthrange[0]) / 0.3
        lengths.append(float(0.75 + (data.actuator_length[0] - model.actuator_lengthrange[0, 0]) / unit[0]))
        speeds.append(float(data.actuator_velocity[0] / unit[0] / 1.5))
    assert np.histogram(lengths, [0.6, 0.75, 1.0, 1.3])[0].min() > 10
    assert np.histogram(speeds, [-2, -0.6, 0, 0.2, 2])[0].min() > 10, speeds


SPATIAL = """<mujoco><option><flag contact="disable" limit="disable"/></option><worldbody>
<site name="o" pos="-.1 .02 .1"/>
<body><joint name="a" axis="0 1 0"/><geom type="capsule" size=".05" fromto="0 0 0 .5 0 0"/>
<site name="p" pos=".2 0 .07"/>
<body pos=".5 0 0"><joint name="b" axis="0 1 0"/><joint name="s" type="slide" axis="1 0 0"/>
  <geom type="capsule" size=".05" fromto="0 0 0 .4 0 0"/><site name="q" pos=".15 .03 .05"/></body></body></worldbody>
<tendon><spatial name="t" stiffness="7" damping=".3" springlength=".6">
  <site site="o"/><site site="p"/><site site="q"/></spatial>
<spatial name="t2"><site site="o"/><site site="q"/></spatial></tendon>
<actuator><muscle name="long" tendon="t" force="200" lengthrange=".5 .8"/>
<muscle name="two" tendon="t2" gear="-2" force="50" tausmooth=".2" lengthrange="-1.5 -.9" forcerange="-40 0"/>
<position name="servo" tendon="t" kp="9" kv=".4" gear="-2" forcerange="-5 4"/>
<general name="valve" tendon="t2" gaintype="affine" gainprm="2 1 .5" biastype="affine" biasprm=".3 -4 -.6"/></actuator>
<sensor><tendonpos name="way" tendon="t"/><tendonvel name="rate" tendon="t"/><actuatorpos name="at" actuator="two"/>
<actuatorvel name="speed" actuator="servo"/><actuatorfrc name="pull" actuator="two"/></sensor></mujoco>"""


def test_forces_along_places_depend_on_length_and_rate_as_in_mujoco(tmp_path: Path) -> None:
    """Muscles, a servo that saturates, a valve and a spring with damper along two and three sites; sensors."""
    mujoco = pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    path = tmp_path / "spatial.xml"
    path.write_text(SPATIAL, "utf-8")
    model, mechanism = mujoco.MjModel.from_xml_path(str(path)), load(path)
    assert mechanism.not_taken == ()
    assert {p.name: p.unit.name for p in mechanism.parameters if p.unit}["peak_u_long"] == "N"
    data, equations, generator = mujoco.MjData(model), derive(mechanism), np.random.default_rng(1)
    names, outputs = [q.name for q in mechanism.coordinates], [equations.outputs[x.name] for x in mechanism.outputs]
    fixed = {p.name: p.value for p in mechanism.parameters} | {f"Q_{q}": 0.0 for q in names} | {"t": 0.0}
    for _ in range(100):
        q, v = generator.uniform(-1.5, 1.5, 3), generator.uniform(-10, 10, 3)
        data.qpos[:], data.qvel[:], data.act[:] = q, v, generator.uniform(0, 1, 2)
        data.ctrl[:] = generator.uniform(-2, 2, 4)
        mujoco.mj_forward(model, data)
        at = fixed | dict(zip(names, q, strict=True)) | {f"{name}_dot": x for name, x in zip(names, v, strict=True)}
        at |= dict(zip(("u_long", "u_two", "u_servo", "u_valve"), data.ctrl, strict=True))
        at |= dict(zip(("act_long", "act_two"), data.act, strict=True))
        assert solve(equations, at)[0] == pytest.approx(data.qacc, rel=1e-10, abs=1e-10)
        assert equations.graph.evaluate(outputs, at) == pytest.approx(data.sensordata, rel=1e-10, abs=1e-10)


def test_a_muscle_whose_curves_differ_is_told(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    curves = 'gaintype="muscle" gainprm="0.75 1.05 -1 200 0.5 1.6 1.5 1.3 1.2"'
    passive = 'biastype="muscle" biasprm="0.7 1.05 -1 200 0.5 1.6 1.5 1.3 1.2"'
    other = f'<general name="other" joint="a" dyntype="muscle" {curves} {passive}/>'
    why = "a muscle acts along joints and tendons without wraps, and has one curve"
    assert f"the actuator other: {why}" in load(written(tmp_path, other)).not_taken
