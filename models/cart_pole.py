r"""Cart with a pole: a rigid pole hinged to a cart that an external force pushes along a rail.

::

              +-----+
       F ---> |  M  |---> x      M   mass of the cart,  m   mass of the pole
    ==========+--O--+=======     l   length of the pole (uniform: inertia m l^2/12 about its centre)
                 |\              theta   angle of the pole from the downward vertical; theta = pi is upright
             theta \ m, l        c, d   damping of the cart on the rail and in the hinge O
                 |   \           F   force on the cart, an input of the FMU

Source: R. Tedrake, Underactuated Robotics, chapter 3 (cart-pole), here with a rigid pole and damping.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Damper, Load, Mechanism, Output, coordinate, parameter, signal


def cart_pole() -> Mechanism:
    """The mechanism with x (cart) and theta (pole) as generalized coordinates."""
    M, m = parameter("M", 1.0, "kg", "mass of the cart"), parameter("m", 0.3, "kg", "mass of the pole")
    l = parameter("l", 1.0, "m", "length of the pole")  # noqa: E741
    I0 = parameter("I0", m * l**2 / 12, "kg.m2", "inertia of the pole about its centre")
    c = parameter("c", 0.1, "N.s/m", "damping of the cart on the rail")
    d = parameter("d", 0.002, "N.m.s/rad", "damping in the hinge")
    g = parameter("g", 9.81, "m/s2", "gravity")
    F = signal("F", "N", doc="force on the cart along x")
    x = coordinate("x", "m", doc="position of the cart along the rail")
    theta = coordinate("theta", "rad", start=0.5, doc="angle of the pole from the downward vertical")

    cart = Body("cart", M, (x, 0))
    pole = Body("pole", m, (x + l / 2 * sin(theta), -l / 2 * cos(theta)), angle=theta, inertia=I0)
    x_tip, y_tip = x + l * sin(theta), -l * cos(theta)

    return Mechanism(
        "cart_pole",
        title="Cart with a pole",
        source="R. Tedrake, Underactuated Robotics, chapter 3 (cart-pole), with a rigid pole and damping",
        coordinates=[x, theta],
        parameters=[M, m, l, I0, c, d, g],
        inputs=[F],
        bodies=[cart, pole],
        gravity=g,
        dampers=[Damper("rail", c, rate=x.dot), Damper("hinge", d, rate=theta.dot)],
        loads=[Load("push", body="cart", force=(F, 0))],
        outputs=[Output("x_tip", x_tip, "m", "tip, horizontal"), Output("y_tip", y_tip, "m", "tip, vertical")],
        strict_units=True,
    )
