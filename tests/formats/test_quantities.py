"""Numbers of a text with their own units: "280 rpm" for a velocity in deg/s."""

from __future__ import annotations

import random

import pytest

from lag2fmu.errors import TextError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.unit_parser import parse_unit

TEXT = """
[mechanism]
name = "turning"
[parameters]
J = {{ value = {J}, unit = "kg.m2" }}
[coordinates]
a = {{ unit = "deg", start = {start}, velocity = {velocity}, nominal = {nominal} }}
[energy]
kinetic = "J*a_dot**2/2"
"""
PLAIN = {"J": 1.0, "start": 1.0, "velocity": 1.0, "nominal": 1.0}
UNITS = {
    "J": ("kg.m2", "kg.mm2", "g.m2"),
    "start": ("rad", "deg", "mrad"),
    "velocity": ("rpm", "rad/s", "deg/s"),
    "nominal": ("deg", "rad"),
}


@pytest.mark.parametrize("key", UNITS)
def test_a_number_may_have_its_own_unit(key: str) -> None:
    rng = random.Random(key)
    for unit in UNITS[key]:
        number = round(rng.uniform(0.1, 300), 3)
        quantity = f'"{number}{rng.choice(["", " "])}{unit}"'
        mechanism = read(TEXT.format(**PLAIN | {key: quantity}), "turning.toml")
        (a,), (J,) = mechanism.coordinates, mechanism.parameters
        found = {"J": J.value, "start": a.start, "velocity": a.velocity, "nominal": a.nominal}[key]
        assert found == pytest.approx(parse_unit(unit).to_si(number), rel=1e-15)
        assert read(write(mechanism), "again.toml") == mechanism


@pytest.mark.parametrize(
    ("key", "text", "message"),
    [
        ("velocity", "280 m/s", r"coordinates\.a\.velocity: 'm/s' is no unit of it, which is in rad/s"),
        ("velocity", "280 rpn", r"coordinates\.a\.velocity: .*rpn"),
        ("start", "3 rpm", r"coordinates\.a\.start: 'rpm' is no unit of it, which is in deg"),
        ("start", "fast", r"coordinates\.a\.start: expected a number, got the string 'fast'"),
        ("J", "1e999 kg.m2", r"parameters\.J\.value: .* outside of the range of floats"),
    ],
)
def test_what_is_no_quantity_is_named(key: str, text: str, message: str) -> None:
    with pytest.raises(TextError, match=message):
        read(TEXT.format(**PLAIN | {key: f'"{text}"'}), "turning.toml")
