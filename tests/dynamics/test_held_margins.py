"""Kinks of what other kinks hold at 0: where a switch tells no sign."""

from collections.abc import Callable

import pytest

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu

SAME = {
    "if(max(0, 0.3 - x) > 0, 900*(0.3 - x) - 5*x_dot, 0)": "if(0.3 - x > 0, 900*(0.3 - x) - 5*x_dot, 0)",
    "40*sign(max(0, 0.3 - x))": "if(x < 0.3, 40, 0)",
    "-13*sign(max(x - 0.5, 0) + min(x + 0.5, 0))": "-13*if(x > 0.5, 1, if(x < -0.5, -1, 0))",
    "if(abs(x) > x, 30, 0)": "if(x < 0, 30, 0)",
    "if(sqrt(max(0.3 - x, 0)) > 0, 40, 0)": "if(x < 0.3, 40, 0)",
    "20*heaviside(max(0.3, x) - 0.3)": "if(x > 0.3, 20, 10)",
}
"""{a force in N: the same force, whose conditions are 0 at single times only}."""


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
@pytest.mark.parametrize(("force", "same"), SAME.items())
def test_what_is_held_at_zero_is_neither_positive_nor_negative(
    force: str, same: str, solver: str, exported: Callable[..., Fmu]
) -> None:
    """A mass falls onto it and is thrown back, so that it is held and let go."""
    found = []
    for number, text in enumerate((force, same)):
        mechanism = (
            f'[mechanism]\nname = "held{number}"\n[coordinates]\nx = {{ unit = "m", start = 1 }}\n'
            f'[bodies.b]\nmass = 1\nposition = ["x", 0]\n[forces]\nx = "{text} - 9.81"\n'
        )
        fmu = exported(read(mechanism, "held.toml"), solver=solver)
        found.append(simulate(fmu, stop_time=1.5, step=0.01, tolerance=1e-8, outputs=["x"])["x"])
    assert found[0] == pytest.approx(found[1], abs=1e-6)


@pytest.mark.parametrize("catches", ["max(0, x - 0.5)", "max(x, 0.5) - 0.5", "max(0, t - 0.5)"])
def test_a_latch_does_not_hold_while_its_condition_is_held_at_zero(catches: str, exported: Callable[..., Fmu]) -> None:
    """Two equal masses move freely until x is 0.5 at 0.5 s, and then both at 1.5 m/s."""
    masses = "".join(f'[bodies.{x}]\nmass = 1\nposition = ["{x}", 0]\n' for x in "xy")
    text = (
        '[mechanism]\nname = "caught"\n[coordinates]\nx = { unit = "m", velocity = 1 }\n'
        f'y = {{ unit = "m", velocity = 2 }}\n{masses}[constraints.holonomic]\n'
        f'latch = {{ expression = "x - y", while = "{catches}" }}\n'
    )
    run = simulate(exported(read(text, "caught.toml")), stop_time=1.0, step=0.25, outputs=["x"])
    assert run["x"] == pytest.approx([0, 0.25, 0.5, 0.875, 1.25], abs=1e-9)
