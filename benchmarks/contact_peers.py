"""A case of `benchmarks.nonsmooth` by another tool: ``python contact_peers.py TOOL CASE STEP`` prints value, CPU s.

Run by an interpreter that has the tool, so nothing of this project is imported. The ball falls from 1 m, loses a tenth
of its velocity in each impact, and is asked for its height at 3 s; the block of 1 kg starts with 3 m/s on a plane with
friction 0.3, and is asked for its place at 2 s. Steps in s.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

END = {"ball": 3.0, "block": 2.0}
G = 9.81


def timed(step: Callable[[], object], count: int) -> float:
    """CPU time (s) of so many calls."""
    begun = time.process_time()
    for _ in range(count):
        step()
    return time.process_time() - begun


def siconos(case: str, h: float) -> tuple[float, float]:
    """Moreau-Jean time stepping with exact laws of impact and friction."""
    import numpy as np
    import siconos.kernel as sk

    start, speed, force = (
        (np.array([1.0]), np.array([0.0]), np.array([-G]))
        if case == "ball"
        else (np.zeros(2), np.array([3.0, 0.0]), np.array([0.0, -G]))
    )
    body = sk.LagrangianLinearTIDS(start, speed, np.eye(len(start)))
    body.setFExtPtr(force)
    law, slopes, solver = (
        (sk.NewtonImpactNSL(0.9), np.array([[1.0]]), sk.LCP())
        if case == "ball"
        else (sk.NewtonImpactFrictionNSL(0.0, 0.0, 0.3, 2), np.array([[0.0, 1.0], [1.0, 0.0]]), sk.FrictionContact(2))
    )
    touch = sk.Interaction(law, sk.LagrangianLinearTIR(slopes))
    system = sk.NonSmoothDynamicalSystem(0.0, END[case])
    system.insertDynamicalSystem(body)
    system.link(touch, body)
    run = sk.TimeStepping(system, sk.TimeDiscretisation(0.0, h), sk.MoreauJeanOSI(0.5), solver)

    def step() -> None:
        run.computeOneStep()
        run.nextStep()

    seconds = timed(step, round(END[case] / h))
    return float(body.q()[0]), seconds


def mujoco(case: str, h: float) -> tuple[float, float]:
    """Its soft contacts as they are by default; it has no coefficient of restitution."""
    import mujoco as mj

    if case == "ball":
        raise SystemExit("no coefficient of restitution")
    model = mj.MjModel.from_xml_string(f"""<mujoco><option timestep="{h}" gravity="0 0 -{G}" cone="elliptic"/>
      <worldbody><geom type="plane" size="9 9 1" friction="0.3 0 0"/>
      <body pos="0 0 0.1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <geom type="sphere" size="0.1" mass="1" friction="0.3 0 0"/></body></worldbody></mujoco>""")
    data = mj.MjData(model)
    data.qvel[0] = 3.0
    seconds = timed(lambda: mj.mj_step(model, data), round(END[case] / h))
    return float(data.qpos[0]), seconds


def drake(case: str, h: float) -> tuple[float, float]:
    """Its discrete plant with point contact; it has dissipation, but no coefficient of restitution."""
    import numpy as np
    from pydrake.all import (
        AddMultibodyPlantSceneGraph,
        CoulombFriction,
        DiagramBuilder,
        HalfSpace,
        PrismaticJoint,
        RigidTransform,
        Simulator,
        SpatialInertia,
        Sphere,
        UnitInertia,
    )

    if case == "ball":
        raise SystemExit("no coefficient of restitution")
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=h)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -G])
    small = SpatialInertia(0.0, np.zeros(3), UnitInertia(0, 0, 0))
    carrier = plant.AddRigidBody("carrier", small)
    block = plant.AddRigidBody("block", SpatialInertia(1.0, np.zeros(3), UnitInertia.SolidSphere(0.1)))
    along = plant.AddJoint(PrismaticJoint("x", plant.world_frame(), carrier.body_frame(), [1, 0, 0]))
    up = plant.AddJoint(PrismaticJoint("z", carrier.body_frame(), block.body_frame(), [0, 0, 1]))
    friction = CoulombFriction(0.3, 0.3)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", friction)
    plant.RegisterCollisionGeometry(block, RigidTransform(), Sphere(0.1), "ball", friction)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    up.set_translation(context, 0.1)
    along.set_translation_rate(context, 3.0)
    simulator.Initialize()
    seconds = timed(lambda: simulator.AdvanceTo(END[case]), 1)
    return float(along.get_translation(context)), seconds


def exudyn(case: str, h: float) -> tuple[float, float]:
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

    if case == "ball":
        raise SystemExit("no coefficient of restitution")
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


TOOLS = {"siconos": siconos, "mujoco": mujoco, "drake": drake, "exudyn": exudyn}

if __name__ == "__main__":
    value, spent = TOOLS[sys.argv[1]](sys.argv[2], float(sys.argv[3]))
    print(f"{value!r} {spent!r}")
