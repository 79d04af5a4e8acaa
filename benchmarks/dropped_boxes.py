"""Boxes dropped with random poses and velocities onto a plane: does energy grow, does one sink, do all come to rest?

Run with `make bench` or `python -m benchmarks.dropped_boxes [COUNT [TOOL ...]]`, beside MuJoCo and Drake where they
are installed. A cube of 2 kg and 0.2 m falls from 1 m; friction 0.5, steps of 1 ms, 6 s, recorded each 10 ms. MuJoCo
and Drake have no coefficient of restitution; it is 0 here, and 0.3 in the row moreau_rebounding. Energy is computed
alike for all from place and velocity. A box is counted whose energy grows between two records by more than 1e-4 J of
about 20 J; which has a corner more than 1 mm below the plane at some record; whose kinetic energy is above 1e-9 J in
the end.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from lag2fmu import export, load, simulate

MASS, EDGE, FRICTION, G = 2.0, 0.2, 0.5, 9.81
END, RECORD, STEP = 6.0, 0.01, 1e-3
GROWS, SINKS, MOVES = 1e-4, 1e-3, 1e-9
"""What counts: J, m, J."""
INERTIA = MASS * EDGE**2 / 6
CORNERS = np.array([*product((-EDGE / 2, EDGE / 2), repeat=3)])
BOX = f"""<robot name="box"><link name="base">
<inertial><mass value="{MASS}"/>
<inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="{INERTIA}" ixy="0" ixz="0" iyz="0"/></inertial>
<collision name="c"><geometry><box size="{EDGE} {EDGE} {EDGE}"/></geometry></collision></link></robot>"""
STATES = [f"base_{x}" for x in ("x", "y", "z", "e0", "e1", "e2", "e3")]

Floats = np.ndarray[Any, np.dtype[np.float64]]
Run = Callable[[Floats, Floats, Floats], tuple[Floats, Floats, Floats]]
"""The motion from a turn (4,), a velocity (3,) and an angular one (3,): heights (k,), turns (k, 4) and velocities
(k, 6); all in the axes of the world, in SI units."""


def ours(solver: str, restitution: float, folder: Path) -> Run:
    """By an FMU of lag2fmu."""
    (folder / "box.urdf").write_text(BOX)
    options = {"base": "floating", "ground": "all", "friction": FRICTION, "restitution": restitution}
    fmu = export(load(folder / "box.urdf", options), folder / f"{solver}.fmu", solver=solver)
    rates = [f"{name}_dot" for name in STATES]

    def run(turn: Floats, velocity: Floats, spin: Floats) -> tuple[Floats, Floats, Floats]:
        start = [0.0, 0.0, 1.0, *turn, *velocity, *_rates(turn, spin)]
        values = dict(zip([*STATES, *rates], map(float, start), strict=True))
        found = simulate(fmu, stop_time=END, step=RECORD, values=values, outputs=[*STATES, *rates])
        states = np.column_stack([found[name] for name in (*STATES, *rates)])
        spins = np.array([_spin(q, qd) for q, qd in zip(states[:, 3:7], states[:, 10:], strict=True)])
        return states[:, 2], states[:, 3:7], np.column_stack([states[:, 7:10], spins])

    return run


def mujoco() -> Run:
    """By MuJoCo with contacts as they are by default."""
    mj = import_module("mujoco")

    model = mj.MjModel.from_xml_string(f"""<mujoco><option timestep="{STEP}" gravity="0 0 -{G}" cone="elliptic"/>
      <worldbody><geom type="plane" size="9 9 1" friction="{FRICTION} 0 0"/><body pos="0 0 1"><freejoint/>
      <geom type="box" size="{EDGE / 2} {EDGE / 2} {EDGE / 2}" mass="{MASS}" friction="{FRICTION} 0 0"/>
      </body></worldbody></mujoco>""")

    def run(turn: Floats, velocity: Floats, spin: Floats) -> tuple[Floats, Floats, Floats]:
        data, records = mj.MjData(model), []
        data.qpos[:] = [0.0, 0.0, 1.0, *turn]
        data.qvel[:] = [*velocity, *(_matrix(turn).T @ spin)]  # its angular velocities are those of the body's axes
        for _ in range(round(END / RECORD) + 1):
            records.append([*data.qpos[2:], *data.qvel])
            mj.mj_step(model, data, round(RECORD / STEP))
        states = np.array(records)
        return states[:, 0], states[:, 1:5], states[:, 5:]

    return run


def drake() -> Run:
    """By Drake's discrete plant with point contact, its eight corners spheres of a micrometre."""
    dr = import_module("pydrake.all")

    builder = dr.DiagramBuilder()
    plant, _ = dr.AddMultibodyPlantSceneGraph(builder, time_step=STEP)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -G])
    inertia = dr.SpatialInertia(MASS, np.zeros(3), dr.UnitInertia.SolidBox(EDGE, EDGE, EDGE))
    box, friction = plant.AddRigidBody("box", inertia), dr.CoulombFriction(FRICTION, FRICTION)
    plant.RegisterCollisionGeometry(plant.world_body(), dr.RigidTransform(), dr.HalfSpace(), "floor", friction)
    for i, corner in enumerate(CORNERS):
        plant.RegisterCollisionGeometry(box, dr.RigidTransform(corner), dr.Sphere(1e-6), f"corner{i}", friction)
    plant.Finalize()
    simulator = dr.Simulator(builder.Build())
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)

    def run(turn: Floats, velocity: Floats, spin: Floats) -> tuple[Floats, Floats, Floats]:
        root.SetTime(0.0)
        pose = dr.RigidTransform(dr.Quaternion(turn / np.linalg.norm(turn)), [0.0, 0.0, 1.0])
        plant.SetFreeBodyPose(context, box, pose)
        plant.SetFreeBodySpatialVelocity(context, box, dr.SpatialVelocity(spin, velocity))
        simulator.Initialize()
        records = []
        for k in range(round(END / RECORD) + 1):
            simulator.AdvanceTo(k * RECORD)
            q, v = plant.GetPositions(context), plant.GetVelocities(context)
            records.append([q[6], *q[:4], *v[3:], *v[:3]])
        states = np.array(records)
        return states[:, 0], states[:, 1:5], states[:, 5:]

    return run


def _matrix(q: Floats) -> Floats:
    """The rotation (3, 3) of a unit quaternion ``q`` (4,)."""
    w, x, y, z = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: Floats = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return rotation


def _rates(q: Floats, spin: Floats) -> Floats:
    """The rates (4,) of a unit quaternion ``q`` (4,) that turns with ``spin`` (3,), rad/s in the world's axes."""
    found: Floats = np.array([-q[1:] @ spin, *(q[0] * spin + np.cross(spin, q[1:]))]) / 2
    return found


def _spin(q: Floats, rates: Floats) -> Floats:
    """The angular velocity (3,) of a quaternion ``q`` (4,) with ``rates`` (4,)."""
    found: Floats = 2 * (q[0] * rates[1:] - rates[0] * q[1:] - np.cross(rates[1:], q[1:])) / (q @ q)
    return found


def judged(heights: Floats, turns: Floats, velocities: Floats) -> tuple[float, float, float]:
    """The greatest growth of energy between two records (J), the greatest depth (m), the last kinetic energy (J)."""
    kinetic = (MASS * (velocities[:, :3] ** 2).sum(axis=1) + INERTIA * (velocities[:, 3:] ** 2).sum(axis=1)) / 2
    energy = kinetic + MASS * G * heights
    lowest = [
        height + (CORNERS @ _matrix(q / np.linalg.norm(q)).T)[:, 2].min()
        for height, q in zip(heights, turns, strict=True)
    ]
    return float(np.diff(energy).max()), -min(lowest), float(kinetic[-1])


def starts(count: int) -> Iterator[tuple[Floats, Floats, Floats]]:
    """``count`` random turns, velocities (1 m/s) and angular velocities (3 rad/s)."""
    generator = np.random.default_rng(2)
    for _ in range(count):
        q, spin, velocity = generator.normal(size=4), 3 * generator.normal(size=3), generator.normal(size=3)
        yield q / np.linalg.norm(q), velocity, spin


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=1000)
    parser.add_argument("tools", nargs="*", metavar="TOOL", help="default: all that are installed")
    asked = parser.parse_args()
    count = asked.count
    table = Table(title=f"{count} boxes", title_justify="left")
    for heading in ("tool", "energy grows", "sinks", "moves", "most J", "deepest m", "last J", "CPU s"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        tools: dict[str, Callable[[], Run]] = {
            "moreau": lambda: ours("moreau", 0.0, Path(folder)),
            "moreau_rebounding": lambda: ours("moreau", 0.3, Path(folder)),
            "dopri5": lambda: ours("dopri5", 0.0, Path(folder)),
            **({"mujoco": mujoco} if find_spec("mujoco") else {}),
            **({"drake": drake} if find_spec("pydrake") else {}),
        }
        for name in asked.tools or tools:
            run = tools[name]()
            begun = time.process_time()
            worst = np.array([judged(*run(*start)) for start in starts(count)])
            spent = time.process_time() - begun
            exceeded = (worst > (GROWS, SINKS, MOVES)).sum(axis=0)
            cells = (*map(str, exceeded), *(f"{x:.1e}" for x in worst.max(axis=0)), f"{spent:.0f}")
            table.add_row(name, *cells)
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
