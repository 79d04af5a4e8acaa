"""A linearization as other tools take it: matrices with names, units and operating point, and its poles.

Source: K. J. Astrom, R. M. Murray, Feedback Systems, Princeton 2008, sections 5.3 (linear models) and 6.3 (poles).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lag2fmu.analysis.state_files import write_matrices
from lag2fmu.analysis.subspaces import SHARE, complement, reached
from lag2fmu.errors import DerivationError, ExportError
from lag2fmu.graph.batches import Floats, Values
from lag2fmu.language.given import check_names, within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism


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


class Hidden(NamedTuple):
    """The part of a state space that inputs cannot move, or outputs do not show.

    ``states`` are the names of the states with a share in it, ``poles`` those of its own motion.
    """

    states: tuple[str, ...]
    poles: tuple[Pole, ...]


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dx/dt = drift + A x + B u and y = C x + D u; x, u, y are deviations from the operating point, in SI units.

    With a sample time ``step`` (s) it is x at the next sample = drift + A x + B u, with u held until then.

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
    step: float | None = None

    def __repr__(self) -> str:
        """One line: the mechanism and the sizes of x, u and y."""
        sizes = f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        sampled = "" if self.step is None else f", sampled every {self.step:g} s"
        return f"<StateSpace of {self.name} at t = {self.time:g} s{sampled}: {sizes}>"

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
        """The eigenvalues of A in 1/s, by rising frequency; of a pair the one with positive imaginary part is first.

        Those z of sampled matrices are told as log(z)/step: the poles of the motion between the samples.
        """
        return self._poles(self.A)

    @property
    def resting(self) -> bool:
        """Whether the operating point rests: the drift is rounding relative to A times a state of size 1."""
        size = np.abs(self.A).max(initial=0.0)
        return bool(np.abs(self.drift).max(initial=0.0) <= 1e-9 * max(size, 1.0))

    @property
    def uncontrollable(self) -> Hidden:
        """The states that no input moves alone, and the poles that stay as they are whatever the inputs do.

        A state is controllable if the inputs can move it and leave all others where they are. Source: K. J. Astrom, R.
        M. Murray, Feedback Systems, Princeton 2008, sections 6.1 and 7.3 (Kalman's decomposition).
        """
        return self._hidden(self.A.T, complement(reached(self.A, self.B)))

    @property
    def unobservable(self) -> Hidden:
        """The states that do not follow from the outputs as time goes on, and the poles of what is not seen.

        Source: K. J. Astrom, R. M. Murray, Feedback Systems, Princeton 2008, sections 7.1 and 7.3.
        """
        return self._hidden(self.A, complement(reached(self.A.T, self.C.T)))

    def sampled(self, step: float) -> StateSpace:
        """The matrices of the samples every ``step`` (s), with inputs and drift held between them; exact for these.

        Raises DerivationError for a step that is not positive, and for matrices that are sampled already. Source: C.
        Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23
        (1978).
        """
        from scipy.linalg import expm

        if self.step is not None:
            raise DerivationError(f"'{self.name}' is sampled already, every {self.step:g} s; sample the original")
        if not within(step, above=0):
            raise DerivationError(f"the sample time {step!r} s is not positive; give one in s, such as 0.01")
        k, r = self.B.shape
        whole = np.zeros((k + r + 1, k + r + 1))
        whole[:k] = np.column_stack([self.A, self.B, self.drift]) * step
        found = expm(whole)[:k]
        return replace(self, A=found[:, :k], B=found[:, k : k + r], drift=found[:, -1], step=float(step))

    def scipy(self) -> Any:
        """A, B, C and D as a ``scipy.signal.StateSpace``, which knows no names; ``dt`` is the sample time."""
        from scipy.signal import StateSpace as Scipy

        sampling = {} if self.step is None else {"dt": self.step}
        return Scipy(self.A, self.B, self.C, self.D, **sampling)

    def control(self) -> Any:
        """A, B, C and D as a ``control.StateSpace`` of the package python-control, with names and sample time.

        Raises ExportError where that package is not installed.
        """
        try:
            from control import ss
        except ImportError:
            raise ExportError("the package 'control' is not installed; install it with: pip install control") from None
        labels = {kind: [x.name for x in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        sampling = () if self.step is None else (self.step,)
        return ss(self.A, self.B, self.C, self.D, *sampling, name=self.name, **labels)

    def save(self, path: str | Path) -> None:
        """Write it to ``path``, a .json, .mat (MATLAB 5) or .npz (NumPy) file; raises ExportError for another ending.

        They hold A, B, C, D, drift, time, the step of samples; states, inputs and outputs as names, and beside each its
        units and values.
        """
        content: dict[str, Any] = {"name": self.name, "time": self.time}
        content |= {} if self.step is None else {"step": self.step}
        content |= {x: getattr(self, x) for x in ("A", "B", "C", "D", "drift")}
        for kind in ("states", "inputs", "outputs"):
            columns = getattr(self, kind)
            content |= {kind: [x.name for x in columns], f"{kind[:-1]}_units": [x.unit for x in columns]}
            content[f"{kind[:-1]}_values"] = np.array([x.value for x in columns])
        write_matrices(path, content)

    def _poles(self, A: Floats) -> tuple[Pole, ...]:
        found = np.linalg.eigvals(A).astype(complex)
        if self.step is not None:
            found = np.log(np.where(found == 0, 1e-300, found)) / self.step
        order = sorted(found, key=lambda x: (round(abs(x), 9), x.real, -x.imag))
        return tuple(Pole(complex(x)) for x in order)

    def _hidden(self, A: Floats, basis: Floats) -> Hidden:
        """What is hidden in the span of ``basis`` (k, j), which A (k, k) maps to itself."""
        sharing = np.abs(basis).max(axis=1, initial=0.0) > SHARE
        states = tuple(x.name for x, shares in zip(self.states, sharing, strict=True) if shares)
        return Hidden(states, self._poles(basis.T @ A @ basis))


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
        if inputs is not None:
            check_names("inputs", inputs)
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
