"""Spatial mechanisms with known equations, and one that uses everything at once."""

from sympy import Rational, Symbol, cos, sin, sqrt

from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import (
    Body,
    Damper,
    Definition,
    Frame,
    Load,
    Mechanism,
    Output,
    Point,
    Ports,
    Spring,
    coordinate,
    parameter,
    signal,
)

TENSOR = (0.3, 0.5, 0.6, 0.02, -0.03, 0.04)


def euler_frame() -> tuple[list, Frame]:
    """A frame that is turned by the angles phi, theta, psi about z, x, z, and these coordinates."""
    angles = [coordinate(name, "rad", start=0.4) for name in ("phi", "theta", "psi")]
    return angles, Frame("body", rotations=list(zip("zxz", angles, strict=True)))


def free_symmetric_body(A: float, C: float) -> Mechanism:
    """A symmetric body on its mass centre, no torques."""
    angles, frame = euler_frame()
    return Mechanism(
        "free_symmetric_body",
        coordinates=angles,
        frames=[frame],
        bodies=[Body("body", 1, frame=frame, inertia=(A, A, C, 0, 0, 0))],
        outputs=[
            Output("omega", frame=frame, quantity="angular_velocity"),
            Output("w", frame=frame, quantity="angular_velocity", axes="frame"),
            Output("R", frame=frame, quantity="rotation"),
            Output("e", frame=frame, quantity="quaternion"),
            Output("a", frame=frame, quantity="angles"),
        ],
    )


def double_joint() -> Mechanism:
    """A body with a full tensor on a vertical joint q1 and a horizontal one q2; a load on each joint."""
    q1, q2 = coordinate("q1", "rad", start=0.3), coordinate("q2", "rad", start=0.5)
    column = Frame("column", rotations=[("z", q1)])
    arm = Frame("arm", column, rotations=[("y", q2)])
    return Mechanism(
        "double_joint",
        coordinates=[q1, q2],
        frames=[arm, column],
        bodies=[Body("arm", 2, frame=arm, center=(Rational(7, 10), 0, 0), inertia=TENSOR)],
        gravity=9.81,
        loads=[Load("tau", body="arm", input=True, axes="frame")],
    )


def carousel(framed: bool) -> Mechanism:
    """A bead on a spoke of a driven, tilted carousel with springs, a damper and a force; on frames or written out.

    World axes: r = Rz(w t + y) Rx(1/2) (s, 0, u) + (0, 0, h); spring and damper from the bead to a hook.
    """
    s, u = coordinate("s", "m", start=0.5), coordinate("u", "m", start=0.3)
    w, k = parameter("w", 0.7, "rad/s"), parameter("k", 30.0, "N/m")
    y, F = signal("y", "rad", motion=True), signal("F", "N")
    turn = Definition("turn", w * TIME + y)
    a, h = Symbol("turn", real=True), sin(TIME) / 3
    hook = Point("hook", (1, 2, 3))
    tables: dict = {}
    c, sn = cos(Rational(1, 2)), sin(Rational(1, 2))
    force = (F, 0, 1 + s)
    if framed:
        plate = Frame("plate", origin=(0, 0, h), rotations=[((0, 0, 2), a), ((1, 0, 0), Rational(1, 2))])
        tables["frames"] = [plate]
        bead, load = Body("bead", 3, frame=plate, center=(s, 0, u)), Load("f", "bead", force=force, axes="frame")
    else:
        place = lambda x, y, z: (  # noqa: E731
            cos(a) * x - sin(a) * (c * y - sn * z),
            sin(a) * x + cos(a) * (c * y - sn * z),
            sn * y + c * z,
        )
        x, y_, z = place(s, 0, u)
        bead, load = Body("bead", 3, (x, y_, z + h)), Load("f", "bead", force=place(*force))
    return Mechanism(
        "carousel",
        coordinates=[s, u],
        parameters=[w, k],
        inputs=[y, F],
        definitions=[turn],
        gravity=9.81,
        bodies=[bead],
        points=[hook],
        springs=[Spring("k", k, between=("bead", hook), length=1), Spring("free", 2, between=(hook, "bead"))],
        dampers=[Damper("c", 0.4, between=("bead", "hook"))],
        loads=[load],
        outputs=[Output("r", point="bead", quantity="position"), Output("v", point="bead", quantity="velocity")],
        **tables,
    )


_ALL = ("arm", "fan", "ball", "bead", "stone")


def everything_spatial() -> Mechanism:
    """Trees, axes of all kinds, a moving quaternion, full tensors, springs, dampers and loads between frames."""
    q = [coordinate(f"q{i}", "rad", start=0.1 * i) for i in range(3)]
    y, F = signal("y", "rad", motion=True, start=0.2), signal("F", "N")
    half = (TIME / 3 + y) / 2
    base = Frame("base", origin=(0, y, sin(TIME)), quaternion=(cos(half), 0, sin(half), 0))
    left = Frame("left", base, (0.1, 0.2, q[1] / 5), [((1, -2, 2), q[0]), ("x", 0.3)])
    right = Frame("right", "base", (0.5, 0, 0), [("y", q[1]), ("z", q[2])])
    hand = Frame("hand", left, (0, 0, 0.4), [((0, 3, 4), q[2] - q[0])])
    tip, hook = Point("tip", (0.1, 0.2, 0.3 + q[0] ** 2), hand), Point("hook", (0, 1, 2))
    return Mechanism(
        "everything_spatial",
        coordinates=q,
        inputs=[y, F],
        frames=[hand, left, right, base],
        bodies=[
            Body("arm", 2, frame=left, center=(0.1, 0, 0.2), inertia=TENSOR),
            Body("fan", 1, frame=right, center=(0, 0.3, 0), inertia=(0.1, 0.1, 0.15, 0, 0, 0)),
            Body("ball", 0.5, frame=hand, center=(0, 0, 0.1)),
            Body("bead", 0.2, (q[0], 0, sqrt(1 + q[1] ** 2))),
            Body("stone", 1, frame="world", center=(q[2], 0, 0), inertia=TENSOR),
        ],
        points=[tip, hook],
        gravity=9.81,
        springs=[Spring("a", 20, between=(tip, "fan"), length=0.3), Spring("b", 9, between=(hook, "arm"))],
        dampers=[Damper("a", 0.7, between=("tip", "hook")), Damper("joint", 0.1, rate=q[0].dot)],
        loads=[
            Load("push", tip, force=(F, 1, q[0].dot)),
            Load("pull", tip, force=(0, F * y.ddot, 2), axes="frame"),
            Load("twist", body="fan", torque=(F, TIME, 3), axes="frame"),
            Load("turn", body="arm", input=True),
            Load("kick", point="bead", input=True),
        ],
        outputs=[
            *(
                Output(f"{k}_{f}", frame=f, quantity=k)
                for f in ("hand", "right")
                for k in ("rotation", "quaternion", "y_axis")
            ),
            *(Output(f"w_{f}", frame=f, quantity="angular_velocity") for f in ("hand", "right")),
            *(Output(f"v_{f}", frame=f, quantity="origin_velocity", axes="frame") for f in ("hand", "right")),
            *(Output(f"a_{x}", frame="hand", quantity="specific_force", axes=x) for x in ("frame", "world")),
            *(Output(k, bodies=_ALL, quantity=k) for k in ("mass_centre", "mass_centre_velocity", "angular_momentum")),
            *(Output(k, bodies=_ALL, frame="hand", quantity=k) for k in ("holding_force", "holding_torque")),
            Output("held", bodies=["fan", "bead"], frame="right", quantity="holding_torque", axes="frame"),
            Output("tip", point="tip", quantity="position"),
            Output("tip_v", point="tip", quantity="velocity"),
            Output("bead", point="bead", quantity="velocity"),
            Output("F2", F * 2, "N"),
        ],
        ports=Ports(
            inputs="none",
            forces={"tip": "world", "hand": "frame", "frames.right": "frame"},
            torques={"hand": "frame", "left": "world", "fan": "frame"},
            poses=["tip", "hook"],
            velocities=["hand"],
            accelerations=["frames.right", "tip"],
            rotation="angles",
        ),
    )
