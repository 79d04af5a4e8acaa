"""What users get wrong in SymPy's mechanics: every case is one sentence that names what, where and the remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from lag2fmu import derive, load
from lag2fmu.errors import Lag2FmuError

HEAD = """
import sympy as sp
from sympy.physics.mechanics import *
T = dynamicsymbols._t
x, y, u = dynamicsymbols("x y u")
m, l, k = sp.symbols("m l k")
N = ReferenceFrame("N")
V = m*x.diff(T)**2/2
"""
LINE = 1 + HEAD.count("\n")
BOTH = "m*(x.diff(T)**2 + y.diff(T)**2)/2, [x, y]"

CASES: dict[str, tuple[str, dict[str, object], str]] = {
    "a coordinate that is a constant": (
        "made = LagrangesMethod(m*l**2, [l])",
        {},
        rf"line {LINE}: ValueError: Generalized coordinate \"l\" is not a dynamicsymbol",
    ),
    "a coordinate twice": ("made = LagrangesMethod(V, [x, x])", {"m": 1}, "coordinates {x.t.} are duplicated"),
    "another time": (
        "tau = sp.Symbol('tau')\nz = sp.Function('z')(tau)\nmade = LagrangesMethod(m*z.diff(tau)**2, [z])",
        {"m": 1},
        "is not a dynamicsymbol",
    ),
    "no kinetic energy": ("made = LagrangesMethod(-m*sp.cos(x), [x])", {"m": 1}, "nothing can move"),
    "no mass": ("made = LagrangesMethod(V, [x])", {"m": 0}, "a motion along x has less than"),
    "the fourth power of a velocity": (
        "made = LagrangesMethod(m*x.diff(T)**4, [x])",
        {"m": 1},
        "is not quadratic in the velocities",
    ),
    "an acceleration": (
        "made = LagrangesMethod(V + k*x.diff(T, 2), [x])",
        {"m": 1, "k": 1},
        "'x_ddot' is an acceleration and cannot stand here",
    ),
    "a function that C does not have": (
        "made = LagrangesMethod(V - sp.besselj(0, x), [x])",
        {"m": 1},
        "the function 'besselj' is not supported; known are",
    ),
    "cases": (
        "made = LagrangesMethod(V - sp.Piecewise((x, x > 0), (0, True)), [x])",
        {"m": 1},
        r"case distinction; write it out, cases as Choice",
    ),
    "an integral": (
        "made = LagrangesMethod(V - sp.Integral(sp.sin(k*m), (k, 0, x)), [x])",
        {"m": 1},
        "derivative, integral or case distinction",
    ),
    "a function of a coordinate": (
        "made = LagrangesMethod(V - sp.Function('h')(x), [x])",
        {"m": 1},
        r"h\(x\(t\)\) is no function of the time alone; write it out",
    ),
    "an imaginary energy": ("made = LagrangesMethod(sp.I*V, [x])", {"m": 1}, "is not real"),
    "an infinite energy": ("made = LagrangesMethod(V - sp.oo*x, [x])", {"m": 1}, "is not finite"),
    "a value that is no number": ("made = LagrangesMethod(V, [x])", {"m": float("nan")}, "nan is not a finite number"),
    "a complex value": ("made = LagrangesMethod(V, [x])", {"m": 1j}, "m expects float, got 1j"),
    "a value for a coordinate": (
        "made = LagrangesMethod(V, [x])",
        {"m": 1, "x": 3},
        "'x' is no constant, it moves; give its start to the run",
    ),
    "a constant called as a velocity": (
        "made = LagrangesMethod(sp.Symbol('x_dot')*x.diff(T)**2, [x])",
        {"x_dot": 2},
        "'x_dot' is already taken by the velocity of coordinate 'x'",
    ),
    "a constant called as a coordinate": (
        "made = LagrangesMethod(sp.Symbol('x')*x.diff(T)**2, [x])",
        {"x": 2},
        "'x' stands twice; rename one",
    ),
    "loads without a frame": (
        "P = Point('P'); P.set_vel(N, x.diff(T)*N.x)\nmade = LagrangesMethod(V, [x], forcelist=[(P, k*N.x)])",
        {"m": 1, "k": 1},
        "has loads and no inertial frame; give it frame=N",
    ),
    "a constraint that is not affine": (
        f"made = LagrangesMethod({BOTH}, nonhol_coneqs=[x.diff(T)**2 - y.diff(T)**2])",
        {"m": 1},
        "is not affine in the velocities",
    ),
    "a constraint that cannot be met": (
        f"made = LagrangesMethod({BOTH}, hol_coneqs=[x**2 + y**2 + l**2])",
        {"m": 1, "l": 1},
        "the start cannot meet the constraints",
    ),
    "a constraint on constants": (
        f"made = LagrangesMethod({BOTH}, hol_coneqs=[l - 1])",
        {"m": 1, "l": 1},
        "contains no coordinate, so it cannot restrict the motion",
    ),
    "Kane's method before its equations": (
        "made = KanesMethod(N, q_ind=[x], u_ind=[u], kd_eqs=[u - x.diff(T)])",
        {},
        r"call its kanes_equations\(bodies, loads\) first",
    ),
    "a system of nothing": ("made = System()", {}, "has no bodies; add_bodies or add_joints brings them"),
    "the Lagrangian alone": ("made = V", {}, "is of type Mul; expected a Mechanism, a function that returns one"),
    "an equation": ("made = sp.Eq(x.diff(T, 2), -x)", {}, "is of type Equality; expected a Mechanism"),
    "a class": ("made = LagrangesMethod", {}, "expected a Mechanism, a function that returns one"),
    "a function that returns nothing": ("def made():\n    return None", {}, "is of type NoneType; expected"),
    "a program that fails": ("made = LagrangesMethod(1/0, [x])", {}, rf"line {LINE}: ZeroDivisionError"),
}


@pytest.mark.parametrize("case", CASES)
def test_one_sentence_says_it(case: str, tmp_path: Path) -> None:
    text, values, message = CASES[case]
    (tmp_path / "x.py").write_text(f"{HEAD}{text}\n")
    with pytest.raises(Lag2FmuError, match=message) as caught:
        derive(load(f"{tmp_path / 'x.py'}:made", values))
    assert "\n" not in str(caught.value)
