"""Normal modes about an equilibrium: frequencies, decay and shapes.

Without damping and gyroscopic forces K s = omega^2 M s on the free motions; else the eigenvalues of A.
Source: Landau, Lifshitz, Mechanics, sections 23 and 25; Goldstein, Classical Mechanics, sections 6.2 and 6.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.analysis.state_space import Linearization
from lag2fmu.analysis.subspaces import independent_rows
from lag2fmu.graph.batches import Floats

_ZERO = 1e-7
"""Frequencies below this share of the greatest are zero up to rounding; it is the root of a rounding error."""


@dataclass(frozen=True, eq=False)
class NaturalMode:
    """The motion q = shape e^(eigenvalue t): ``eigenvalue`` in 1/s, ``shape`` (n,) with the largest entry 1.

    A vibration is one mode, with the eigenvalue of positive imaginary part.
    """

    eigenvalue: complex
    shape: NDArray[np.complex128]

    @property
    def frequency(self) -> float:
        """The angular frequency in rad/s, 0 for a motion that does not vibrate."""
        return abs(self.eigenvalue.imag)


def normal_modes(about: Linearization) -> tuple[NaturalMode, ...]:
    """The modes of a linearization about an equilibrium, by rising frequency (rad/s).

    Without damping and gyroscopic forces K s = omega^2 M s is solved on the f free motions, with the Cholesky factor of
    M. Otherwise the modes are the eigenvectors of A (k, k). Source: Golub, Van Loan, Matrix Computations, 4th edition,
    section 8.7.
    """
    tangent = about.tangent
    M, C, K = (tangent.T @ x @ tangent for x in (about.mass, about.damping, about.stiffness))
    holonomic = len(about.states) == 2 * tangent.shape[1]
    if holonomic and _small(C, M, K) and np.allclose(K, K.T, atol=1e-10 * np.abs(K).max(initial=0.0)):
        found = _undamped(M, (K + K.T) / 2, tangent)
    else:
        found = _damped(about)
    return tuple(sorted(found, key=lambda mode: (round(mode.frequency, 9), -mode.eigenvalue.real)))


def _small(C: Floats, M: Floats, K: Floats) -> bool:
    """Whether the damping C is negligible relative to sqrt(M K)."""
    size = np.sqrt(np.abs(M).max(initial=0.0) * np.abs(K).max(initial=0.0))
    return bool(np.abs(C).max(initial=0.0) <= 1e-12 * size)


def _undamped(M: Floats, K: Floats, tangent: Floats) -> list[NaturalMode]:
    """K s = omega^2 M s; a negative omega^2 is a motion that grows."""
    root = np.linalg.cholesky(M)
    half = np.linalg.solve(root, np.linalg.solve(root, K).T)
    squares, vectors = np.linalg.eigh((half + half.T) / 2)
    greatest = np.abs(squares).max(initial=0.0)
    shapes = _settled(squares, tangent @ np.linalg.solve(root.T, vectors), 1e-9 * greatest)
    modes = []
    for square, shape in zip(squares, shapes.T, strict=True):
        value = 0.0 if abs(square) <= _ZERO**2 * 100 * greatest else square
        eigenvalue = complex(0.0, np.sqrt(value)) if value >= 0 else complex(np.sqrt(-value), 0.0)
        modes.append(NaturalMode(eigenvalue, _normalised(shape.astype(np.complex128))))
    return modes


def _settled(squares: Floats, shapes: Floats, near: float) -> Floats:
    """``shapes`` (n, f) made as simple as possible among modes of equal ``squares`` (f,), which rounding mixes."""
    settled: Floats = shapes.copy()
    first = 0
    for last in range(1, len(squares) + 1):
        if last == len(squares) or squares[last] - squares[last - 1] > near:
            if last - first > 1:
                group = shapes[:, first:last]
                rows = independent_rows(group)
                settled[:, first:last] = group @ np.linalg.inv(group[rows])
            first = last
    return settled


def _damped(about: Linearization) -> list[NaturalMode]:
    """The modes by the eigenvectors of A; of a conjugate pair the one with the positive imaginary part."""
    values, vectors = np.linalg.eig(about.A)
    n = len(about.mass)
    greatest = np.abs(values).max(initial=0.0)
    modes = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag >= -1e-12 * greatest:
            rounded = 0j if abs(value) <= _ZERO * greatest else complex(value)
            modes.append(NaturalMode(rounded, _normalised(about.shape[:n] @ vector)))
    return modes


def _normalised(shape: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """``shape`` (n,) divided by its largest entry, the first one of equals."""
    size = np.abs(shape)
    if not size.max(initial=0.0) > 0:
        return shape
    return np.asarray(shape / shape[int(np.argmax(size > 0.999999 * size.max()))], dtype=np.complex128)
