"""A mechanism that uses every concept of the text format."""

from __future__ import annotations

from sympy import Rational, cos, sin

from lag2fmu.language.expressions import TIME, symbol
from lag2fmu.mechanism import (
    Body,
    Damper,
    Definition,
    Energy,
    Experiment,
    Gravity,
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


def everything() -> Mechanism:
    """A mechanism that uses every concept, with texts that need escapes."""
    doc = 'a "quoted" \\ back\nline\tü\x7f\x01'
    x = coordinate("x", "mm", start=3.3, velocity=-70.1, nominal=5.0, minimum=-9.9, doc=doc)
    phi = coordinate("phi", "deg", start=10.0, maximum=720.1)
    m, k, d = parameter("m", 0.1, "kg"), parameter("k", 1.7, "N/mm", "stiff", minimum=0.1), parameter("d", 1.0)
    I0, w, T0 = parameter("I0", m * symbol("k") / 3), parameter("w", 33.3, "rpm"), parameter("T0", -40.3, "degC")
    F, y0, e0 = signal("F", "kN", start=0.07), signal("y0", "cm", motion=True, start=1.1), symbol("e0")
    z0 = signal("z0", "mm", motion="filtered", time_constant=w / 1000, start=7.7, doc="slow")
    A, rod, bead = (
        Point("A", (0, y0)),
        Body("rod", m, (x, y0), angle=phi, inertia=I0),
        Body("bead", 2, (x + cos(phi), 0.05)),
    )
    return Mechanism(
        "everything",
        title="All of it",
        source="this test",
        coordinates=[x, phi],
        parameters=[m, k, d, I0, w, T0],
        inputs=[F, y0, z0],
        definitions=[Definition("e0", x / 3 + sin(w * TIME)), Definition("v0", symbol("e0") * x.dot)],
        energy=Energy(kinetic=m * phi.dot**2 / 7, potential=k * e0**2, dissipation=0.013 * x.dot**2),
        forces={x: F - y0.ddot, phi: 0.1 * phi.dot},
        gravity=Gravity(9.81, (Rational(3, 5), Rational(-4, 5))),
        bodies=[rod, bead],
        points=[A],
        springs=[Spring("one", k, elongation=x - e0 + z0), Spring("two", 3, between=(A, rod), length=0.1)],
        dampers=[Damper("one", d, rate=x.dot), Damper("two", 3, between=("bead", "rod"))],
        loads=[
            Load("push", point=A, input=True),
            Load("turn", body=rod, input=True),
            Load("pull", point=rod, force=(F, 0)),
        ],
        ports=Ports(["F", "Q_x", "push"], forces=[bead], torques=[rod], poses=[A, rod], velocities=[rod], drives=[z0]),
        outputs=[Output("o", e0, "m", "an output"), Output("e0", e0)],
        experiment=Experiment(2.5, 0.02, 1e-9),
    )
