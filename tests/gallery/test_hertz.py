"""Contacts by broken powers, whose slopes are 0 where they let go: as potentials, as forces, and as drag."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lag2fmu
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

TEXT = """
[mechanism]
name = "hertz"
[coordinates]
x = { unit = "m", start = 0.0 }
y = { unit = "m", start = 0.01 }
z = { unit = "m", start = 0.0, velocity = 0.0 }
[energy]
kinetic = "(x_dot**2 + y_dot**2 + z_dot**2)/2"
potential = "9.81*x + 4e4*max(0, -x)**(5/2) + 9.81*y + abs(z)**(3/2)"
[forces]
y = "1e5*max(0, -y)**(3/2)"
z = "sin(t) - 3*abs(z_dot)**(3/2)*sign(z_dot)"
"""


def rates(t: float, s: np.ndarray) -> list[float]:
    x, y, z, *speeds = s
    bend = -1.5 * abs(z) ** 0.5 * np.sign(z) - 3 * abs(speeds[2]) ** 1.5 * np.sign(speeds[2])
    return [*speeds, *(1e5 * max(0.0, -a) ** 1.5 - 9.81 for a in (x, y)), np.sin(t) + bend]


def test_contacts_and_drag_start_at_zero_with_an_implicit_solver(exported) -> None:
    """Radau5's Jacobian is finite at x = z_dot = 0 and while y is above the ground; against SciPy, by hand."""
    times = np.linspace(0.0, 0.3, 31)
    found = solve_ivp(rates, (0, 0.3), [0, 0.01, 0, 0, 0, 0], t_eval=times, rtol=1e-10, atol=1e-12, max_step=1e-3)
    fmu = exported(read(TEXT, "hertz.toml"), solver="radau5", outputs=("all",))
    run = lag2fmu.simulate(fmu, stop_time=0.3, step=0.01, tolerance=1e-8)
    for name, expected in zip("xyz", found.y, strict=False):
        assert np.abs(run[name] - expected).max() < 1e-7, name
