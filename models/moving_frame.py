r"""Moving frame: a free particle seen from a frame of reference that moves uniformly.

::

      y'|   o m           x, y    coordinates in the moving frame
        |                 V       velocity of the frame along x, constant
        +------ x'  --> V m       mass

The Lagrangian m (v + V)^2/2 differs from m v^2/2 by a total derivative of time: the motion is the same straight line.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, sections 3 and 4.
"""

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, coordinate, parameter


def moving_frame() -> Mechanism:
    """The mechanism with the coordinates x and y in the moving frame."""
    m = parameter("m", 1.0, "kg", "mass")
    V = parameter("V", 3.0, "m/s", "velocity of the frame")
    x = coordinate("x", "m", velocity=0.5, doc="position in the moving frame")
    y = coordinate("y", "m", start=1.0, velocity=-0.25, doc="position in the moving frame")

    return Mechanism(
        "moving_frame",
        title="Free particle in a moving frame",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, sections 3 and 4",
        coordinates=[x, y],
        parameters=[m, V],
        bodies=[Body("particle", m, (x + V * t, y))],
        strict_units=True,
    )
