"""A case of `benchmarks.nonsmooth` by another tool: ``python contact_peers.py TOOL CASE STEP`` prints value, CPU s.

Run by an interpreter that has the tool, so nothing of this project is imported. What each case is stands in
`benchmarks.nonsmooth`. Steps in s, values in m or rad. Exits with a sentence where the tool cannot do the case.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

END = {"ball": 3.0, "block": 2.0, "rocking": 1.0, "woodpecker": 0.3, "cam": 1.0, "clearance": 0.5, "column": 0.8}
"""The time (s) at which the case is asked for its value."""
G = 9.81
BEADS = 10
TILT = 0.15
"""The angle (rad) at which the rocking block is let go."""
NO_RESTITUTION = "no coefficient of restitution"
NO_BUSH = "no contact of a pin in its bush"
SOFT = {"ball": NO_RESTITUTION, "woodpecker": NO_RESTITUTION, "cam": NO_RESTITUTION, "column": NO_RESTITUTION}
CANNOT = {
    "siconos": {},
    "mujoco": {**SOFT, "clearance": NO_BUSH},
    "drake": {**SOFT, "clearance": NO_BUSH},
    "exudyn": {**SOFT, "clearance": NO_BUSH, "rocking": "no laws of contact, which it replaces by springs"},
}
"""{tool: {case: why it cannot do the case}}"""
Timed = tuple[float, float]


def timed(step: Callable[[], object], count: int) -> float:
    """CPU time (s) of ``count`` calls."""
    begun = time.process_time()
    for _ in range(count):
        step()
    return time.process_time() - begun


def rocking_centre() -> list[float]:
    """Where (m) the centre of the rocking block, .2 m wide and .8 m high, is when one edge of it is at 0."""
    return [0.1 * math.cos(TILT) - 0.4 * math.sin(TILT), 0.1 * math.sin(TILT) + 0.4 * math.cos(TILT)]


def siconos_bodies(case: str) -> list[Any]:
    """The bodies of a case, each with a constant matrix of masses."""
    import numpy as np
    import siconos.kernel as sk

    def body(start: list[float], speed: list[float], mass: Any, force: list[float], stiffness: Any = None) -> Any:
        vectors, matrix = (np.array(start), np.array(speed)), np.array(mass)
        linear = [np.array(stiffness), np.zeros_like(matrix)] if stiffness is not None else []
        made = sk.LagrangianLinearTIDS(*vectors, matrix, *linear)
        made.setFExtPtr(np.array(force))
        return made

    if case == "ball":
        return [body([1.0], [0.0], np.eye(1), [-G])]
    if case == "block":
        return [body([0.0, 0.0], [3.0, 0.0], np.eye(2), [0.0, -G])]
    if case == "column":
        return [body([1.0 + 0.25 * i], [0.0], np.eye(1), [-G]) for i in range(BEADS)]
    if case == "cam":
        return [body([0.4], [0.4], [[1.221]], [0.0], [[1430.8]])]
    if case == "rocking":
        mass = np.diag([10.0, 10.0, 10 * (0.1**2 + 0.4**2) / 3])
        return [body([*rocking_centre(), TILT], [0.0] * 3, mass, [0.0, -10 * G, 0.0])]
    if case == "woodpecker":
        sleeve, bird = 0.0003, 0.0045
        along = np.array([1.0, 0.01, 0.015])
        mass = np.diag([sleeve, 5e-9, 7e-7]) + bird * np.outer(along, along)
        force = -G * (bird * along + [sleeve, 0.0, 0.0])
        spring = 0.0056 * np.array([[0.0, 0, 0], [0, 1, -1], [0, -1, 1]])
        return [body([0.0, -0.1034, -0.2788], [-0.3411, 0.0, -7.4583], mass, force, spring)]
    start = [1.570823772407980, 0.353284202062446, 1.264872058968431, 1.876454585097650, 1.690962091335582]
    start += [3.376468619708296, 1.190462183453451]
    linkage = sk.LagrangianDS(np.array(start), np.zeros(7), np.diag([1 / 3, 16 / 12, 6.25 / 12, 1.0, 1.0, 1.0, 1.0]))
    linkage.setComputeFIntFunction("./plugin.so", "weight")
    linkage.setComputeJacobianFIntqFunction("./plugin.so", "weight_slopes")
    return [linkage]


def siconos_contacts(case: str) -> list[tuple[Any, ...]]:
    """(coefficient of restitution, of friction, relation, numbers of the bodies) of each contact."""
    import numpy as np
    import siconos.kernel as sk

    def linear(rows: list[list[float]], *offset: float) -> Any:
        return sk.LagrangianLinearTIR(np.array(rows), np.array([*offset, *[0.0] * (len(rows) - 1)]))

    def curved(gap: str, slopes: str) -> Any:
        return sk.LagrangianScleronomousR(f"./plugin:{gap}", f"./plugin:{slopes}")

    if case == "ball":
        return [(0.9, None, linear([[1.0]], 0.0), 0)]
    if case == "block":
        return [(0.0, 0.3, linear([[0.0, 1.0], [1.0, 0.0]], 0.0), 0)]
    if case == "column":
        pairs = [(0.9, None, linear([[-1.0, 1.0]], -0.2), i, i + 1) for i in range(BEADS - 1)]
        return [(0.9, None, linear([[1.0]], -0.1), 0), *pairs]
    if case == "cam":
        return [(0.8, None, sk.LagrangianRheonomousR("./plugin:hcam", "./plugin:Gcam", "./plugin:Tcam"), 0)]
    if case == "rocking":
        return [(0.0, 0.8, curved("hA", "GA"), 0), (0.0, 0.8, curved("hB", "GB"), 0)]
    if case == "woodpecker":
        sleeve = [1.0, 0.0031, 0.0]
        beak = linear([[0.0, 0.0, -0.02], [1.0, 0.01, 0.015 - 0.0201]], 0.01 + 0.015 - 0.0201 - 0.0025)
        ends = [linear([[0.0, side * 0.0058, 0.0], sleeve], 0.0006) for side in (1, -1)]
        return [(0.5, 0.3, beak, 0), *((0.0, 0.3, end, 0) for end in ends)]
    return [(0.0, 0.1, curved(f"h{i}", f"G{i}"), 0) for i in (1, 2, 3)]


def siconos(case: str, h: float) -> Timed:
    """Moreau-Jean time stepping with exact laws of impact and friction."""
    import siconos.kernel as sk

    source = Path(__file__).with_name("contact_plugin.c").resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # Siconos looks for plugins there
        subprocess.run(["cc", "-std=c99", "-O2", "-fPIC", "-shared", "-o", "plugin.so", source, "-lm"], check=True)
        bodies, system = siconos_bodies(case), sk.NonSmoothDynamicalSystem(0.0, END[case])
        for body in bodies:
            system.insertDynamicalSystem(body)
        for restitution, friction, relation, *numbers in siconos_contacts(case):
            law = (
                sk.NewtonImpactNSL(restitution)
                if friction is None
                else sk.NewtonImpactFrictionNSL(restitution, 0.0, friction, 2)
            )
            system.link(sk.Interaction(law, relation), *(bodies[i] for i in numbers))
        solver = sk.LCP() if friction is None else sk.FrictionContact(2)
        run = sk.TimeStepping(system, sk.TimeDiscretisation(0.0, h), sk.MoreauJeanOSI(0.5), solver)

        def step() -> None:
            run.computeOneStep()
            run.nextStep()

        seconds = timed(step, round(END[case] / h))
        value = {"rocking": 2}.get(case, 0)
        return float(bodies[-1].q()[value]), seconds


def mujoco(case: str, h: float) -> Timed:
    """Its soft contacts as they are by default."""
    import mujoco as mj

    shape, turns = {
        "block": ('<geom type="sphere" size="0.1" mass="1" friction="0.3 0 0"/>', ""),
        "rocking": (
            '<geom type="box" size="0.1 0.1 0.4" mass="10" friction="0.8 0 0"/>',
            '<joint type="hinge" axis="0 -1 0"/>',
        ),
    }[case]
    model = mj.MjModel.from_xml_string(f"""<mujoco><option timestep="{h}" gravity="0 0 -{G}" cone="elliptic"/>
      <worldbody><geom type="plane" size="9 9 1" friction="0 0 0"/>
      <body pos="0 0 {0.1 if case == "block" else 0}"><joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 0 1"/>{turns}{shape}</body></worldbody></mujoco>""")
    data = mj.MjData(model)
    if case == "block":
        data.qvel[0] = 3.0
    else:
        data.qpos[:] = [*rocking_centre(), TILT]
    seconds = timed(lambda: mj.mj_step(model, data), round(END[case] / h))
    return float(data.qpos[0 if case == "block" else 2]), seconds


def drake(case: str, h: float) -> Timed:
    """Its discrete plant with point contact; edges of the rocking block are spheres of a micrometre."""
    import numpy as np
    from pydrake.all import (
        AddMultibodyPlantSceneGraph,
        CoulombFriction,
        DiagramBuilder,
        HalfSpace,
        PrismaticJoint,
        RevoluteJoint,
        RigidTransform,
        Simulator,
        SpatialInertia,
        Sphere,
        UnitInertia,
    )

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=h)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -G])
    small, rocks = SpatialInertia(0.0, np.zeros(3), UnitInertia(0, 0, 0)), case == "rocking"
    chain = [plant.world_body(), *(plant.AddRigidBody(name, small) for name in (("a", "b") if rocks else ("a",)))]
    inertia = UnitInertia.SolidBox(0.2, 0.2, 0.8) if rocks else UnitInertia.SolidSphere(0.1)
    block = plant.AddRigidBody("block", SpatialInertia(10.0 if rocks else 1.0, np.zeros(3), inertia))
    frames = [body.body_frame() for body in (*chain, block)]
    along = plant.AddJoint(PrismaticJoint("x", *frames[:2], [1, 0, 0]))
    up = plant.AddJoint(PrismaticJoint("z", *frames[1:3], [0, 0, 1]))
    turn = plant.AddJoint(RevoluteJoint("turn", *frames[2:], [0, -1, 0])) if rocks else None
    friction = CoulombFriction(0.8, 0.8) if rocks else CoulombFriction(0.3, 0.3)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", friction)
    radius, places = (1e-6, [[-0.1, 0, -0.4], [0.1, 0, -0.4]]) if rocks else (0.1, [[0.0, 0, 0]])
    for i, place in enumerate(places):
        at = RigidTransform(np.array(place))
        plant.RegisterCollisionGeometry(block, at, Sphere(radius), f"ball{i}", friction)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    if turn is None:
        up.set_translation(context, radius)
        along.set_translation_rate(context, 3.0)
    else:
        x, z = rocking_centre()
        along.set_translation(context, x)
        up.set_translation(context, z + radius)
        turn.set_angle(context, TILT)
    simulator.Initialize()
    seconds = timed(lambda: simulator.AdvanceTo(END[case]), 1)
    return float(along.get_translation(context) if turn is None else turn.get_angle(context)), seconds


def exudyn(case: str, h: float) -> Timed:
    """A mass point with its friction of a given force, regularised by a bristle; no law of impacts."""
    import exudyn as exu
    from exudyn.utilities import (
        CoordinateSpringDamperExt,
        MarkerNodeCoordinate,
        MassPoint,
        NodeGenericData,
        NodePoint,
        NodePointGround,
    )

    container = exu.SystemContainer()
    system = container.AddSystem()
    ground = system.AddNode(NodePointGround())
    node = system.AddNode(NodePoint(initialVelocities=[3.0, 0.0, 0.0]))
    system.AddObject(MassPoint(physicsMass=1.0, nodeNumber=node))
    markers = [system.AddMarker(MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (ground, node)]
    bristle = system.AddNode(NodeGenericData(initialCoordinates=[0, 0, 0], numberOfDataCoordinates=3))
    system.AddObject(
        CoordinateSpringDamperExt(
            markerNumbers=markers, nodeNumber=bristle, fDynamicFriction=0.3 * G, frictionProportionalZone=1e-3
        )
    )
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = END[case]
    settings.timeIntegration.numberOfSteps = round(END[case] / h)
    settings.solutionSettings.writeSolutionToFile = False
    settings.timeIntegration.verboseMode = 0
    seconds = timed(lambda: system.SolveDynamic(settings), 1)
    return float(system.GetNodeOutput(node, exu.OutputVariableType.Position)[0]), seconds


TOOLS: dict[str, Callable[[str, float], Timed]] = {
    "siconos": siconos,
    "mujoco": mujoco,
    "drake": drake,
    "exudyn": exudyn,
}

if __name__ == "__main__":
    tool, case, step = sys.argv[1:]
    if case in CANNOT[tool]:
        raise SystemExit(CANNOT[tool][case])
    value, spent = TOOLS[tool](case, float(step))
    print(f"{value!r} {spent!r}")
