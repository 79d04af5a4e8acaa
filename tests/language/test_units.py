"""Units: what their names mean, how numbers are converted, and what is refused."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import pytest

from lag2fmu.errors import UnitError
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import BASE_UNITS, Unit, exact, si_name


def exponents(**powers: int) -> tuple[int, ...]:
    return tuple(powers.get(base, 0) for base in BASE_UNITS)


@pytest.mark.parametrize(
    ("text", "powers", "factor"),
    [
        ("N*m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("N.m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("kg*m^2", {"kg": 1, "m": 2}, 1.0),
        ("kg.m2", {"kg": 1, "m": 2}, 1.0),
        ("m/s**2", {"m": 1, "s": -2}, 1.0),
        ("m.s-2", {"m": 1, "s": -2}, 1.0),
        ("N/(m/s)", {"kg": 1, "s": -1}, 1.0),
        ("J/kg/K", {"m": 2, "s": -2, "K": -1}, 1.0),
        ("N.m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}, 1.0),
        ("1", {}, 1.0),
        ("1/s", {"s": -1}, 1.0),
        ("N/mm", {"kg": 1, "s": -2}, 1000.0),
        ("g", {"kg": 1}, 1e-3),
        ("kg", {"kg": 1}, 1.0),
        ("rpm", {"rad": 1, "s": -1}, math.pi / 30),
        ("deg", {"rad": 1}, math.pi / 180),
        ("min", {"s": 1}, 60.0),
        ("%", {}, 0.01),
    ],
)
def test_names_are_resolved(text: str, powers: dict[str, int], factor: float) -> None:
    unit = parse_unit(text)
    assert unit.exponents == exponents(**powers)
    assert unit.factor == pytest.approx(factor, rel=1e-15)
    assert parse_unit(unit.name or "1") == unit


@pytest.mark.parametrize(
    ("unit", "value", "si"),
    [
        ("mm", 9, 0.009),
        ("km/h", 360, 100.0),
        ("deg", 180, math.pi),
        ("degC", 20, 293.15),
        ("degC", -273.15, 0.0),
        ("cm", 110, 1.1),
    ],
)
def test_values_are_rounded_once(unit: str, value: float, si: float) -> None:
    assert parse_unit(unit).to_si(value) == si
    assert parse_unit(unit).to_si(Fraction(str(value))) == si


def test_a_difference_has_no_offset() -> None:
    assert parse_unit("degC").difference_to_si(20) == 20.0
    assert parse_unit("rpm").difference_to_si(60) == pytest.approx(2 * math.pi)


@pytest.mark.parametrize(
    ("value", "si"), [(math.inf, math.inf), (-math.inf, -math.inf), (1e308, math.inf), (-1e308, -math.inf)]
)
def test_what_is_beyond_the_floats_is_infinite(value: float, si: float) -> None:
    assert parse_unit("t").to_si(value) == si
    assert math.isnan(parse_unit("t").to_si(math.nan))


def test_factors_stand_for_simple_fractions() -> None:
    assert exact(1e-3) == Fraction(1, 1000)
    assert exact(parse_unit("km/h").factor) == Fraction(5, 18)
    assert float(exact(math.pi / 180)) == math.pi / 180


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("kgg", "unknown unit 'kgg'; did you mean .*kg"),
        ("", "incomplete"),
        ("m/", "incomplete"),
        ("N m", "an operator is missing before 'm'"),
        ("m//s", "'/' stands where a unit is expected"),
        ("(m", "incomplete"),
        ("m)", "unbalanced"),
        ("m^13", "the power 13 is beyond 12"),
        ("m^99999999999", "the power 99999999999 is beyond 12"),
        ("degC/m", "a unit with an offset can only stand alone"),
        ("m.degC", "a unit with an offset can only stand alone"),
        ("degC^2", "a unit with an offset can only stand alone"),
        ("m+s", "unexpected"),
        ("10", "unexpected '10'"),
        ("m0", "the power 0 leaves nothing of 'm'"),
        ("__import__('os')", "unexpected"),
        ("m" * 101, "has 101 characters"),
    ],
)
def test_other_texts_are_refused(text: str, message: str) -> None:
    with pytest.raises(UnitError, match=message):
        parse_unit(text)


def test_products_and_quotients_have_customary_names() -> None:
    joule, radian, metre = parse_unit("J"), parse_unit("rad"), parse_unit("mm")
    assert (joule / radian).name == "N.m"
    assert (joule / metre).name == "N"
    assert (joule / radian) == Unit("N.m", exponents(kg=1, m=2, s=-2, rad=-1))
    assert (parse_unit("N") * parse_unit("s")).name == "kg.m/s"
    assert parse_unit("km/h").si_name == "m/s"
    assert parse_unit("N.m").si_name == "N.m"
    assert si_name(exponents()) == ""
    assert si_name(exponents(s=-1)) == "1/s"


@pytest.mark.parametrize(
    ("text", "instead"),
    [
        ("Ns/m", "N.s/m"),
        ("Nm", "N.m"),
        ("kNm/rad", "kN.m/rad"),
        ("°", "deg"),
        ("°/s", "deg/s"),
        ("°C", "degC"),
        ("kg·m²", "kg.m2"),
        ("µm", "um"),
        ("Pa0.5", "Pa^0.5"),
        ("Pa0,5", "Pa^0.5"),
        ("N/m1.5", "N/m^1.5"),
        ("Kg", "kg"),
        ("RPM", "rpm"),
        ("kg m2", "kg.m2"),
        ("N-m", "N.m"),
        ("kJ/kgK", "kJ/(kg.K)"),
        ("degrees/sec", "deg/s"),
        ("newton metre", "N.m"),
        ("kmh", "km/h"),
    ],
)
def test_units_as_they_are_often_written_get_the_right_one(text: str, instead: str) -> None:
    parse_unit(instead)
    with pytest.raises(UnitError, match=re.escape(f"did you mean '{instead}'?")):
        parse_unit(text)


@pytest.mark.parametrize(
    ("text", "choices"),
    [("NM", "'nm' or 'N.m'"), ("mpa", "'MPa' or 'mPa'"), ("Nms/rad", "'N.m.s/rad' or 'N.ms/rad'")],
)
def test_a_text_that_may_mean_two_units_gets_both(text: str, choices: str) -> None:
    with pytest.raises(UnitError, match=re.escape(f"did you mean {choices}?")):
        parse_unit(text)


@pytest.mark.parametrize(
    ("unit", "si", "quantity"),
    [
        ("kN.m", "N.m", "Torque"),
        ("N.mm", "N.m", "Torque"),
        ("N.m/deg", "N.m/rad", "RotationalSpringConstant"),
        ("kN.m/rad", "N.m/rad", "RotationalSpringConstant"),
        ("N.mm.s/deg", "N.m.s/rad", "RotationalDampingConstant"),
        ("kJ", "J", "Energy"),
        ("kW.h", "J", "Energy"),
    ],
)
def test_a_torque_is_no_energy(unit: str, si: str, quantity: str) -> None:
    """Both have the same exponents; a stiffness against turning has those of a generalized torque."""
    assert (parse_unit(unit).si_name, parse_unit(unit).quantity) == (si, quantity)


@pytest.mark.parametrize(
    ("unit", "quantity"),
    [("mH", "Inductance"), ("bar", "Pressure"), ("kN", "Force"), ("N*m", "Torque"), ("rpm", "AngularVelocity")],
)
def test_quantities_have_names(unit: str, quantity: str) -> None:
    assert parse_unit(unit).quantity == quantity
    assert parse_unit("mH").si_name == "H"


@pytest.mark.parametrize("text", ["N/m^1.5", "N/m**(3/2)", "kg.s^-2.m^-0.5"])
def test_powers_may_be_broken(text: str) -> None:
    """The stiffness of Hertz's contact; its square is a unit again that FMI can write."""
    unit = parse_unit(text)
    assert unit.exponents == (1, Fraction(-1, 2), -2, 0, 0, 0, 0, 0)
    assert not unit.is_whole
    assert si_name(unit.exponents) == "kg/m^0.5/s2"
    assert parse_unit(unit.name) == unit
    assert parse_unit("kg/m^0.5/s2").exponents == unit.exponents
    assert (unit * unit).is_whole
    assert parse_unit("N/mm^1.5").factor == pytest.approx(1e3**1.5)


def test_a_power_that_divides_by_zero_is_refused() -> None:
    with pytest.raises(UnitError, match=r"unit 'm\^\(1/0\)': the power '\(1/0\)' divides by zero"):
        parse_unit("m^(1/0)")
