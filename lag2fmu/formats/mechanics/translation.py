"""From SymPy's dynamic symbols to the symbols of a mechanism."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.core.function import AppliedUndef

from lag2fmu.description.names import velocity
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint, Energy
from lag2fmu.description.reserved import GLOBAL_NAMES
from lag2fmu.description.symbols import coordinate, parameter, signal
from lag2fmu.errors import LoadError
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.mechanics.equations import Problem, T
from lag2fmu.language.vocabulary import TIME, symbol
from lag2fmu.mechanism.record import Mechanism

Floats = NDArray[np.float64]

_TRIALS, _STEPS, _RANK, _MET, _NEARLY_MET = 5, 50, 1e-9, 1e-14, 1e-10
"""Places where the rank of a Jacobian is looked at, with the steps of Newton's method that lead there; what counts as 0
of its singular values; the residuals at which the method ends, and with which a place will do."""


class Translation:
    """A ``Problem`` and the names that its symbols get.

    ``parameters`` are the names of all constants, in order; ``spelled`` are {name of a constant in SymPy: name here}.
    """

    def __init__(self, problem: Problem, name: str) -> None:
        self._problem, self._name = problem, name
        whole = [*self._energies(), *problem.forces, *problem.holonomic, *problem.nonholonomic]
        dynamic = {a for e in whole for a in e.atoms(AppliedUndef)}
        self._check_dynamic(dynamic)
        ours = list(problem.coordinates)
        others = sorted((a for a in dynamic if a not in ours), key=str)
        constants = sorted({s for e in whole for s in e.free_symbols} - {T}, key=str)
        self._names = self._named([*ours, *others], constants)
        self._inputs = others
        placed = [*self._energies(), *problem.holonomic]
        self._motions = [a for a in others if any(e.has(a) for e in placed) or any(e.has(a.diff(T)) for e in whole)]
        self.parameters = tuple(self._names[c] for c in constants)
        self.spelled = {_shown(c): self._names[c] for c in constants}

    @property
    def moving(self) -> dict[str, str]:
        """{how it is called in SymPy: its name here} of what has a start: coordinates, their rates, inputs."""
        rates = {q.diff(T): velocity(self._names[q]) for q in self._problem.coordinates}
        speeds = {u: rates[rate] for u, rate in self._problem.speeds.items() if rate in rates}
        started = {a: self._names[a] for a in (*self._problem.coordinates, *self._inputs)} | rates | speeds
        return {text: name for a, name in started.items() for text in (str(a), _shown(a))}

    def _energies(self) -> list[sp.Expr]:
        return [e for e in (self._problem.kinetic, self._problem.lagrangian) if e is not None]

    def _check_dynamic(self, dynamic: Iterable[sp.Expr]) -> None:
        """Raise LoadError for a function of anything but the time alone."""
        for function in dynamic:
            if function.args != (T,):
                raise LoadError(f"'{self._name}': {function} is no function of the time alone; write it out")

    def _named(self, dynamic: Sequence[sp.Expr], constants: Sequence[sp.Expr]) -> dict[sp.Expr, str]:
        """{symbol: identifier}; raises LoadError where two come out alike.

        Constants are the keyword arguments of a function, so that ``lambda`` becomes ``lambda_``.
        """
        words = {text for text in map(_shown, constants) if keyword.iskeyword(text)}
        items = (*dynamic, *constants)
        found = identifiers(map(_shown, items), f"'{self._name}'", taken={*GLOBAL_NAMES, *words})
        return {item: found[_shown(item)] for item in items}

    def mechanism(self, values: Mapping[str, float]) -> Mechanism:
        """The mechanism with ``values`` of all parameters; raises MechanismError."""
        problem, put = self._problem, self._put
        signals = [signal(self._names[a], motion=a in self._motions) for a in self._inputs]
        kinetic, lagrangian = problem.kinetic, problem.lagrangian
        place = self._place(values)
        guesses = [None] * len(problem.coordinates) if place is None else [float(x) for x in place]
        rows = [put(e) for e in self._independent(values, place)]
        constraints = [Constraint(f"holonomic_{k}", put(e)) for k, e in enumerate(problem.holonomic, 1)]
        constraints += [Constraint(f"nonholonomic_{k}", e, "nonholonomic") for k, e in enumerate(rows, 1)]
        forces = {self._names[q]: put(Q) for q, Q in zip(problem.coordinates, problem.forces, strict=True) if Q != 0}
        return Mechanism(
            self._name,
            title=self._name.replace("_", " ").capitalize(),
            source="imported from SymPy's mechanics",
            coordinates=[
                coordinate(self._names[q], guess=guess) for q, guess in zip(problem.coordinates, guesses, strict=True)
            ],
            parameters=[parameter(p, values[p]) for p in self.parameters],
            inputs=signals,
            energy=Energy(
                kinetic=None if kinetic is None else put(kinetic),
                lagrangian=None if lagrangian is None else put(lagrangian),
            ),
            forces=forces,
            constraints=constraints,
            outputs=list(self._speed_outputs()),
        )

    def _speed_outputs(self) -> Iterable[Output]:
        """The generalized speeds that are no velocities."""
        rates = {q.diff(T) for q in self._problem.coordinates}
        for u, value in self._problem.speeds.items():
            if value not in rates:
                name = identifier(_shown(u))
                yield Output(name, expression=self._put(value), doc=f"generalized speed {name}")

    def _put(self, expression: sp.Expr) -> sp.Expr:
        """``expression`` in the symbols of a mechanism."""
        found: dict[sp.Expr, Any] = {T: TIME}
        for item, name in self._names.items():
            found[item] = symbol(name)
            if isinstance(item, AppliedUndef):
                found[item.diff(T)] = symbol(velocity(name))
                found[item.diff(T, 2)] = symbol(f"{name}_ddot")
        return sp.sympify(expression).doit().xreplace(found)

    # ------------------------------------------------------------------------------------------------- constraints

    def _place(self, values: Mapping[str, float]) -> Floats | None:
        """A place q (n,) that meets the holonomic constraints at the start; None where there are none."""
        problem = self._problem
        if not problem.holonomic:
            return None
        residuals = sp.Matrix([self._put(e) for e in problem.holonomic])
        value, slopes = self._functions(values, residuals, residuals.jacobian(self._q))
        return _on_manifold(value, slopes, len(self._q))

    def _independent(self, values: Mapping[str, float], place: Floats | None) -> list[sp.Expr]:
        """The constraints of velocities that do not follow from the others.

        Some of Kane's velocity constraints repeat the derivatives of configuration constraints. Ranks at a ``place``
        (n,) that meets the configuration constraints tell which.
        """
        problem = self._problem
        if place is None or not (problem.repeat and problem.nonholonomic):
            return list(problem.nonholonomic)
        rates = [symbol(velocity(self._names[q])) for q in problem.coordinates]
        positions = sp.Matrix([self._put(e) for e in problem.holonomic]).jacobian(self._q)
        velocities = sp.Matrix([self._put(e) for e in problem.nonholonomic]).jacobian(rates)
        slopes, rows = (f(place) for f in self._functions(values, positions, velocities))
        kept, basis = [], list(slopes)
        for row, expression in zip(rows, problem.nonholonomic, strict=True):
            if _rank([*basis, row]) > _rank(basis):
                basis.append(row)
                kept.append(expression)
        return kept

    @property
    def _q(self) -> list[sp.Symbol]:
        return [symbol(self._names[q]) for q in self._problem.coordinates]

    def _functions(self, values: Mapping[str, float], *matrices: sp.Matrix) -> list[Callable[[Floats], Floats]]:
        """The ``matrices`` (k, l) as functions of q (n,) at ``values``; the time and everything else is 0."""
        fixed = {symbol(p): value for p, value in values.items()}
        free = {s for matrix in matrices for s in matrix.free_symbols} - {*self._q, *fixed}
        found = (sp.lambdify([self._q], m.xreplace({**fixed, **dict.fromkeys(free, 0.0)}), "numpy") for m in matrices)
        return [lambda q, f=f: np.atleast_2d(np.asarray(f(q), float)) for f in found]  # type: ignore[misc]


def _shown(item: sp.Expr) -> str:
    """The name of a symbol or of a function of time."""
    return str(item.func if isinstance(item, AppliedUndef) else item)


def _rank(rows: Sequence[Floats]) -> int:
    """The number of independent ``rows`` (n,)."""
    return int(np.linalg.matrix_rank(np.array(rows), tol=_RANK * max(1.0, float(np.abs(rows).max()))))


def _on_manifold(residuals: Callable[[Floats], Floats], slopes: Callable[[Floats], Floats], n: int) -> Floats:
    """A place q (n,) where the residuals vanish, by Gauss and Newton from 0 and then from random places."""
    rng = np.random.default_rng(0)
    place = np.zeros(n)
    for trial in range(_TRIALS):
        place = rng.uniform(-0.5, 0.5, n) if trial else np.zeros(n)
        for _ in range(_STEPS):
            value = residuals(place).ravel()
            if not np.isfinite(value).all() or np.abs(value).max() < _MET:
                break
            place = place - np.linalg.lstsq(slopes(place), value, rcond=None)[0]
        if np.isfinite(value).all() and np.abs(value).max() < _NEARLY_MET:
            break
    return place
