r"""Slider-crank: a crank drives a slider through a connecting rod, all of them rigid.

::

               A                     a, b       angles of the crank and of the rod from the x axis
             / ' - .  l2             x          position of the slider
         l1 /         ' - .          l1, l2     lengths of crank and rod
           / a           b  ' -.     m1 ... m3  masses of crank, rod and slider
          O - - - - - - - - - -[B]   J1, J2     moments of inertia of crank about O, of rod about A
          |--------- x --------->|

Crank and rod have their mass centres in their middle; the plane is horizontal. Without Q_a nothing but the inertia of
rod and slider makes the speed of the crank vary; the multiplier of a loop is the force of the rod on the slider.

Source: W. M. Lioen, J. J. B. de Swart, Test Set for Initial Value Problem Solvers, CWI, slider crank (B. Simeon), with
a rigid rod; there the crank turns at 150 rad/s.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Body, Constraint, Experiment, Mechanism, Output, coordinate, parameter


def slider_crank() -> Mechanism:
    """The mechanism with a, b and x as coordinates; two constraints close the loop."""
    l1, l2 = parameter("l1", 0.15, "m", "length of the crank"), parameter("l2", 0.3, "m", "length of the rod")
    m1 = parameter("m1", 0.36, "kg", "mass of the crank")
    m2 = parameter("m2", 0.151104, "kg", "mass of the rod")
    m3 = parameter("m3", 0.075552, "kg", "mass of the slider")
    J1 = parameter("J1", 0.002727, "kg.m2", "moment of inertia of the crank about O")
    J2 = parameter("J2", 0.0045339259, "kg.m2", "moment of inertia of the rod about A")
    a = coordinate("a", "rad", start=0.0, velocity=150.0, doc="angle of the crank")
    b = coordinate("b", "rad", guess=0.0, doc="angle of the rod")
    x = coordinate("x", "m", guess=0.45, doc="position of the slider")

    x_A, y_A = l1 * cos(a), l1 * sin(a)
    x_B, y_B = x_A + l2 * cos(b), y_A + l2 * sin(b)

    return Mechanism(
        "slider_crank",
        title="Slider-crank",
        source="Test Set for Initial Value Problem Solvers, CWI, slider crank (B. Simeon), rigid",
        coordinates=[a, b, x],
        parameters=[l1, l2, m1, m2, m3, J1, J2],
        bodies=[
            Body("crank", m1, (x_A / 2, y_A / 2), angle=a, inertia=J1 - m1 * l1**2 / 4),
            Body("rod", m2, ((x_A + x_B) / 2, (y_A + y_B) / 2), angle=b, inertia=J2 - m2 * l2**2 / 4),
            Body("slider", m3, (x, 0)),
        ],
        constraints=[Constraint("loop_x", x_B - x), Constraint("loop_y", y_B)],
        outputs=[Output("push", -symbol("multiplier_loop_x"), "N", "force of the rod on the slider, along x")],
        experiment=Experiment(stop_time=0.2, step=0.0005),
        strict_units=True,
    )
