r"""Planar humanoid: a person in a harness, seen from the side; a tree of 14 coordinates with four branches.

::

               ( ) head          x, z, trunk            position of the hip, angle of the trunk
         hook   | neck           neck                   angle of the head on the trunk
           \----+                shoulder, elbow        angles of upper arms and forearms, left _l and right _r
             /\ |  upper arm     hip, knee, ankle       angles of thighs, shanks and feet, _l and _r
      elbow <  \|  trunk         each from the segment that carries it, 0 upright with arms hanging down,
             \  + hip (x, z)     about -y: positive moves hanging parts forward, along x
               / \  thigh
         knee <   >              The harness is a spring from the shoulders to a hook above. Joints have passive
               \ /  shank        stiffness k and damping c times a factor of their size. Gravity g is along -z.
                - -  foot

Source: D. A. Winter, Biomechanics and Motor Control of Human Movement, 2nd edition, chapter 3 (masses, centres, radii
of gyration; lengths of R. Drillis and R. Contini); head and trunk turn as homogeneous bodies. Joints, harness: chosen.
"""

from lag2fmu.mechanism import Body, Damper, Experiment, Frame, Mechanism, Output, Point, Spring, coordinate, parameter

SEGMENTS = {  # name: carried by, at (length of the carrier), length / stature, mass / total, centre, gyration / length
    "head": ("trunk", 1, 0.182, 0.081, 0.5, 0.3, "neck", 0.4),
    "upper_arm": ("trunk", 1, 0.186, 0.028, 0.436, 0.322, "shoulder", 0.3),
    "forearm": ("upper_arm", 1, 0.254, 0.022, 0.682, 0.468, "elbow", 0.1),
    "thigh": ("trunk", 0, 0.245, 0.1, 0.433, 0.323, "hip", 1.0),
    "shank": ("thigh", 1, 0.246, 0.0465, 0.433, 0.302, "knee", 0.4),
    "foot": ("shank", 1, 0.152, 0.0145, 0.5, 0.475, "ankle", 0.1),
}  # last: the joint and the factor of its stiffness and damping
START = {"shoulder_l": 0.4, "shoulder_r": -0.3, "elbow_l": 0.3, "hip_l": 0.4, "hip_r": -0.2, "knee_l": -0.4}


def humanoid_planar() -> Mechanism:
    """The mechanism with 14 coordinates: x, z, trunk, neck and five joints on each side."""
    M, H = parameter("M", 75.0, "kg", "mass of the person"), parameter("H", 1.75, "m", "stature")
    k, c = parameter("k", 40.0, "N.m/rad", "stiffness of a joint"), parameter("c", 4.0, "N.m.s/rad", "and damping")
    K, D = parameter("K", 6000.0, "N/m", "stiffness of the harness"), parameter("D", 300.0, "N.s/m", "and damping")
    g = parameter("g", 9.81, "m/s2", "gravity")
    x, z = coordinate("x", "m", doc="hip, horizontal"), coordinate("z", "m", doc="hip, vertical")
    lean = coordinate("trunk", "rad", start=0.1, doc="angle of the trunk")
    rod = 0.083 * (0.288 * H) ** 2 * 0.497 * M
    frames = {"trunk": Frame("trunk", "world", (x, 0, z), [((0, -1, 0), lean)])}
    bodies = [Body("trunk", 0.497 * M, frame="trunk", center=(0, 0, 0.144 * H), inertia=(rod, rod, rod, 0, 0, 0))]
    joints, springs, dampers, ends = [], [], [], {"trunk": 0.288 * H}
    for segment, (carrier, at, length, share, centre, gyration, joint, size) in SEGMENTS.items():
        for side in ("",) if segment == "head" else ("_l", "_r"):
            parent, name, label = carrier if carrier in frames else carrier + side, segment + side, joint + side
            q = coordinate(label, "rad", start=START.get(label, 0.0), doc=f"angle of the {label} joint")
            ends[name] = length * H if segment == "head" else -length * H
            frames[name] = Frame(name, parent, (0, 0, at * ends[parent]), [((0, -1, 0), q)])
            I = (gyration * length * H) ** 2 * share * M  # noqa: E741
            bodies.append(
                Body(name, share * M, frame=name, center=(0, 0, centre * ends[name]), inertia=(I, I, I, 0, 0, 0))
            )
            springs.append(Spring(label, size * k, elongation=q))
            dampers.append(Damper(label, size * c, rate=q.dot))
            joints.append(q)

    return Mechanism(
        "humanoid_planar",
        title="Planar humanoid in a harness",
        source="D. A. Winter, Biomechanics and Motor Control of Human Movement, 2nd edition, chapter 3",
        coordinates=[x, z, lean, *joints],
        parameters=[M, H, k, c, K, D, g],
        frames=frames.values(),
        bodies=bodies,
        points=[Point("shoulders", (0, 0, ends["trunk"]), "trunk"), Point("hook", (0, 0, 0.688 * H))],
        springs=[*springs, Spring("harness", K, between=("shoulders", "hook"), length=0.3 * H)],
        dampers=[*dampers, Damper("harness", D, between=("shoulders", "hook"))],
        gravity=g,
        outputs=[Output("head", point="head", quantity="position", doc="centre of the head")],
        experiment=Experiment(stop_time=3.0),
        strict_units=True,
    )
