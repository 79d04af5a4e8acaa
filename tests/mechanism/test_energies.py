"""Energies that jump are refused with a remedy; kinks of equal values on both sides are allowed."""

from __future__ import annotations

import random
import re

import pytest

from lag2fmu.errors import MechanismError
from lag2fmu.formats.text import read

CONTINUOUS = (
    "abs({s})",
    "max({s}, 0)**2",
    "min({s}, 0)*{s}",
    "{s}*sign({s})",
    "{s}**2*heaviside({s})",
    "if({s} > 0, 3*{s}**2/2, {s}**2)",
    "if({s} > 0, sin({s}), exp({s}) - 1)",
    "if({s} > 0, abs({s}) + c, c)",
    "if({s} > 0 and {s} > -1, {s}**3, 0)",
    "smooth(abs({s}))",
    "if({s}**2 + 1 > 0, 2, 3)",
    "if(c > 1, 2, 3)",
    "f({s}) + if({s} > 0, f({s}) - f(0), 0)",
    "{s}**2/abs({s})",
    "1/(2 + {s}**2)",
    "{s}*atan(c/{s})",
    "1/{s}",
    "log(abs({s}))",
)
JUMPING = (
    "if({s} > 0, 0.3, 0)",
    "sign({s})",
    "heaviside({s})",
    "if({s} > 0, {s}**2 + 1e-6, {s}**2)",
    "abs({s})*0 + if({s} < 0 or {s} > 1, c, 2*c)",
    "smooth(sign({s}))",
    "exp(sign({s}))",
    "if({s} > 0, f({s}), f({s}) + c)",
    "c*abs({s})/{s}",
    "{s}/sqrt({s}**2)",
    "atan(c/{s})",
    "tanh(1/{s})**3",
    "if(sin(50*{s}) > 0.995, c, 0)",
    "if({s} > 3000, c, 0)",
)
MOVING = ("x - {a}", "{a} - 2*x", "t - {b}", "sin(x) - {b}", "x*t - {b}", "x**3 - {a}", "shifted - {a}", "x - d")
"""What comes to 0 somewhere near the start; ``shifted`` is a definition, d a parameter."""


def text(potential: str = "0", mass: str = "2", more: str = "") -> str:
    return f"""
[mechanism]
name = "jumping"
[parameters]
c = {{ value = 0.7 }}
d = {{ value = 0.4 }}
[coordinates]
x = {{ start = 0.5 }}
[tables.f]
columns = [[-9, 0, 9], [0, 1, 0]]
[definitions]
shifted = "x + 0.3"
[bodies.block]
mass = "1"
position = ["x", "0"]
[energy]
potential = "x**2 + {potential}"
kinetic = "({mass})*x_dot**2/2"
{more}
"""


def cases(patterns: tuple[str, ...]) -> list[str]:
    """Each pattern with two random margins."""
    rng = random.Random(3)
    chosen = [(p, m) for p in patterns for m in rng.sample(MOVING, 2)]
    return [p.format(s=f"({m.format(a=rng.uniform(-2, 2), b=rng.uniform(0.2, 0.8))})") for p, m in chosen]


@pytest.mark.parametrize("kink", cases(CONTINUOUS))
def test_kinks_without_a_jump_are_allowed(kink: str) -> None:
    read(text(kink), "jumping.toml")
    read(text(mass=f"20 + {kink}"), "jumping.toml")


@pytest.mark.parametrize("jump", cases(JUMPING))
def test_jumps_are_refused(jump: str) -> None:
    with pytest.raises(
        MechanismError, match=r"energy\.potential: '.*' makes it jump by .* where .* = .*; model a wall as"
    ):
        read(text(jump), "jumping.toml")
    with pytest.raises(MechanismError, match=r"energy\.kinetic: '.*' makes it jump by"):
        read(text(mass=f"20 + {jump}"), "jumping.toml")


def test_what_is_named_is_where_it_jumps() -> None:
    with pytest.raises(
        MechanismError, match=r"'if\(-1 \+ x > 0, 0\.3, 0\)' makes it jump by 0\.3 \(SI\) where x = 1, "
    ):
        read(text("if(x > 1, 0.3, 0)"), "jumping.toml")


def test_places_and_springs() -> None:
    """A spring whose stiffness changes where it is not stretched has no jump of its energy."""
    good = '[springs.k]\nstiffness = "if(x > d, 30, 10)"\nelongation = "x - d"'
    read(text(more=good), "jumping.toml")
    with pytest.raises(MechanismError, match=r"springs\.k: .* makes it jump"):
        read(text(more=good.replace('"x - d"', '"x"')), "jumping.toml")
    moved = text().replace('["x", "0"]', '["x + heaviside(x - 1)", "0"]')
    with pytest.raises(MechanismError, match=r"bodies\.block\.position\[0\]: .* makes it jump"):
        read(moved, "jumping.toml")


@pytest.mark.parametrize("angle", ["atan2(sin(x), cos(x))", "atan2(x, d - 1)", "atan2(x*y, 0.2 - y**2)"])
def test_an_angle_that_jumps_by_a_whole_turn_is_told(angle: str) -> None:
    """A spring about an angle is allowed, and warned of if it is not as long on both sides of the cut."""
    more = "[coordinates.y]\nstart = 0.3"
    even = read(text(f"y**2 + d*{angle}**2 + cos({angle})", more=more), "turning.toml")
    odd = read(text(f"y**2 + d*({angle} - 0.2)**2", more=more), "turning.toml")
    assert even.warnings == ()
    (told,) = odd.warnings
    assert re.match(r"energy\.potential: jumps by 1\.0\d* \(SI\) where 'atan2\(.*passes from pi to -pi", told)


def test_a_gap_that_jumps_with_an_angle_is_told() -> None:
    """As the teeth of a ratchet; with a condition in its place the engine finds the jump."""
    angle, turning = (
        "atan2(sin(x), cos(x))",
        "if(sin(x) >= 0, pi/2 + atan2(-cos(x), sin(x)), -pi/2 + atan2(cos(x), -sin(x)))",
    )
    contact = (
        '[coordinates.y]\nstart = 3\n[bodies.pawl]\nmass = 1\nposition = [0, "y"]\n[contacts.tooth]\ngap = "y - d*{}/2"'
    )
    (told,) = read(text(more=contact.format(angle)), "turning.toml").warnings
    assert re.match(
        r"contacts\.tooth\.gap: jumps by .* passes from pi to -pi.* the contact does not see that jump", told
    )
    assert read(text(more=contact.format(turning)), "turning.toml").warnings == ()


def test_an_angle_that_stays_on_one_side_is_not_told() -> None:
    assert read(text("d*(atan2(x, 1 + x**2) - 0.2)**2 + atan2(sqrt(1 + x**2), x)"), "turning.toml").warnings == ()
    assert read(text("d*(atan2(x, 3) - 0.2)**2 + d*atan2(x, 2 + sqrt(2))"), "turning.toml").warnings == ()


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ('"max(x, 0)"', "'max(0, x)', as at x = 0,"),
        ('"smooth(min(x, 0.5))"', "'min(1/2, x)', as at x = 0.5,"),
        ('"if(x > 0, x**2, 3*x**2)"', ""),
        ('"abs(x)"', ""),
    ],
)
def test_a_corner_of_a_place_is_told_where_the_speed_jumps(place: str, told: str) -> None:
    """A block that runs into a ramp gains energy there; on two ramps of one slope its speed is that on the first."""
    warnings = read(text(mass="3").replace('["x", "0"]', f'["x", {place}]'), "ramp.toml").warnings
    assert len(warnings) == bool(told)
    assert all(w.startswith("bodies.block.position: the square of its rate jumps") and told in w for w in warnings)


def test_forces_may_jump() -> None:
    read(text(more='[forces]\nx = "if(x > 1, 1, 0) - sign(x_dot) + heaviside(t - 1)"'), "jumping.toml")
