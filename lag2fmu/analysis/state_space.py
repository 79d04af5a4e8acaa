"""A linearization as other tools take it: matrices with names, units and operating point, and its poles.

Source: K. J. Astrom, R. M. Murray, Feedback Systems, Princeton 2008, sections 5.3 (linear models) and 6.3 (poles).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lag2fmu.errors import DerivationError, ExportError
from lag2fmu.graph.batches import Floats, Values
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism

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
        """The damping ratio: from 1 on the motion decays without vibrating, with 0 it does not decay.

        NaN for a pole at 0.
        """
        return 0.0 - self.value.real / abs(self.value) if self.value else float("nan")


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dx/dt = drift + A x + B u and y = C x + D u; x, u, y are deviations from the operating point, in SI units.

    ``states`` (k,), ``inputs`` (r,) and ``outputs`` (o,) carry names, units and the values at the operating point, at
    ``time`` (s). A is (k, k), B (k, r), C (o, k), D (o, r). ``drift`` (k,) is 0 about an equilibrium. Source: K. J.
    Astrom, R. M. Murray, Feedback Systems, Princeton 2008, section 5.3.
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

    def __repr__(self) -> str:
        """One line: the mechanism and the sizes of x, u and y."""
        sizes = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"<StateSpace of {self.name} at t = {self.time:g} s: {sizes}>"

    def __str__(self) -> str:
        """The names of x, u and y with their units, the matrices, and the drift where there is one."""
        lines = [repr(self)]
        for label, entries in (("x", self.states), ("u", self.inputs), ("y", self.outputs)):
            named = (f"{e.name} [{e.unit}]" if e.unit else e.name for e in entries)
            lines.append(f"{label}: {', '.join(named) or 'none'}")
        shown = {label: getattr(self, label) for label in "ABCD"} | ({} if self.resting else {"drift": self.drift})
        for label, matrix in shown.items():
            text = np.array2string(matrix, precision=6, suppress_small=True, max_line_width=120, prefix=f"{label} = ")
            lines.append(f"{label} = {text}")
        return "\n".join(lines)

    @property
    def poles(self) -> tuple[Pole, ...]:
        """The eigenvalues of A in 1/s, by rising frequency; of a pair the one with positive imaginary part is first."""
        found = np.linalg.eigvals(self.A) if len(self.A) else np.zeros(0)
        order = sorted(found, key=lambda x: (round(abs(x), 9), x.real, -x.imag))
        return tuple(Pole(complex(x)) for x in order)

    @property
    def resting(self) -> bool:
        """Whether the operating point rests: the drift is rounding relative to A times a state of size 1."""
        size = np.abs(self.A).max(initial=0.0)
        return bool(np.abs(self.drift).max(initial=0.0) <= 1e-9 * max(size, 1.0))

    def scipy(self) -> Any:
        """A, B, C and D as a ``scipy.signal.StateSpace``, which knows no names."""
        from scipy.signal import StateSpace as Scipy

        return Scipy(self.A, self.B, self.C, self.D)

    def control(self) -> Any:
        """A, B, C and D as a ``control.StateSpace`` of the package python-control, with names.

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


@dataclass(frozen=True, eq=False)
class Linearization:
    """dz/dt = A z + B u and y = C z + D u about the state ``values`` {variable: SI value}.

    - ``states``: the names of the k states z: independent coordinates and velocities, then further states.
    - ``inputs``: names of u (r,); ``outputs``: names of y (o,).
    - A (k, k), B (k, r), C (o, k), D (o, r), in SI units.
    - ``drift``: dz/dt at the state itself, (k,), which is 0 at rest in equilibrium; ``level``: y there, (o,).
    - ``shape``: the change of all of q, qd and the f further states with each z, (2 n + f, k).
    - ``mass``, ``damping``, ``stiffness`` (n, n) and ``action`` (n, r): the matrices of
      M d2q + damping dq' + stiffness dq = action u + G^T dmultiplier, before constraints are used.
    - ``tangent``: a basis of the motions that the constraints leave free, (n, number of these).
    - ``mechanism``: the mechanism that was linearized.
    """

    mechanism: Mechanism
    values: Values
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    A: Floats
    B: Floats
    C: Floats
    D: Floats
    drift: Floats
    level: Floats
    shape: Floats
    mass: Floats
    damping: Floats
    stiffness: Floats
    action: Floats
    tangent: Floats

    def __repr__(self) -> str:
        sizes = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"<Linearization of {self.mechanism.name}: {sizes}>"

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """The eigenvalues of A, (k,), in 1/s, by rising imaginary part."""
        found = np.linalg.eigvals(self.A)
        return found[np.lexsort((found.real, found.imag))]

    def state_space(self, inputs: Sequence[str] | None = None) -> StateSpace:
        """A, B, C, D with names, units and operating point.

        ``inputs`` are the names of u, by default the inputs of the FMU. Raises DerivationError for a name that is no
        input.
        """
        hidden = self.mechanism.hidden_inputs
        chosen = tuple(name for name in self.inputs if name not in hidden) if inputs is None else tuple(inputs)
        for name in chosen:
            if name not in self.inputs:
                raise DerivationError(
                    f"mechanism '{self.mechanism.name}': '{name}' is no input; {suggestion(name, self.inputs)}"
                )
        columns = [self.inputs.index(name) for name in chosen]
        units = display_units(self.mechanism)

        def quantities(labels: Sequence[str], level: Floats | None = None) -> tuple[Quantity, ...]:
            values = [self.values[x] for x in labels] if level is None else level
            named = zip(labels, values, strict=True)
            return tuple(Quantity(x, units[x].si_name if x in units else "", float(value)) for x, value in named)

        return StateSpace(
            name=self.mechanism.name,
            time=float(self.values["t"]),
            states=quantities(self.states),
            inputs=quantities(chosen),
            outputs=quantities(self.outputs, self.level),
            A=self.A,
            B=self.B[:, columns],
            C=self.C,
            D=self.D[:, columns],
            drift=self.drift,
        )
