"""A linearization as other tools take it: matrices with names, units and operating point, and its poles.

Source: K. J. Astrom, R. M. Murray, Feedback Systems, Princeton 2008, sections 5.3 (linear models) and 6.3 (poles).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lag2fmu.errors import ExportError
from lag2fmu.graph.batches import Floats

FORMATS = (".json", ".mat", ".npz")
"""The endings of files that a state space is written to."""


class Quantity(NamedTuple):
    """A state, input or output: its name, SI unit ("" if none is known) and ``value`` at the operating point."""

    name: str
    unit: str
    value: float


class Pole(NamedTuple):
    """An eigenvalue of A in 1/s, with |value| as the ``frequency`` in rad/s and the ``damping`` -Re(value)/|value|."""

    value: complex

    @property
    def frequency(self) -> float:
        """The undamped angular frequency in rad/s."""
        return abs(self.value)

    @property
    def damping(self) -> float:
        """The damping ratio: 1 and more decays without vibrating, 0 does not decay; NaN of a pole at 0."""
        return 0.0 - self.value.real / abs(self.value) if self.value else float("nan")


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dx/dt = drift + A x + B u and y = C x + D u, x, u and y being what differs from the operating point, in SI units.

    ``states`` (k,), ``inputs`` (r,) and ``outputs`` (o,) carry names, units and the values at the operating point, at
    ``time`` (s). A (k, k), B (k, r), C (o, k), D (o, r); ``drift`` (k,) is 0 about an equilibrium.
    """

    name: str
    time: float
    states: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    A: Floats
    B: Floats
    C: Floats
    D: Floats
    drift: Floats

    @property
    def poles(self) -> tuple[Pole, ...]:
        """The eigenvalues of A, by rising frequency, of a pair the one with the positive imaginary part first."""
        found = np.linalg.eigvals(self.A) if len(self.A) else np.zeros(0)
        order = sorted(found, key=lambda x: (round(abs(x), 9), x.real, -x.imag))
        return tuple(Pole(complex(x)) for x in order)

    @property
    def resting(self) -> bool:
        """Whether the operating point stays where it is: no drift beside what A does to a state of size 1."""
        size = np.abs(self.A).max(initial=0.0)
        return bool(np.abs(self.drift).max(initial=0.0) <= 1e-9 * max(size, 1.0))

    def scipy(self) -> Any:
        """The same as a ``scipy.signal.StateSpace``, which knows no names."""
        from scipy.signal import StateSpace as Scipy

        return Scipy(self.A, self.B, self.C, self.D)

    def control(self) -> Any:
        """The same as a ``control.StateSpace`` of the package python-control, names included.

        Raises ExportError where that package is not installed.
        """
        try:
            from control import ss
        except ImportError:
            raise ExportError("the package 'control' is not installed; install it with: pip install control") from None
        labels = {kind: [x.name for x in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        return ss(self.A, self.B, self.C, self.D, name=self.name, **labels)

    def save(self, path: str | Path) -> None:
        """Write it to ``path``, a .json, .mat (MATLAB 5) or .npz (NumPy) file; raises ExportError for another ending.

        They hold A, B, C, D, drift, time; states, inputs and outputs as names, and beside each its units and values.
        """
        path = Path(path)
        if path.suffix not in FORMATS:
            raise ExportError(f"'{path}': its ending must be one of {', '.join(FORMATS)}")
        content: dict[str, Any] = {"name": self.name, "time": self.time}
        content |= {x: getattr(self, x) for x in ("A", "B", "C", "D", "drift")}
        for kind in ("states", "inputs", "outputs"):
            columns = getattr(self, kind)
            content |= {kind: [x.name for x in columns], f"{kind[:-1]}_units": [x.unit for x in columns]}
            content[f"{kind[:-1]}_values"] = np.array([x.value for x in columns])
        try:
            _WRITERS[path.suffix](path, content)
        except OSError as error:
            raise ExportError(f"cannot write '{path}': {error.strerror or error}; choose another place") from error


def _json(path: Path, content: dict[str, Any]) -> None:
    plain = {x: value.tolist() if isinstance(value, np.ndarray) else value for x, value in content.items()}
    lines = (f" {json.dumps(x)}: {json.dumps(value)}" for x, value in plain.items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n", "utf-8")


def _mat(path: Path, content: dict[str, Any]) -> None:
    from scipy.io import savemat

    cells = {x: np.array(value, dtype=object) if isinstance(value, list) else value for x, value in content.items()}
    savemat(path, cells, oned_as="column")


def _npz(path: Path, content: dict[str, Any]) -> None:
    arrays: dict[str, Any] = {x: np.array(value) for x, value in content.items()}
    np.savez(path, **arrays)


_WRITERS = {".json": _json, ".mat": _mat, ".npz": _npz}
