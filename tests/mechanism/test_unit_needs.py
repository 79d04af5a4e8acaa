"""Under strict_units a quantity whose use has a dimension needs its unit, which is inferred and named."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from lag2fmu.description.description import Description
from lag2fmu.errors import TextError, UnitError
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.text import read
from lag2fmu.language.dimensions import ONE, describe, dimension
from lag2fmu.mechanism import complete

TEXT = """
[mechanism]
name = "bare"
strict_units = true
[parameters]
m = {{ value = 1.0, unit = "kg" }}
p = {{ value = 40 }}
[coordinates]
x = {{ unit = "m", start = 0.1 }}
[bodies.b]
mass = "m"
position = ["x", "0"]
{table}
"""

USES = {
    '[bodies.c]\nmass = "m"\nposition = ["p", "x"]': "m",
    '[forces]\nx = "p*(x - x*exp(-x_dot*t/x))"': "N/m",
    '[springs.s]\nstiffness = "p"\nelongation = "x"': "N/m",
    '[dampers.d]\ndamping = "2*p/3"\nrate = "x_dot"': "N.s/m",
    '[outputs]\ny = { expression = "sqrt(p*x)", unit = "m" }': "m",
    '[outputs]\ny = { expression = "max(x, p)", unit = "m" }': "m",
    '[outputs]\ny = { expression = "if(t > p, x, 0)", unit = "m" }': "s",
    '[outputs]\ny = { expression = "x_dot*sin(t*p)", unit = "m/s" }': "1/s",
    '[frictions.f]\non = "x_dot"\nforce = "p"': "N",
    '[states]\nz = { unit = "m", derivative = "(x - z)/p" }': "s",
    '[stops.end]\nof = "x"\nupper = "p"': "m",
    '[stops.end]\nof = "x - p"\nlower = 0': "m",
    '[contacts.floor]\ngap = "x - p"': "m",
    '[forces]\nx = "a*p*x"\n[parameters.a]\nvalue = 2\nunit = "N"': "1/m",
}


def faults(table: str) -> str:
    """The message for the mechanism with this ``table``; "" if it is taken."""
    try:
        read(TEXT.format(table=table), "bare.toml")
    except TextError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("table", "unit"), [case for case in USES.items() if case[1]])
def test_the_parameter_and_its_unit_are_named(table: str, unit: str) -> None:
    message = faults(table)
    assert "parameters.p: 40 has no unit, and " in message
    assert f'give unit = "{unit}", or the unit that 40 is in' in message


OTHERS = {
    "parameters.s": ("[parameters.s]\nexpression = 'm**2'", "kg2"),
    "inputs.u": ("[inputs.u]\n[forces]\nx = 'u'", "N"),
    "coordinates.q": ("[coordinates.q]\n[bodies.c]\nmass = 'm'\nposition = ['0', 'q']", "m"),
    "states.z": ("[states.z]\nderivative = 'x_dot'\n[forces]\nx = '-m*z/t**2'", "m"),
    "parameters.p": ("[dampers.d]\nforce = 'p*rate**3'\nrate = 'x_dot'", "kg.s/m2"),
}


@pytest.mark.parametrize("part", OTHERS)
def test_whatever_has_no_unit_is_asked_for_it(part: str) -> None:
    table, unit = OTHERS[part]
    message = faults(table)
    assert f"{part}: " in message
    assert f'give unit = "{unit}"' in message


def test_pure_numbers_and_what_nothing_determines_need_none() -> None:
    assert not faults('[outputs]\ny = { expression = "p*x", unit = "m" }')
    assert not faults('[outputs]\ny = { expression = "sin(p)*x" }')
    assert not faults("")


def test_without_strict_units_nothing_is_asked() -> None:
    table = next(iter(USES))
    read(TEXT.format(table=table).replace("strict_units = true", ""), "bare.toml")


@pytest.mark.long
def test_units_left_out_of_bundled_models_are_inferred() -> None:
    """Two random parameters of each of 25 random models lose their units: most are found, none is found wrong."""
    rng, kept = random.Random(4), []
    for name in rng.sample(sorted(bundled()), 25):
        description = load(name).description
        own = [p for p in description.parameters if p.value is not None and dimension(p.unit.exponents) != ONE]
        for bare in rng.sample(own, min(2, len(own))):
            parameters = tuple(replace(p, unit=None) if p.name == bare.name else p for p in description.parameters)
            message = _refusal(replace(description, parameters=parameters))
            unit = describe(dimension(bare.unit.exponents))
            said = f"parameters.{bare.name}: {bare.value:g} has no unit" in message and f'unit = "{unit}"' in message
            assert said or not message, (name, message)
            kept.append(not message)
    assert sum(kept) < 0.15 * len(kept)


def _refusal(description: Description) -> str:
    try:
        complete(description)
    except UnitError as error:
        return str(error)
    return ""


def test_of_a_product_one_factor_needs_a_unit() -> None:
    """Nothing says which one; with a unit for it the other one is a number."""
    product = '[forces]\nx = "p*b*x"\n[parameters.b]\nvalue = 2\n'
    assert "parameters.b: 2 has no unit" in faults(product)
    assert faults(product + 'unit = "N/m"') == ""
    assert faults(product.replace('x = "p*b*x"', 'x = "p*b*x*c"') + '[parameters.c]\nvalue = 1\nunit = "N/m"') == ""


def test_tables_need_units_too() -> None:
    """Numbers of a table are in SI units by default, which strict_units does not believe."""
    table = '[forces]\nx = "f(x_dot)"\n[tables.f]\ncolumns = [[0, 1], [0, 2]]\n'
    message = faults(table)
    assert (
        'tables.f: its columns have no units, and forces.x.expression needs some with the dimensions of "m/s", '
        in message
    )
    assert 'give units = ["m/s", "N"], or the units' in message
    assert faults(table + 'units = ["rpm.mm", "N"]') == ""
    assert (
        faults('[outputs]\ny = { expression = "sin(f(x/x))", unit = "1" }\n[tables.f]\ncolumns = [[0, 1], [0, 2]]\n')
        == ""
    )


@pytest.mark.parametrize(
    "table",
    [
        '[frictions.f]\non = "x"\nforce = "p"',
        '[dampers.d]\nrate = "x"\ndamping = "p"',
        '[contacts.c]\ngap = "x"\nfriction = 0.1\nslip = "x"',
    ],
)
def test_a_coordinate_in_place_of_a_velocity_is_told_before_units(table: str) -> None:
    """Units would be a riddle: a force times a length is no power."""
    assert "'x' is a coordinate, not a velocity; write x_dot" in faults(table)


def test_a_missing_unit_is_told_before_what_follows_from_the_value() -> None:
    """40 mm without their unit, 40 m, make a gap negative, and a start that no constraint can meet."""
    for table in ('[contacts.floor]\ngap = "p - x"', '[stops.end]\nof = "x - p"\nlower = 0'):
        assert "parameters.p: 40 has no unit" in faults(table)
    loop = '[coordinates.y]\nunit = "m"\n[bodies.c]\nmass = "m"\nposition = ["y", "0"]\n'
    assert "parameters.p: 40 has no unit" in faults(loop + '[constraints.holonomic]\nk = "y**2 + x**2 + p**2"')
