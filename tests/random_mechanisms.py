"""Random mechanisms as text, well typed but otherwise without sense, and what SymPy derives from the same text."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import sympy as sp

from lag2fmu.description import names
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism

_UNARY = (
    "sin({})",
    "cos({})",
    "tanh({})",
    "atan({})",
    "exp(-({})**2)",
    "sqrt(1 + ({})**2)",
    "log(1 + ({})**2)",
    "cosh(tanh({}))",
    "abs({})",
    "abs({})**(3/2)",
    "max(0, {})**(5/2)",
    "({})**2",
    "({})**3",
    "1/(2 + sin({}))",
    "(1.5 + cos({}))**(1/3)",
    "(2 + tanh({}))**(-1/2)",
)
_BINARY = (
    "({} + {})",
    "({} - {})",
    "({})*({})",
    "({})*({})",
    "({})/(3 + sin({}))",
    "atan2({}, 2 + ({})**2)",
    "min({}, {})",
    "max({}, {})",
)
_NUMBERS = ("1", "2", "3", "0.1", "1/3", "pi", "2.5", "-1", "0.7", "1e-3")


class Writer:
    """Writes mechanisms; the same seed gives the same text."""

    def __init__(self, seed: int) -> None:
        self.choose = random.Random(seed)
        self.n = self.choose.randint(1, 3)
        self.q = ["a", "b", "c"][: self.n]
        self.places = [*self.q, *self.choose.sample(["t", "y0"], self.choose.randint(0, 1)), "m", "k"]

    def expression(self, atoms: list[str], depth: int) -> str:
        """A random expression of ``atoms``, of up to ``depth`` functions in each other."""
        if depth == 0 or self.choose.random() < 0.1:
            return self.choose.choice(atoms if self.choose.random() < 0.8 else list(_NUMBERS))
        if self.choose.random() < 0.5:
            return self.choose.choice(_UNARY).format(self.expression(atoms, depth - 1))
        return self.choose.choice(_BINARY).format(*(self.expression(atoms, depth - 1) for _ in range(2)))

    def kinetic(self) -> str:
        """A positive definite form, and at times terms of first degree."""
        terms = [f"(m + ({self.expression(self.places, 2)})**2)*{q}_dot**2/2" for q in self.q]
        if self.n > 1:
            terms.append(f"({self.expression(self.places, 2)}*a_dot + b_dot)**2/2")
        if self.choose.random() < 0.3:
            terms.append(f"{self.q[0]}_dot*({self.expression(self.places, 2)})")
        return " + ".join(terms)

    def constraints(self) -> str:
        """At most one, which can be met whatever the other coordinates are."""
        kind = self.choose.choice(["", "", "holonomic", "nonholonomic"]) if self.n > 1 else ""
        last, others = self.q[-1], self.q[:-1]
        tied = self.expression([*others, "k"], 2)
        text = {"": "", "holonomic": f"{last} - ({tied})", "nonholonomic": f"{last}_dot - ({tied})*a_dot"}[kind]
        return f'[constraints.{kind}]\ntie = "{text}"\n' if kind else ""

    def text(self) -> str:
        """The mechanism in the text format."""
        speeds = [f"{q}_dot" for q in self.q]
        constraints, moving = self.constraints(), [*self.places, *speeds]
        start = [f"start = {self.choose.uniform(-0.9, 0.9):.3f}" for _ in self.q]
        if constraints:
            start[-1] = "guess = 0.1"
        coordinates = "".join(f"{q} = {{ {s} }}\n" for q, s in zip(self.q, start, strict=True))
        motion = "y0 = { motion = true }\n" if "y0" in self.places else ""
        return (
            '[mechanism]\nname = "random"\n[parameters]\nm = { value = 1.3 }\nk = { value = 0.7 }\n'
            f'l = {{ expression = "{self.expression(["m", "k"], 2)}" }}\n'
            f"[coordinates]\n{coordinates}[inputs]\nF = {{ start = 0.2 }}\n{motion}"
            f'[definitions]\nd = "{self.expression(self.places, 2)}"\n'
            f'[energy]\nkinetic = "{self.kinetic()}"\n'
            f'potential = "{self.expression([*self.places, "d", "l"], 3)} + {self.expression(self.places, 2)}"\n'
            f'dissipation = "(m + {self.expression(self.q, 1)}**2)*{self.choose.choice(speeds)}**2/2"\n'
            f'[forces]\na = "F*({self.expression([*moving, "d"], 2)}) + {self.expression([*moving, "F"], 2)}"\n'
            f"{constraints}[outputs]\n"
            f'o1 = {{ expression = "{self.expression([*moving, "d", "l", "F"], 3)}" }}\n'
            f'o2 = {{ expression = "{self.expression([*self.q, "d"], 3)}" }}\n'
        )


class BodyWriter(Writer):
    """Writes mechanisms with bodies, in the plane or on frames in space."""

    def text(self) -> str:
        """The mechanism in the text format."""
        regular, spatial = " + ".join(f"m*{q}_dot**2/2" for q in self.q), self.choose.random() < 0.6
        coordinates = [f"{q} = {{ start = {self.choose.uniform(-0.9, 0.9):.3f} }}\n" for q in self.q]
        motion = "y0 = { motion = true }\n" if "y0" in self.places else ""
        return (
            '[mechanism]\nname = "random"\n[parameters]\nm = { value = 1.3 }\nk = { value = 0.7 }\n'
            f"[coordinates]\n{''.join(coordinates)}[inputs]\nF = {{ start = 0.2 }}\n{motion}"
            f'[definitions]\nd = "{self.expression(self.places, 1)}"\n'
            f'[energy]\nkinetic = "{regular}"\npotential = "{self.expression(self.places, 2)}"\n[forces]\na = "F"\n'
            f"[gravity]\nacceleration = 9.81\ndirection = {'[0, 0.6, -0.8]' if spatial else '[0.6, -0.8]'}\n"
            + (self._on_frames() if spatial else self._in_the_plane())
        )

    def _in_the_plane(self) -> str:
        x, y, angle = (self.expression([*self.places, "d"], 1) for _ in range(3))
        body = f'[bodies.plate]\nmass = "m"\ninertia = "0.3*k"\nposition = ["{x}", "{y}"]\nangle = "{angle}"\n'
        x, y = (self.expression(self.places, 2) for _ in range(2))
        return f'{body}[bodies.bob]\nmass = "k"\nposition = ["{x}", "{y}"]\n'

    def _on_frames(self) -> str:
        frames = ""
        for name, parent in (("f", "world"), ("g", "f")):
            x, first = (self.expression([*self.places, "d"], 1) for _ in range(2))
            y, second = self.choose.choice(self.places), self.choose.choice(self.q)
            axes = self.choose.sample(["x", "y", "z"], 2)
            frames += (
                f'[frames.{name}]\nparent = "{parent}"\norigin = ["{x}", "{y}", "0.4"]\n'
                f'rotations = [["{axes[0]}", "{first}"], ["{axes[1]}", "{second}"]]\n'
            )
        inertia = '["0.5", "0.6*k", "0.7", "0.1", "-0.05", "0.02"]'
        return (
            f'{frames}[bodies.rotor]\nframe = "g"\ncenter = ["0.1", "k", "-0.2"]\nmass = "m"\ninertia = {inertia}\n'
            '[bodies.bob]\nframe = "f"\ncenter = ["0", "0.3", "0"]\nmass = "k"\n'
        )


class MasslessWriter(Writer):
    """Writes mechanisms in which a second coordinate has no mass, at times with friction on it."""

    def text(self) -> str:
        """The mechanism in the text format."""
        self.q = ["a", "b"]
        self.places = ["a", *self.choose.sample(["t", "y0"], self.choose.randint(0, 1)), "m", "k"]
        motion = "y0 = { motion = true }\n" if "y0" in self.places else ""
        tied, drag = self.expression(self.places, 2), self.expression(["a"], 1)
        friction = f'dissipation = "(m + ({drag})**2)*(b_dot - 0.3*a_dot)**2/2"\n' if self.choose.random() < 0.4 else ""
        return (
            '[mechanism]\nname = "random"\n[parameters]\nm = { value = 1.3 }\nk = { value = 0.7 }\n'
            f"[coordinates]\na = {{ start = {self.choose.uniform(-0.9, 0.9):.3f} }}\nb = {{ guess = 0.1 }}\n"
            f"[inputs]\nF = {{ start = 0.2 }}\n{motion}"
            f'[energy]\nkinetic = "(m + ({self.expression(self.places, 2)})**2)*a_dot**2/2"\n'
            f'potential = "k*(b - ({tied}))**2 + b**4/10 + {self.expression(self.places, 2)}"\n{friction}[forces]\n'
            f'a = "{self.expression([*self.places, "F"], 2)}"\nb = "F*({self.expression(self.places, 1)})"\n'
        )


@dataclass(frozen=True)
class Expected:
    """Lagrange's equations by SymPy's own derivatives: ``residual`` (n + m,) and the ``momenta`` (n,)."""

    residual: list[sp.Expr]
    momenta: list[sp.Expr]
    outputs: list[sp.Expr]
    equilibria: list[tuple[str, sp.Expr]]

    def moving_in_equilibrium(self, values: Mapping[str, float]) -> dict[str, float]:
        """``values`` with what follows where something has no mass: no force on it at all times.

        Its velocity and its acceleration are solved for. Elsewhere the equations may differ by what is 0 here.
        """
        values = dict(values)
        for unknown, equation in self.equilibria:
            found = _with_flat_signs(equation)
            found = found.subs({s: values[s.name] for s in found.free_symbols if s.name != unknown}).evalf()
            x = sp.Symbol(unknown, real=True)
            values[unknown] = float(-found.coeff(x, 0) / found.coeff(x, 1)) if found.has(x) else values[unknown]
        return values

    def numbers(self, values: Mapping[str, float]) -> list[np.ndarray]:
        """Residual, momenta and outputs in double precision."""
        known: dict[sp.Basic, np.float64] = {}
        with np.errstate(all="ignore"):  # NaN where a function has no value
            return [
                np.array([_value(e, values, known) for e in part], dtype=float)
                for part in (self.residual, self.momenta, self.outputs)
            ]


_NUMERIC: Mapping[type, Callable[..., np.float64]] = {
    sp.Add: lambda *terms: sum(terms),
    sp.Mul: lambda *factors: math.prod(factors),
    sp.Pow: np.power,
    sp.Max: lambda *values: np.max(values),
    sp.Min: lambda *values: np.min(values),
    sp.Abs: np.abs,
    sp.sign: np.sign,
    sp.re: np.real,
    sp.im: np.imag,
    sp.Heaviside: lambda x, *_: np.heaviside(x, 0.5),
    sp.DiracDelta: lambda *_: np.float64(0.0),
    sp.Derivative: lambda *_: np.float64(0.0),  # that of a sign, of which SymPy says no more
    **{getattr(sp, name): getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log")},
    **{sp.atan: np.arctan, sp.atan2: np.arctan2},
}
"""What each function of SymPy is in doubles."""


def _value(e: sp.Expr, values: Mapping[str, float], known: dict[sp.Basic, np.float64]) -> np.float64:
    """The value of ``e``, and in ``known`` those of its parts, each of which is computed once.

    To compile an expression takes longer than to evaluate it a few times.
    """
    if e not in known:
        if isinstance(e, sp.Symbol):
            known[e] = np.float64(values[e.name])
        elif e.is_Number or e.is_NumberSymbol:
            known[e] = np.float64(float(e))
        else:
            parts = () if isinstance(e, sp.Derivative) else e.args
            known[e] = _NUMERIC[e.func](*(_value(part, values, known) for part in parts))
    return known[e]


def _with_flat_signs(e: sp.Expr) -> sp.Expr:
    """``e`` with the derivative of a sign written as 0, of which SymPy says no more."""
    return e.replace(sp.Derivative, lambda *_: sp.S.Zero)


def mechanism(seed: int) -> Mechanism:
    """A random mechanism of one to three coordinates; raises what reading a mechanism raises."""
    return read(Writer(seed).text(), "random.toml")


def mechanism_with_bodies(seed: int) -> Mechanism:
    """The same with bodies."""
    return read(BodyWriter(seed).text(), "random.toml")


def mechanism_without_mass(seed: int) -> Mechanism:
    """The same with a coordinate that has no mass."""
    return read(MasslessWriter(seed).text(), "random.toml")


_TURNS = {"x": sp.rot_ccw_axis1, "y": sp.rot_ccw_axis2, "z": sp.rot_ccw_axis3}
"""Matrices of components: in turned axes -> in those before."""


def _of_bodies(given: Mechanism, whole: Callable[..., sp.Expr], rate: Callable[[sp.Expr], sp.Expr]) -> sp.Expr:
    """T - V of the bodies of ``given``, frames composed as matrices; angular velocities from R^T dR/dt."""
    dimension = len(given.gravity.direction)
    poses = {"world": (sp.zeros(dimension, 1), sp.eye(dimension))}
    for frame in given.frames:
        origin, R = poses[str(frame.parent)]
        origin = origin + R * sp.Matrix([whole(x) for x in frame.origin])
        for axis, angle in frame.rotations:
            R = R * _TURNS[axis](whole(angle))
        poses[frame.name] = origin, R
    g = 9.81 * sp.Matrix([whole(x) for x in given.gravity.direction])
    total = sp.S.Zero
    for body in given.bodies:
        name, place = given.location(body.name)
        origin, R = poses[name]
        r = origin + R * sp.Matrix([whole(x) for x in place])
        v, mass = r.applyfunc(rate), whole(body.mass)
        total += mass * v.dot(v) / 2 + mass * g.dot(r)
        if body.angle is not None:
            total += whole(body.inertia) * rate(whole(body.angle)) ** 2 / 2
        elif body.inertia is not None:
            spin = R.T * R.applyfunc(rate)
            w = sp.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
            xx, yy, zz, xy, xz, yz = (whole(x) for x in body.inertia)
            total += w.dot(sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) * w) / 2
    return total


def expected(given: Mechanism) -> Expected:
    """The equations of ``given``: M qdd - forcing - G^T multiplier, and the constraints differentiated."""
    by_name = {s.name: s for _, e in given.expressions() for s in e.free_symbols}

    def symbol(name: str) -> sp.Symbol:
        return by_name.get(name, sp.Symbol(name, real=True))

    named = {d.name: d.expression for d in given.definitions}
    named |= {p.name: p.expression for p in given.parameters if p.expression is not None}
    inner = {symbol(name): e for name, e in named.items()}

    def whole(e: sp.Expr | None) -> sp.Expr:
        return sp.S.Zero if e is None else sp.sympify(e).xreplace(inner).xreplace(inner)

    moving = [c.name for c in given.coordinates] + [u.name for u in given.motions]
    chain = [(symbol("t"), sp.S.One)]
    for name in moving:
        chain += [(symbol(name), symbol(names.velocity(name)))]
        chain += [(symbol(names.velocity(name)), symbol(names.acceleration(name)))]
    if any(c.coordinate is not None for c in given.constraints):  # what has no mass follows forces at once
        pushes = [u.name for u in given.inputs if u not in given.motions]
        for force in pushes + [names.generalized_force(c.name) for c in given.coordinates]:
            derivatives = [force, names.rate(force), names.rate(names.rate(force))]
            chain += [(symbol(x), symbol(x_dot)) for x, x_dot in pairwise(derivatives)]

    def rate(e: sp.Expr) -> sp.Expr:
        return sp.Add(*(e.diff(x) * x_dot for x, x_dot in chain))

    energy = given.energy
    lagrangian = whole(energy.kinetic) - whole(energy.potential)
    if given.bodies:
        lagrangian += _of_bodies(given, whole, rate)
    forces = {f.coordinate: whole(f.expression) for f in given.forces}
    velocities = [rate(whole(c.expression)) if c.holonomic else whole(c.expression) for c in given.constraints]
    multipliers = [symbol(names.multiplier(c.name)) for c in given.constraints]
    residual, momenta = [], []
    for c in given.coordinates:
        q, qd = symbol(c.name), symbol(names.velocity(c.name))
        momenta.append(lagrangian.diff(qd))
        force = forces.get(c.name, sp.S.Zero) + symbol(names.generalized_force(c.name))
        force += sum(v.diff(qd) * x for v, x in zip(velocities, multipliers, strict=True))
        residual.append(rate(momenta[-1]) - lagrangian.diff(q) + whole(energy.dissipation).diff(qd) - force)
    residual += [rate(v) for v in velocities]
    solved = [(c.coordinate, v) for c, v in zip(given.constraints, velocities, strict=True) if c.coordinate is not None]
    equilibria = [(names.velocity(q), v) for q, v in solved] + [(names.acceleration(q), rate(v)) for q, v in solved]
    return Expected(residual, momenta, [whole(o.expression) for o in given.outputs], equilibria)
