r"""n-fold pendulum: a planar chain of n point masses on massless rods; for n = 1 the mathematical pendulum.

::

      O-------- x         l1 ... ln   lengths of the rods
      |\                  m1 ... mn   masses of the bobs
      | \ l1              theta1 ... thetan   angles of the rods, from the downward vertical (absolute),
      theta1 o m1                             or from the rod above (relative)
             |\           g   gravity, along -y
        theta2 o m2 ...

The bobs are placed by sums or, with ``frames``, each on a frame that turns on the one above; the motion is the same.

Source: J. L. Lagrange, Mecanique analytique, part 2, section 6 (small oscillations of a thread with many bodies).
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Frame, Gravity, Mechanism, Output, coordinate, parameter


def n_pendulum(n: int = 3, relative: bool = False, frames: bool = False) -> Mechanism:
    """The chain of ``n`` links with the angles theta1 ... thetan, absolute or ``relative`` to the link above.

    Angles between ``frames`` are relative.
    """
    relative = relative or frames
    if not 1 <= n <= 200:
        raise ValueError(f"n = {n} links; give 1 to 200")
    links = range(1, n + 1)
    m = [parameter(f"m{i}", 1.0, "kg", f"mass of bob {i}") for i in links]
    l = [parameter(f"l{i}", 1.0, "m", f"length of rod {i}") for i in links]  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    starts = [0.3] + [0.0 if relative else 0.3] * (n - 1)
    docs = ["angle of rod 1 from the downward vertical"]
    docs += [f"angle of rod {i} from the {'rod above' if relative else 'downward vertical'}" for i in links[1:]]
    theta = [coordinate(f"theta{i + 1}", "rad", start=starts[i], doc=docs[i]) for i in range(n)]

    bodies, x, y, angle = [], 0, 0, 0
    rods = [Frame(f"rod{i + 1}", f"rod{i}", (0, -l[i - 1], 0), [("z", theta[i])]) for i in range(1, n)]
    rods = [Frame("rod1", rotations=[("z", theta[0])]), *rods]
    for i in range(n):
        angle = angle + theta[i] if relative else theta[i]
        x, y = x + l[i] * sin(angle), y - l[i] * cos(angle)
        on_frame = Body(f"bob{i + 1}", m[i], frame=rods[i], center=(0, -l[i], 0))
        bodies.append(on_frame if frames else Body(f"bob{i + 1}", m[i], (x, y)))

    return Mechanism(
        "n_pendulum",
        title=f"Pendulum of {n} links",
        source="J. L. Lagrange, Mecanique analytique, part 2, section 6",
        coordinates=theta,
        parameters=[*m, *l, g],
        frames=rods if frames else [],
        bodies=bodies,
        gravity=Gravity(g, (0, -1, 0)) if frames else g,
        outputs=[Output("x_tip", x, "m", "last bob, horizontal"), Output("y_tip", y, "m", "last bob, vertical")],
        strict_units=True,
    )
