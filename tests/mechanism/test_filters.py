"""Filtered motions: what they bring, what they may stand in, and what is refused."""

from __future__ import annotations

import re

import pytest

from lag2fmu.errors import LoadError, TextError
from lag2fmu.formats.loading import with_settings, with_values
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Mechanism, Part, Ports

HEAD = """
[mechanism]
name = "m"
[parameters]
tau = { value = 20, unit = "ms" }
[coordinates]
x = { unit = "m" }
[bodies.cart]
mass = 1
position = ["x", "y0"]
[inputs]
"""
FILTERED = 'y0 = { unit = "mm", start = 5, motion = "filtered", time_constant = "tau", min = -9 }\n'


def test_a_target_and_two_states() -> None:
    found = read(HEAD + FILTERED, "m.toml")
    (target,) = found.inputs
    assert (target.name, target.start, target.minimum, target.motion) == ("y0_target", 0.005, -0.009, False)
    y, v, u, T = map(symbol, ("y0", "y0_dot", "y0_target", "tau"))
    assert [(z.name, z.start, z.derivative) for z in found.states] == [
        ("y0", 0.005, v),
        ("y0_dot", 0.0, symbol("y0_ddot")),
    ]
    (filtering,) = found.definitions
    assert (filtering.name, filtering.expression) == ("y0_ddot", ((u - y) / T - 2 * v) / T)
    assert [z.unit.si_name for z in found.states] == ["m", "m/s"]
    assert found.driven == ("y0",)
    assert found.origins["states.y0_dot"] == "inputs.y0"
    assert found.warnings == ()
    assert read(write(found), "m.toml") == found


def test_it_may_stand_in_positions_energies_and_forces() -> None:
    text = '[energy]\nkinetic = "y0_dot*x_dot"\n[forces]\nx = "y0_ddot"\n[outputs]\na = { expression = "y0_ddot" }\n'
    assert read(HEAD + FILTERED + text, "m.toml").states[0].name == "y0"


def test_its_start_is_that_of_its_target() -> None:
    found = with_settings(read(HEAD + FILTERED, "m.toml"), {"y0": "7"})
    assert [found.inputs[0].start, found.states[0].start] == [0.007, 0.007]
    for name in ("y0_target", "y0_dot"):
        with pytest.raises(LoadError, match=f"'{name}' is no parameter"):
            with_values(found, {name: 1.0})


def test_parts_bring_them_under_new_names() -> None:
    part = read(HEAD + FILTERED + '[ports]\ndrives = ["y0"]\n', "m.toml")
    whole = Mechanism("w", parts=[Part("a", part, set={"y0": 0.003}), Part("b", part)], ports=Ports(["b_y0"]))
    assert whole.driven == ("a_y0", "b_y0")
    assert [(u.name, u.start) for u in whole.inputs] == [("a_y0_target", 0.003), ("b_y0_target", 0.005)]
    assert whole.hidden_inputs == {"Q_a_x", "Q_b_x", "a_y0_target"}
    assert whole.ports.drives == ("a_y0", "b_y0")


WRONG = {
    'y0 = { motion = "filtered" }': "m.toml: inputs.y0: 'time_constant' is missing; give it in s",
    "y0 = { motion = true, time_constant = 1 }": "inputs.y0: 'time_constant' goes with motion = 'filtered'",
    'y0 = { motion = "fast" }': "inputs.y0.motion: expected true, false or 'filtered', got the string 'fast'",
    'y0 = { motion = "filtered", time_constant = 0 }': "inputs.y0.time_constant: '0' is 0 s at the values given",
    'y0 = { motion = "filtered", time_constant = "-tau" }': "time_constant: '-tau' is -0.02 s at the values given",
    'y0 = { motion = "filtered", time_constant = "tai" }': "'tai' is no parameter, of which a time",
    'y0 = { motion = "filtered", time_constant = "x" }': "inputs.y0.time_constant: 'x' is no parameter",
    FILTERED + "y0_target = {}": "inputs.y0_target: the name 'y0_target' is already taken by inputs.y0_target",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_named_with_place_and_value(text: str) -> None:
    with pytest.raises(TextError, match=re.escape(WRONG[text])):
        read(HEAD + text + "\n", "m.toml")
