"""The table of units: names with their SI exponents, factors and offsets, prefixes, and the words an FMU shows."""

from __future__ import annotations

from fractions import Fraction

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
