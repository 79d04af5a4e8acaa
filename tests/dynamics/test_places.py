"""Forces and torques at places and the motion of places, on the graph: closed forms of a free rigid body."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lag2fmu.analysis.evaluation import unknowns
from lag2fmu.description import names
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.mechanism import Body, Frame, Mechanism, Ports, coordinate

MASS, INERTIA = 2.0, np.array([0.3, 0.5, 0.7])


@pytest.mark.parametrize("axes", ["world", "frame"])
def test_force_and_torque_on_a_body_that_a_quaternion_turns(axes: str) -> None:
    """Newton and Euler: m a = F, I alpha + omega x I omega = torque, about the mass centre, in the body's axes."""
    x = [coordinate(name, "m") for name in ("x", "y", "z")]
    e = [coordinate(f"e{i}", start=1.0 if i == 0 else 0.0) for i in range(4)]
    satellite = Frame("satellite", origin=x, quaternion=e)
    hull = Body("hull", MASS, frame=satellite, inertia=(*INERTIA, 0, 0, 0))
    ports = Ports("none", forces={"hull": axes}, torques={"frames.satellite": axes}, accelerations=["hull"])
    equations = derive(Mechanism("free", coordinates=[*x, *e], frames=[satellite], bodies=[hull], ports=ports))

    generator = np.random.default_rng(3)
    force, torque, omega = generator.uniform(-1, 1, (3, 3))
    quaternion = generator.uniform(-1, 1, 4)
    quaternion /= np.linalg.norm(quaternion)
    R = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()  # SciPy has the scalar part last
    e0, vector = quaternion[0], quaternion[1:]
    rates = 0.5 * np.array([-vector @ omega, *(e0 * omega + np.cross(vector, omega))])  # omega in the body's axes
    known = start_values(equations.mechanism)
    known |= {f"e{i}": value for i, value in enumerate(quaternion)} | {f"e{i}_dot": r for i, r in enumerate(rates)}
    known |= {f"hull_force_{k}": value for k, value in zip("xyz", force, strict=True)}
    known |= {f"satellite_torque_{k}": value for k, value in zip("xyz", torque, strict=True)}
    qdd, _ = unknowns(equations, known)
    known |= zip((names.acceleration(q.name) for q in equations.mechanism.coordinates), qdd, strict=True)
    found = dict(zip(equations.outputs, equations.graph.evaluate(equations.outputs.values(), known), strict=True))

    own = torque if axes == "frame" else R.T @ torque
    alpha = R @ ((own - np.cross(omega, INERTIA * omega)) / INERTIA)
    pushed = (R @ force if axes == "frame" else force) / MASS
    assert [found[f"hull_acceleration_{k}"] for k in "xyz"] == pytest.approx(pushed, rel=1e-10)
    assert [found[f"hull_angular_acceleration_{k}"] for k in "xyz"] == pytest.approx(alpha, rel=1e-10)
