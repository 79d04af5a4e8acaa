"""Floquet's exponents of small motions about an equilibrium, under a drive that repeats itself.

The monodromy matrix maps z to its value one period later, by dz/dt = A(t) z. It is the product of steps by the Gauss
method of three stages, which is of sixth order. Its eigenvalues are called multipliers. Exponents are
log(multiplier) / period; one with a positive real part means that the equilibrium is unstable.
Source: Landau, Lifshitz, Mechanics, section 27; E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration,
section II.1.3, for the method.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lag2fmu.analysis.evaluation import at, operating_inputs
from lag2fmu.analysis.linearization import linearizer
from lag2fmu.deadline import check_time
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import Floats
from lag2fmu.language.definitions import calls, separated, written_out
from lag2fmu.language.vocabulary import TIME

STEPS = 128
"""Steps a period."""

_ROOT = np.sqrt(15.0)
_NODES = np.array([0.5 - _ROOT / 10, 0.5, 0.5 + _ROOT / 10])
_WEIGHTS = np.array([5, 8, 5]) / 18
_STAGES = np.array(
    [
        [5 / 36, 2 / 9 - _ROOT / 15, 5 / 36 - _ROOT / 30],
        [5 / 36 + _ROOT / 24, 2 / 9, 5 / 36 - _ROOT / 24],
        [5 / 36 + _ROOT / 30, 2 / 9 + _ROOT / 15, 5 / 36],
    ]
)


@dataclass(frozen=True, eq=False)
class Floquet:
    """``period`` in s; ``monodromy`` (k, k) of the independent states; ``multipliers`` (k,), its eigenvalues.

    ``exponents`` (k,) in 1/s, their imaginary parts up to whole multiples of 2 pi / period.
    """

    period: float
    states: tuple[str, ...]
    monodromy: Floats
    multipliers: NDArray[np.complex128]

    @property
    def exponents(self) -> NDArray[np.complex128]:
        """log(multiplier) / period, (k,) in 1/s."""
        found: NDArray[np.complex128] = np.log(self.multipliers) / np.complex128(self.period)
        return found

    @property
    def stable(self) -> bool:
        """Whether small motions do not grow from period to period."""
        return bool(np.abs(self.multipliers).max() <= 1 + 1e-7)


def floquet(
    equations: EquationsOfMotion,
    q: Floats,
    period: float | None = None,
    steps: int = STEPS,
    further: Floats | None = None,
) -> Floquet:
    """Floquet's exponents about the equilibrium q (n,) and the ``further`` states (f,) there, in SI units.

    The ``period``, in s, is read from the model if it is not given. ``steps`` are taken in a period. Raises
    DerivationError if the drive does not repeat itself after the period, or if no period can be read. Source: Landau,
    Lifshitz, Mechanics, section 27; for the steps Hairer, Lubich, Wanner, II.1.3.
    """
    T = drive_period(equations) if period is None else period
    base = at(equations, operating_inputs(equations), q, np.zeros_like(q), further)
    about = linearizer(equations)
    first = about(base | {"t": 0.0})

    def matrix(t: float) -> Floats:
        found = about(base | {"t": t})
        if found.states != first.states:
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': the independent coordinates change with time"
            )
        return found.A

    for t in (0.0, 0.31 * T):
        a, b = matrix(t), matrix(t + T)
        if np.abs(a - b).max() > 1e-8 * np.abs(a).max():
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': the drive does not repeat itself after {T:.6g} s, so that "
                "there are no Floquet exponents; give another period"
            )
    k, h = len(first.states), T / steps
    monodromy = np.eye(k)
    for i in range(steps):
        check_time()
        monodromy = _step([matrix((i + c) * h) for c in _NODES], h) @ monodromy
    multipliers = np.linalg.eigvals(monodromy).astype(np.complex128)
    return Floquet(T, first.states, monodromy, multipliers[np.lexsort((multipliers.imag, -np.abs(multipliers)))])


def _step(matrices: list[Floats], h: float) -> Floats:
    """The matrix (k, k) of one step of length ``h``; ``matrices`` are A at the three nodes."""
    k = len(matrices[0])
    coupled = np.block([[h * _STAGES[i, j] * matrices[i] for j in range(3)] for i in range(3)])
    slopes = np.linalg.solve(np.eye(3 * k) - coupled, np.concatenate(matrices))
    step: Floats = np.eye(k) + h * np.einsum("s,sij->ij", _WEIGHTS, slopes.reshape(3, k, k))
    return step


def drive_period(equations: EquationsOfMotion) -> float:
    """The least common period (s) of the sines and cosines of time in the mechanism.

    Raises DerivationError if there are none, if they have no common period, or if the time stands elsewhere too.
    """
    m = equations.mechanism
    rates = _rates(equations)
    if not rates:
        raise DerivationError(f"mechanism '{m.name}': no sine or cosine of time drives it; give a period")
    slowest = min(rates)
    ratios = [sp.nsimplify(rate / slowest, rational=True, tolerance=1e-10) for rate in rates]
    common = lcm(*(int(r.q) for r in ratios))
    if common > 100:
        raise DerivationError(f"mechanism '{m.name}': its drives have no common period; give one")
    return float(2 * np.pi / slowest * common)


def _rates(equations: EquationsOfMotion) -> set[float]:
    """The angular frequencies (rad/s) of all sines and cosines of time; raises DerivationError for time elsewhere."""
    m = equations.mechanism
    definitions = written_out({d.name: d.expression for d in m.definitions})
    values = _parameter_values(equations)
    rates: set[float] = set()
    for where, expression in m.expressions():
        written = expression.xreplace(definitions)
        parts = [written, *(call.meaning for call in calls([written]))]
        outside = separated(parts)[1]
        for wave in {wave for part in parts for wave in part.atoms(sp.sin, sp.cos)}:
            rate = sp.diff(wave.args[0], TIME)
            if rate != 0:
                outside = [part.xreplace({wave: sp.Dummy()}) for part in outside]
                rates.add(_rate(m.name, where, rate, values))
        if any(part.has(TIME) for part in outside) and not where.startswith(("definitions", "outputs")):
            raise DerivationError(
                f"mechanism '{m.name}': {where} has the time outside of sines and cosines, the drive is not periodic"
            )
    return rates


def _rate(name: str, where: str, rate: sp.Expr, values: dict[sp.Symbol, float]) -> float:
    """The number of an angular frequency (rad/s)."""
    number = rate.xreplace(values)
    if not number.is_number or float(number) == 0:
        raise DerivationError(
            f"mechanism '{name}': {where} has the phase rate {rate}, which is no constant; give a period"
        )
    return abs(float(number))


def _parameter_values(equations: EquationsOfMotion) -> dict[sp.Symbol, float]:
    """All parameters by symbol, dependent ones calculated."""
    known = {p.name: p.value for p in equations.mechanism.parameters if p.value is not None}
    dependent = equations.graph.evaluate(list(equations.dependent.values()), known)
    known |= dict(zip(equations.dependent, dependent, strict=True))
    return {sp.Symbol(name, real=True): sp.Float(value, 17) for name, value in known.items()}
