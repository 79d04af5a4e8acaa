"""Units of measurement: the record of a unit, and the tables of names, factors and words that an FMU shows.

A table instead of a units library: the table loads in no time, whereas the libraries take about as long to import as
SymPy, and an FMU needs just what stands here (exponents of the base units and the radian, a factor, an offset).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, TypeVar

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""The base units of FMI 2.0 section 2.2.2, in the order of ``Unit.exponents``."""

Exponents = tuple[int | Fraction, ...]
"""Of the base units; broken ones are fractions, as in the stiffness of Hertz's contact, N/m^1.5."""
NONE: Exponents = (0,) * len(BASE_UNITS)


def _exponents(**powers: int) -> Exponents:
    return tuple(powers.get(base, 0) for base in BASE_UNITS)


_KG, _M, _S = _exponents(kg=1), _exponents(m=1), _exponents(s=1)
_ENERGY, _FORCE = _exponents(kg=1, m=2, s=-2), _exponents(kg=1, m=1, s=-2)

# name -> (exponents, factor to SI, offset in SI)
NAMED: dict[str, tuple[Exponents, float, float]] = {
    "m": (_M, 1.0, 0.0),
    "s": (_S, 1.0, 0.0),
    "g": (_KG, 1e-3, 0.0),
    "A": (_exponents(A=1), 1.0, 0.0),
    "K": (_exponents(K=1), 1.0, 0.0),
    "mol": (_exponents(mol=1), 1.0, 0.0),
    "cd": (_exponents(cd=1), 1.0, 0.0),
    "rad": (_exponents(rad=1), 1.0, 0.0),
    "N": (_FORCE, 1.0, 0.0),
    "J": (_ENERGY, 1.0, 0.0),
    "W": (_exponents(kg=1, m=2, s=-3), 1.0, 0.0),
    "Pa": (_exponents(kg=1, m=-1, s=-2), 1.0, 0.0),
    "Hz": (_exponents(s=-1), 1.0, 0.0),
    "V": (_exponents(kg=1, m=2, s=-3, A=-1), 1.0, 0.0),
    "C": (_exponents(A=1, s=1), 1.0, 0.0),
    "T": (_exponents(kg=1, s=-2, A=-1), 1.0, 0.0),
    "Wb": (_exponents(kg=1, m=2, s=-2, A=-1), 1.0, 0.0),
    "H": (_exponents(kg=1, m=2, s=-2, A=-2), 1.0, 0.0),
    "F": (_exponents(kg=-1, m=-2, s=4, A=2), 1.0, 0.0),
    "Ohm": (_exponents(kg=1, m=2, s=-3, A=-2), 1.0, 0.0),
}
PREFIXED = frozenset(NAMED) - {"rad"}
PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_PI = 3.141592653589793
NAMED |= {
    "deg": (_exponents(rad=1), _PI / 180.0, 0.0),
    "rev": (_exponents(rad=1), 2.0 * _PI, 0.0),
    "rpm": (_exponents(rad=1, s=-1), 2.0 * _PI / 60.0, 0.0),
    "mrad": (_exponents(rad=1), 1e-3, 0.0),
    "min": (_S, 60.0, 0.0),
    "h": (_S, 3600.0, 0.0),
    "d": (_S, 86400.0, 0.0),
    "t": (_KG, 1e3, 0.0),
    "l": (_exponents(m=3), 1e-3, 0.0),
    "bar": (_exponents(kg=1, m=-1, s=-2), 1e5, 0.0),
    "eV": (_ENERGY, 1.602176634e-19, 0.0),
    "in": (_M, 0.0254, 0.0),
    "ft": (_M, 0.3048, 0.0),
    "lb": (_KG, 0.45359237, 0.0),
    "lbf": (_FORCE, 4.4482216152605, 0.0),
    "degC": (_exponents(K=1), 1.0, 273.15),
    "%": (NONE, 1e-2, 0.0),
}

# SI names of exponents that have a customary one; the rest is written out from the base units
CUSTOMARY = {
    _exponents(kg=1, m=1, s=-2): "N",
    _exponents(kg=1, m=2, s=-2): "J",
    _exponents(kg=1, m=2, s=-3): "W",
    _exponents(kg=1, s=-2): "N/m",
    _exponents(kg=1, s=-1): "N.s/m",
    _exponents(kg=1, m=2, s=-2, rad=-1): "N.m",
    _exponents(kg=1, m=2, s=-1, rad=-1): "N.m.s",
    _exponents(kg=1, m=2, s=-2, rad=-2): "N.m/rad",
    _exponents(kg=1, m=2, s=-1, rad=-2): "N.m.s/rad",
    _exponents(kg=1, m=-1, s=-2): "Pa",
    **{NAMED[name][0]: name for name in ("V", "C", "T", "Wb", "H", "F", "Ohm")},
}

_OF_TORQUES = ("N.m", "N.m.s", "N.m/rad", "N.m.s/rad")
"""Names that the exponents do not tell: a torque and an energy have the same, and a torque by an angle is one too."""

QUANTITIES = {
    **{"m": "Length", "s": "Time", "kg": "Mass", "rad": "Angle", "m/s": "Velocity", "m/s2": "Acceleration"},
    **{"rad/s": "AngularVelocity", "rad/s2": "AngularAcceleration", "kg.m2": "MomentOfInertia", "m2": "Area"},
    **{"N": "Force", "N.m": "Torque", "J": "Energy", "W": "Power", "Pa": "Pressure", "kg/m3": "Density"},
    **{"N/m": "TranslationalSpringConstant", "N.s/m": "TranslationalDampingConstant", "m3": "Volume"},
    **{"N.m/rad": "RotationalSpringConstant", "N.m.s/rad": "RotationalDampingConstant", "Hz": "Frequency"},
    **{"V": "ElectricPotential", "A": "ElectricCurrent", "C": "ElectricCharge", "Ohm": "Resistance"},
    **{"H": "Inductance", "F": "Capacitance", "T": "MagneticFluxDensity", "Wb": "MagneticFlux"},
    "K": "ThermodynamicTemperature",
}
"""SI unit -> the name that Modelica.Units.SI (Modelica Standard Library 4.0) gives the quantity."""

Number = TypeVar("Number", float, Any)


@dataclass(frozen=True)
class Unit:
    """A unit as the user wrote it, resolved.

    ``value_in_SI = factor * value + offset``; ``exponents`` are those of BASE_UNITS; ``name`` is the user's text with
    the standard's separators (``N.m``, ``m/s2``); ``si_name`` is how the SI unit of the same exponents is called in the
    FMU.
    """

    name: str
    exponents: Exponents
    factor: float = 1.0
    offset: float = 0.0

    @property
    def si_name(self) -> str:
        """Name of the SI unit with these exponents, e.g. ``m/s`` for ``km/h``; empty for a dimensionless unit."""
        if self.factor == 1.0 and self.offset == 0.0:
            return self.name
        own = re.sub(r"[A-Za-z]+", _coherent, self.name)
        return own if own in _OF_TORQUES else si_name(self.exponents)

    @property
    def is_whole(self) -> bool:
        """Whether all exponents are whole numbers, as the base units of FMI have to be."""
        return all(isinstance(e, int) for e in self.exponents)

    @property
    def quantity(self) -> str:
        """What is measured, e.g. ``Torque`` in N.m, by the SI unit's name; '' where there is no common word."""
        return QUANTITIES.get(self.si_name) or QUANTITIES.get(si_name(self.exponents), "")

    @property
    def dimension(self) -> Exponents:
        """The exponents without the radian, which counts as 1 when dimensions are compared."""
        return self.exponents[:-1]

    def to_si(self, value: float | Fraction) -> float:
        """The SI value of ``value`` in this unit, rounded once: 9 mm are 0.009 m; inf beyond the range of floats."""
        return _linear(self.factor, value, self.offset)

    def difference_to_si(self, value: float | Fraction) -> float:
        """The SI value of a difference, a rate or a nominal value in this unit: as ``to_si`` without the offset."""
        return _linear(self.factor, value, 0.0)

    def from_si(self, value: Number) -> Number:
        """``value`` (SI), a number or an array, in this unit."""
        if self.factor == 1.0 and self.offset == 0.0:
            return value
        return (value - self.offset) * float(exact(self.factor).denominator) / float(exact(self.factor).numerator)

    def array_to_si(self, values: Number) -> Number:
        """The SI values of ``values`` in this unit, a number or an array, rounded at each operation."""
        return values * float(exact(self.factor).numerator) / float(exact(self.factor).denominator) + self.offset

    def __truediv__(self, other: Unit) -> Unit:
        """The SI unit of a quotient, e.g. ``J/rad`` (named ``N.m``)."""
        return _from_exponents(tuple(plain_power(a - b) for a, b in zip(self.exponents, other.exponents, strict=True)))

    def __mul__(self, other: Unit) -> Unit:
        """The SI unit of a product."""
        return _from_exponents(tuple(plain_power(a + b) for a, b in zip(self.exponents, other.exponents, strict=True)))


@cache
def exact(number: float) -> Fraction:
    """The simple fraction that ``number`` stands for (5/18 for km/h), or its binary value if there is none."""
    simple = Fraction(number).limit_denominator(10**12)
    return simple if float(simple) == number else Fraction(number)


def _linear(factor: float, value: float | Fraction, offset: float) -> float:
    """factor * value + offset, rounded once; a float value means its shortest decimal."""
    if isinstance(value, (float, int)):
        if not math.isfinite(value) or (factor == 1.0 and offset == 0.0):
            return float(value) + 0.0  # turns -0.0 into 0.0, because text does not keep -0.0
        value = Fraction(repr(value))
    try:
        return float(exact(factor) * value + exact(offset))
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _coherent(found: re.Match[str]) -> str:
    """The SI unit of a name: N for kN, m for mm, rad for deg."""
    name = found[0]
    if name not in NAMED and name[0] in PREFIXES and name[1:] in PREFIXED:
        return name[1:]
    return {"deg": "rad", "rev": "rad", "mrad": "rad", "lbf": "N"}.get(name, name)


def si_name(exponents: Exponents) -> str:
    """The name of the SI unit with ``exponents``: a customary one (``N``) or written out (``kg.m/s3``)."""
    if exponents in CUSTOMARY:
        return CUSTOMARY[exponents]
    above = [_power(base, e) for base, e in zip(BASE_UNITS, exponents, strict=True) if e > 0]
    below = [_power(base, -e) for base, e in zip(BASE_UNITS, exponents, strict=True) if e < 0]
    if not above and not below:
        return ""
    return "/".join([".".join(above) or "1", *below])


def _power(base: str, exponent: int | Fraction) -> str:
    if isinstance(exponent, int):
        return base if exponent == 1 else f"{base}{exponent}"
    decimal = repr(float(exponent))
    return f"{base}^{decimal}" if Fraction(decimal) == exponent else f"{base}^({exponent})"


def _from_exponents(exponents: Exponents) -> Unit:
    return Unit(si_name(exponents), exponents)


def plain_power(exponent: int | Fraction) -> int | Fraction:
    """A power of a unit, a whole number as int."""
    return int(exponent) if exponent.denominator == 1 else exponent


DIMENSIONLESS = Unit("", NONE)
METRE, SECOND, KILOGRAM, RADIAN = Unit("m", _M), Unit("s", _S), Unit("kg", _KG), Unit("rad", _exponents(rad=1))
NEWTON, TORQUE = Unit("N", _FORCE), Unit("N.m", _exponents(kg=1, m=2, s=-2, rad=-1))
JOULE, WATT = Unit("J", _ENERGY), Unit("W", _exponents(kg=1, m=2, s=-3))
