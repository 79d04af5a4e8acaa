"""A mechanism compiled for studies: the sources of its FMU without FMI, called through ctypes.

A ``Library`` is plain data, so that other processes and machines of the same kind take it along; each loads it once.
"""

from __future__ import annotations

import atexit
import ctypes
import hashlib
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.codegen.sources import render_sources
from lag2fmu.description.names import suggestion
from lag2fmu.description.outputs import Experiment
from lag2fmu.dynamics.lagrange import complete, derive
from lag2fmu.dynamics.program import lower
from lag2fmu.errors import LoadError
from lag2fmu.fmu.advice import check_solver, suited_solver
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library, host_platform
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.formats.write import write
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import METHODS, TimeStepping
from lag2fmu.solvers.tableaus import Tableau

DIRECTED_SOLVERS = tuple(name for name, m in METHODS.items() if isinstance(m, Tableau) and m.error_order > 0)
"""The solvers that carry derivatives along: explicit Runge-Kutta methods under error control."""
STATES = ("VARIABLE_STATE", "VARIABLE_MASSLESS")
PARAMETERS = ("VARIABLE_PARAMETER", "VARIABLE_FIXED_PARAMETER")
INPUT, SETTING = "VARIABLE_INPUT", "VARIABLE_SETTING"


@dataclass(frozen=True)
class Library:
    """Machine code of this kind of computer for the runs of one mechanism, and the variables it knows.

    ``kinds`` has for each variable what it is, as the runtime calls it; ``given`` says of states whether their start
    values are given. ``directed``: the library carries derivatives along.
    """

    name: str
    code: bytes
    suffix: str
    solver: str
    directed: bool
    variables: Mapping[str, ScalarVariable]
    kinds: Mapping[str, str]
    experiment: Experiment

    def variable(self, name: str) -> ScalarVariable:
        """The variable ``name``; raises LoadError, with the names near to it, if there is none."""
        if name not in self.variables:
            raise LoadError(f"'{self.name}' has no variable '{name}'; {suggestion(name, self.variables)}")
        return self.variables[name]

    def settable(self, name: str) -> int:
        """The value reference of ``name``, which is set before a run.

        Raises LoadError for what follows from other values.
        """
        variable, kind = self.variable(name), self.kinds[name]
        if kind not in (*STATES, *PARAMETERS, INPUT, SETTING):
            raise LoadError(f"'{name}' of '{self.name}' follows from other values and cannot be set")
        return variable.value_reference

    def readable(self, names: Sequence[str]) -> list[int]:
        """The value references of ``names``; raises LoadError for unknown names."""
        return [self.variable(name).value_reference for name in names]


def compiled(model: object, *, solver: str | None = None, directed: bool = False) -> Library:
    """The library of ``model``, a mechanism or what ``load`` takes, from ``solver`` or by default one that suits.

    What was compiled before in this process is taken again. Raises Lag2FmuError.
    """
    mechanism = as_mechanism(model)
    known = DIRECTED_SOLVERS if directed else tuple(METHODS)
    if solver is not None and solver not in known:
        what = "solver that carries derivatives" if directed else "solver"
        raise LoadError(f"'{solver}' is no {what}; known are {', '.join(known)}")
    return _compiled(_Source(mechanism), solver, directed)


class _Source:
    """A mechanism that is told from others by its text."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.text = mechanism, write(mechanism)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Source) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)


@cache
def _compiled(source: _Source, solver: str | None, directed: bool) -> Library:
    equations = derive(source.mechanism)
    chosen = solver or (DIRECTED_SOLVERS[-1] if directed else suited_solver(equations, tuple(METHODS))[0])
    method = METHODS[chosen]
    check_solver(equations.mechanism, method)
    program = lower(equations, (), method.variational, isinstance(method, TimeStepping))
    mechanism = complete(source.mechanism, equations)
    table = build_table(equations, program)
    kinds = {v.name: table.tables.slots[v.value_reference].kind for v in table.variables}
    gate = "studies/tangents" if directed else "studies/plain"
    platform = host_platform()
    texts = render_sources(program, table.tables, method, "study", gate)
    code = compile_library(texts, fmi_headers(), "study", replace(platform, targets=_targets(platform.targets)))
    return Library(
        mechanism.name,
        code,
        platform.suffix,
        chosen,
        directed,
        {v.name: replace(v, dependencies=None) for v in table.variables},
        kinds,
        mechanism.experiment,
    )


def _targets(targets: tuple[str, ...]) -> tuple[str, ...]:
    """Of a universal platform the target of this machine alone: the other half would be compiled for nothing."""
    import platform

    machine = {"arm64": "aarch64", "AMD64": "x86_64"}.get(platform.machine(), platform.machine())
    return tuple(target for target in targets if target.startswith(machine)) or targets


# ------------------------------------------------------------------------------------------------------------ running


class _Request(ctypes.Structure):
    """``Request`` of templates/runtime/studies/study.h."""

    _fields_ = (
        ("start", ctypes.c_double),
        ("tolerance", ctypes.c_double),
        ("n_times", ctypes.c_int),
        ("times", ctypes.c_void_p),
        ("n_inputs", ctypes.c_int),
        ("inputs", ctypes.c_void_p),
        ("n_knots", ctypes.c_int),
        ("knots", ctypes.c_void_p),
        ("signals", ctypes.c_void_p),
        ("hold", ctypes.c_int),
        ("n_outputs", ctypes.c_int),
        ("outputs", ctypes.c_void_p),
        ("values", ctypes.c_void_p),
        ("slopes", ctypes.c_void_p),
    )


_loaded: dict[str, Any] = {}


def _load(library: Library) -> Any:
    """The functions of ``library``, which this process loads once."""
    key = hashlib.sha256(library.code).hexdigest()
    if key not in _loaded:
        folder = tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True)
        atexit.register(folder.cleanup)
        path = Path(folder.name, f"study{library.suffix}")
        path.write_bytes(library.code)
        functions = ctypes.CDLL(str(path))
        functions.study_new.restype = ctypes.c_void_p
        functions.study_message.restype = ctypes.c_char_p
        functions.study_run.restype = ctypes.c_int
        _loaded[key] = functions
    return _loaded[key]


@dataclass(frozen=True)
class Signals:
    """Inputs over time: value references (i,), knots (k,) in s, values (k, i) in SI; held between knots or linear."""

    references: tuple[int, ...]
    knots: np.ndarray[Any, Any]
    values: np.ndarray[Any, Any]
    hold: bool = False


class Study:
    """Memory in which runs of a library take place, one after the other; for one thread at a time."""

    def __init__(self, library: Library, directions: int = 0) -> None:
        """Allocate it for derivatives along so many ``directions``."""
        self.library, self.directions = library, directions
        self._functions = _load(library)
        self._handle = ctypes.c_void_p(self._functions.study_new(directions))
        if not self._handle.value:
            raise MemoryError(f"no memory for a study of '{library.name}' with {directions} directions")

    def __del__(self) -> None:
        """Give the memory back."""
        if getattr(self, "_handle", None):
            self._functions.study_free(self._handle)

    def run(
        self,
        values: Mapping[int, float],
        times: np.ndarray[Any, Any],
        outputs: Sequence[int],
        *,
        tolerance: float,
        start: float = 0.0,
        signals: Signals | None = None,
        seeds: Sequence[tuple[int, float]] = (),
    ) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], str]:
        """One run from ``start`` (s) with ``values`` {value reference: SI value} to the last of the ``times`` (m,).

        Returns the ``outputs`` (value references) at the times, (m, k), their derivatives along the ``seeds`` (value
        reference, typical size of its change), (m, k, d), and "" or why the run ended early: rows behind are NaN.
        """
        functions, handle = self._functions, self._handle
        references = (ctypes.c_int * len(values))(*values)
        found = np.full((len(times), len(outputs)), np.nan)
        slopes = np.full((len(times), len(outputs), self.directions), np.nan)
        times = np.ascontiguousarray(times, dtype=float)
        wanted = np.asarray(outputs, dtype=np.intc)
        functions.study_reset(handle)
        functions.study_set(handle, len(values), references, (ctypes.c_double * len(values))(*values.values()))
        for i, (reference, scale) in enumerate(seeds):
            functions.study_seed(handle, i, reference, ctypes.c_double(1.0), ctypes.c_double(scale))
        request = _Request(
            start=start,
            tolerance=tolerance,
            n_times=len(times),
            times=times.ctypes.data,
            n_outputs=len(wanted),
            outputs=wanted.ctypes.data,
            values=found.ctypes.data,
            slopes=slopes.ctypes.data,
        )
        if signals is not None:
            inputs = np.asarray(signals.references, dtype=np.intc)
            knots, columns = (np.ascontiguousarray(x, dtype=float) for x in (signals.knots, signals.values))
            request.n_inputs, request.inputs = len(inputs), inputs.ctypes.data
            request.n_knots, request.knots = len(knots), knots.ctypes.data
            request.signals, request.hold = columns.ctypes.data, int(signals.hold)
        reached = functions.study_run(handle, ctypes.byref(request))
        if reached == len(times):
            return found, slopes, ""
        found[reached:], slopes[reached:] = np.nan, np.nan
        return found, slopes, functions.study_message(handle).decode("utf-8", "replace")
