"""A load on a trolley that a force drives, as SymPy's mechanics has it."""

import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, Point, ReferenceFrame, dynamicsymbols

x, theta, F = dynamicsymbols("x theta F")
M, m, l, g, c = sp.symbols("M m l g c")  # noqa: E741
N = ReferenceFrame("N")
trolley, load = Point("trolley"), Point("load")
trolley.set_vel(N, x.diff() * N.x)
load.set_vel(N, (x.diff() + l * theta.diff() * sp.cos(theta)) * N.x + l * theta.diff() * sp.sin(theta) * N.y)
energies = [mass * point.vel(N).dot(point.vel(N)) / 2 for mass, point in ((M, trolley), (m, load))]
method = LagrangesMethod(
    sum(energies) + m * g * l * sp.cos(theta), [x, theta], forcelist=[(trolley, (F - c * x.diff()) * N.x)], frame=N
)
