"""The equations of a mechanism as plain functions: on NumPy arrays in lanes, and as an external function of CasADi."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lag2fmu.codegen.lanes import render_external, render_function
from lag2fmu.description import names
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.dynamics.plain import KNOWNS, PlainFunctions, plain_functions
from lag2fmu.dynamics.starts import start_values
from lag2fmu.ensemble.libraries import KernelLibrary, built, in_threads, lanes_here
from lag2fmu.errors import ExportError, LoadError
from lag2fmu.fmu.backends.backend import identifier_of
from lag2fmu.fmu.compilers import compile_here
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.leaving_out import leaving_out
from lag2fmu.mechanism.record import Mechanism

Floats = NDArray[np.float64]

_PART = 4096
"""The least number of points for which a further thread is started."""


class StateFunction:
    """dx/dt = f(t, x, u, p) of a mechanism, with exact Jacobians; all values in SI units.

    x has the coordinates, their velocities and the further states; u the inputs, generalized forces Q first; p the
    independent parameters. ``names`` is {"x", "u", "p": names of the entries}, and ``start`` is {"t", "x", "u", "p":
    values at the start of the mechanism}.
    """

    def __init__(
        self,
        model: Mechanism | str | Path,
        *,
        without: str | Sequence[str] = (),
        outputs: Sequence[str] = (),
        lanes: int | None = None,
        compiler: str = "zig",
        values: Mapping[str, float] | None = None,
    ) -> None:
        """Derive ``model``, a mechanism or what ``load`` takes; the first call compiles it.

        So does the first call of ``jacobians``, which derives them as well and takes longer.

        ``outputs`` are the names of the o variables that ``outputs`` gives; any variable may be among them, as
        accelerations and multipliers. ``without`` are words of OMISSIBLE for what is left out, such as "friction",
        because it makes events. ``lanes``, ``compiler`` and ``values`` are as for ``Ensemble``. Raises LoadError, and
        DerivationError for mechanisms with events or coordinates without mass.
        """
        mechanism = leaving_out(as_mechanism(model, values), without)
        self._equations = equations = derive(mechanism)
        self._wanted = tuple(outputs)
        self._rates = plain_functions(equations, jacobian=False, outputs=self._wanted)
        self._lane_count, self._compiler = lanes, compiler
        self.mechanism = equations.mechanism
        q = [c.name for c in self.mechanism.coordinates]
        self.names = {
            "x": (*q, *map(names.velocity, q), *(z.name for z in self.mechanism.states)),
            "u": self._rates.program.inputs,
            "p": tuple(p.name for p in self.mechanism.parameters if p.value is not None),
        }
        values = start_values(self.mechanism)
        self.start = {"t": np.zeros(())} | {
            known: np.array([values.get(name, 0.0) for name in entries]) for known, entries in self.names.items()
        }

    def __repr__(self) -> str:
        """One line: the mechanism and the sizes of x, u and p."""
        sizes = ", ".join(f"{len(entries)} {known}" for known, entries in self.names.items())
        return f"<StateFunction of {self.mechanism.name}: {sizes}>"

    def __getstate__(self) -> dict[str, object]:
        """The state without the loaded library; another process compiles it for its own processor."""
        return {name: value for name, value in vars(self).items() if name not in {"_derivative", "_jacobian"}}

    @property
    def sparsity(self) -> dict[str, NDArray[np.bool_]]:
        """Which entries of the Jacobians by "t", "x", "u", "p" are not always zero: (N, 1), (N, N), (N, m), (N, k).

        Rows of the outputs stand behind them.
        """
        found = {}
        for known in KNOWNS:
            found[known] = np.zeros((self._rows, self._size(known)), dtype=bool)
            for place in self._functions.sparsity[known]:
                found[known][place] = True
        return found

    def __call__(
        self, x: ArrayLike, u: ArrayLike | None = None, p: ArrayLike | None = None, t: ArrayLike = 0.0
    ) -> Floats:
        """dx/dt, (..., N), at states ``x`` (..., N), inputs ``u`` (..., m), parameters ``p`` (..., k), times ``t``.

        The times have the shape (...) in s. The leading dimensions broadcast. ``u`` and ``p`` are by default those of
        the start. The result is NaN at singular positions. Raises LoadError for shapes that do not fit.
        """
        return self._evaluate(t, x, u, p, jacobian=False)[..., : len(self.names["x"])]

    def outputs(
        self, x: ArrayLike, u: ArrayLike | None = None, p: ArrayLike | None = None, t: ArrayLike = 0.0
    ) -> Floats:
        """The outputs (..., o) that were asked for, in SI units; the arguments are those of the call of the object.

        Raises LoadError for shapes that do not fit.
        """
        return self._evaluate(t, x, u, p, jacobian=False)[..., len(self.names["x"]) :]

    def accelerations(
        self, x: ArrayLike, u: ArrayLike | None = None, p: ArrayLike | None = None, t: ArrayLike = 0.0
    ) -> Floats:
        """The accelerations (..., n), which are entries of dx/dt; the arguments are those of the call of the object."""
        n = len(self.mechanism.coordinates)
        return self(x, u, p, t)[..., n : 2 * n]

    def jacobians(
        self, x: ArrayLike, u: ArrayLike | None = None, p: ArrayLike | None = None, t: ArrayLike = 0.0
    ) -> dict[str, Floats]:
        """The derivatives of dx/dt by "t", "x", "u", "p": (..., N, 1), (..., N, N), (..., N, m), (..., N, k).

        Rows of the outputs stand behind them, (..., N + o, 1) and so on.

        The arguments are those of the call of the object. Raises LoadError for shapes that do not fit.
        """
        entries = self._evaluate(t, x, u, p, jacobian=True)
        found, first = {}, 0
        for known in KNOWNS:
            places = self._functions.sparsity[known]
            matrix = np.zeros((*entries.shape[:-1], self._rows, self._size(known)))
            if places:
                rows, columns = zip(*places, strict=True)
                matrix[..., list(rows), list(columns)] = entries[..., first : first + len(places)]
            found[known] = matrix
            first += len(places)
        return found

    def external(self, folder: str | Path = ".", name: str | None = None) -> Path:
        """Write the function for CasADi to ``folder``, as C sources and a library; return the path of the library.

        ``casadi.external(name, str(path))`` loads f(t, x, u, p) with its Jacobians, from which CasADi makes forward and
        adjoint derivatives. ``name`` is by default that of the mechanism. Raises ExportError and BuildError.
        """
        name = identifier_of(name or self.mechanism.name)
        sources = render_external(self._functions, name, self.names)
        path = Path(folder) / f"{name}{host_platform().suffix}"
        library = compile_here(sources, name, self._compiler)
        try:
            for file, text in sources.items():
                (path.parent / file).write_text(text, "utf-8", newline="\n")
            path.write_bytes(library)
        except OSError as error:
            raise ExportError(f"cannot write '{path}': {error.strerror or error}; choose another folder") from error
        return path

    @property
    def _rows(self) -> int:
        return len(self.names["x"]) + len(self._wanted)

    def _size(self, known: str) -> int:
        return 1 if known == "t" else len(self.names[known])

    @cached_property
    def _functions(self) -> PlainFunctions:
        return plain_functions(self._equations, outputs=self._wanted)

    @cached_property
    def _derivative(self) -> KernelLibrary:
        return self._built(jacobian=False)

    @cached_property
    def _jacobian(self) -> KernelLibrary:
        return self._built(jacobian=True)

    def _built(self, *, jacobian: bool) -> KernelLibrary:
        lanes = self._lane_count or lanes_here(self._compiler)
        functions = self._functions if jacobian else self._rates
        sources = render_function(functions, self.mechanism.name, lanes, jacobian=jacobian)
        return built(sources, "function", self._compiler)

    def _evaluate(
        self, t: ArrayLike, x: ArrayLike, u: ArrayLike | None, p: ArrayLike | None, *, jacobian: bool
    ) -> Floats:
        given = {"t": _numbers("t", t)[..., None]}
        for known, value in (("x", x), ("u", u), ("p", p)):
            array = _numbers(known, self.start[known] if value is None else value)
            if array.shape[-1:] != (len(self.names[known]),):
                raise LoadError(f"{known} has shape {array.shape}; expected (..., {len(self.names[known])})")
            given[known] = array
        try:
            batch = np.broadcast_shapes(*(array.shape[:-1] for array in given.values()))
        except ValueError as error:
            shapes = ", ".join(f"{known} {array.shape}" for known, array in given.items())
            raise LoadError(f"the leading dimensions do not broadcast: {shapes}") from error
        count = int(np.prod(batch))
        arrays, strides = zip(*(_points(array, batch, count) for array in given.values()), strict=True)
        width = sum(map(len, self._functions.sparsity.values())) if jacobian else self._rows
        results = np.empty((count, width))
        _call(self._jacobian if jacobian else self._derivative, arrays, strides, results)
        return results.reshape(*batch, width)


def _numbers(known: str, value: ArrayLike) -> Floats:
    """The ``value`` of ``known`` as an array; raises LoadError for texts, and rows of different lengths."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise LoadError(f"{known} = {value!r:.60}: expected numbers of equal rows ({error})") from error


def _points(array: Floats, batch: tuple[int, ...], count: int) -> tuple[Floats, int]:
    """(rows, stride) of ``array`` (..., k): a row for each point and k, or one row and 0 if all points share it."""
    if array.ndim == 1 or array.size == array.shape[-1]:
        return np.ascontiguousarray(array.reshape(-1)), 0
    rows = np.broadcast_to(array, (*batch, array.shape[-1])).reshape(count, array.shape[-1])
    return np.ascontiguousarray(rows), array.shape[-1]


class _Points(ctypes.Structure):
    """The struct Points of function_batch.c."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("first", "end")),
        *((name, ctypes.c_void_p) for name in KNOWNS),
        ("strides", ctypes.c_int64 * 4),
        ("results", ctypes.c_void_p),
    )


def _call(library: KernelLibrary, arrays: Sequence[Floats], strides: Sequence[int], results: Floats) -> None:
    """Compute all points, many of them in several threads."""
    function, count = library.function("function_values"), len(results)
    parts = max(1, min(os.cpu_count() or 1, count // _PART))
    pointers = [array.ctypes.data for array in arrays]

    def work(part: int) -> None:
        ends = (part * count // parts, (part + 1) * count // parts)
        function(ctypes.byref(_Points(*ends, *pointers, (ctypes.c_int64 * 4)(*strides), results.ctypes.data)))

    in_threads(work, range(parts))


def function(
    model: Mechanism | str | Path,
    *,
    without: str | Sequence[str] = (),
    outputs: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
) -> StateFunction:
    """The equations of ``model`` as plain functions, see ``StateFunction``; ``outputs`` are names of o variables.

    ``without`` leaves out what makes events: "friction", "stops", "contacts", one word or several. ``values`` are other
    parameters and starts in SI units, those of ``start``. Raises LoadError and DerivationError; the latter names what
    makes events, and the word that leaves it out.
    """
    return StateFunction(model, without=without, outputs=outputs, values=values)
