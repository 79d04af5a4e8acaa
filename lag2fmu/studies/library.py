"""A mechanism compiled for derivatives through time: the sources of its FMU without those of FMI, called by ctypes."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from lag2fmu.codegen.sources import render_sources
from lag2fmu.description.names import velocity
from lag2fmu.description.outputs import Experiment
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.dynamics.balance import with_balance
from lag2fmu.dynamics.functions import Program
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.dynamics.program import lower
from lag2fmu.ensemble.libraries import KernelLibrary
from lag2fmu.errors import LoadError
from lag2fmu.fmu.compilers import compile_here
from lag2fmu.fmu.method_check import check_solver
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.formats.write import write
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import METHODS

_WITHOUT = {"moreau": "its steps contain impacts, whose times they do not tell"}
"""{solver: why it carries no derivatives along}."""
SOLVERS = tuple(name for name in METHODS if name not in _WITHOUT)
"""The solvers that carry derivatives along."""
USUAL = "dop853"
STATES = ("VARIABLE_STATE", "VARIABLE_MASSLESS")
PARAMETERS = ("VARIABLE_PARAMETER", "VARIABLE_FIXED_PARAMETER")
INPUT, SETTING = "VARIABLE_INPUT", "VARIABLE_SETTING"


@dataclass(frozen=True)
class StudyLibrary:
    """The runs of one mechanism as functions of this process, and the variables it knows.

    ``kinds`` has the kind of each variable, as a number of the engine. ``striking`` are the inputs that strike where
    they jump, because the solver goes on with the momenta, which contain them.
    """

    name: str
    functions: KernelLibrary
    solver: str
    variables: Mapping[str, ScalarVariable]
    kinds: Mapping[str, str]
    experiment: Experiment
    striking: frozenset[str] = frozenset()

    def variable(self, name: str) -> ScalarVariable:
        """The variable ``name``; raises LoadError, with the names near to it, if there is none."""
        if name not in self.variables:
            raise LoadError(f"'{self.name}' has no variable '{name}'; {suggestion(name, self.variables)}")
        return self.variables[name]

    def settable(self, name: str) -> int:
        """The value reference of ``name``, a variable that can be set before a run.

        Raises LoadError for a variable that follows from other values.
        """
        variable, kind = self.variable(name), self.kinds[name]
        if kind not in (*STATES, *PARAMETERS, INPUT, SETTING):
            raise LoadError(f"'{name}' of '{self.name}' follows from other values and cannot be set")
        return variable.value_reference

    def readable(self, names: Sequence[str]) -> list[int]:
        """The value references of ``names``; raises LoadError for unknown names."""
        return [self.variable(name).value_reference for name in names]


def compiled(model: object, *, solver: str | None = None, adjoints: bool = False) -> StudyLibrary:
    """The library of ``model``, a mechanism or what ``load`` takes, with one of SOLVERS, by default the USUAL one.

    With ``adjoints`` it records runs for gradients, and takes longer to compile. Libraries that this process has
    compiled before are reused. Raises LoadError for another solver;
    Lag2FmuError if the model cannot be loaded, derived or compiled.
    """
    if solver in _WITHOUT:
        raise LoadError(f"'{solver}' carries no derivatives: {_WITHOUT[solver]}; take {', '.join(SOLVERS)}")
    if solver is not None and solver not in SOLVERS:
        raise LoadError(f"'{solver}' is no solver that carries derivatives; known are {', '.join(SOLVERS)}")
    return _compiled(_MechanismText(as_mechanism(model)), solver or USUAL, adjoints)


class _MechanismText:
    """A mechanism that is equal to another one if their texts are equal."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.text = mechanism, write(mechanism)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _MechanismText) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)


@cache
def _compiled(source: _MechanismText, solver: str, adjoints: bool) -> StudyLibrary:
    equations, method = derive(source.mechanism), METHODS[solver]
    check_solver(equations.mechanism, method)
    program = with_balance(lower(equations, variational=method.variational))
    mechanism = with_derived(source.mechanism, equations)
    table = build_table(equations, program)
    program = with_adjoints(program) if adjoints else program
    texts = render_sources(program, table.tables, method, "study", "study")
    return StudyLibrary(
        mechanism.name,
        KernelLibrary(compile_here(texts, "study"), f"study{host_platform().suffix}"),
        solver,
        {v.name: v for v in table.variables},
        {v.name: table.tables.slots[v.value_reference].kind for v in table.variables},
        mechanism.experiment,
        _striking(source.mechanism, program),
    )


def _striking(mechanism: Mechanism, program: Program) -> frozenset[str]:
    """The inputs of motions that the momenta, or the constraints with them, of a variational method contain."""
    found = next((f for f in program.functions if f.name == "mechanism_balance"), None)
    nodes = [node for array, _, node in found.results if array in {"m", "phi", "v"}] if found else []
    motions = {name for y in mechanism.driven for name in (y, velocity(y))}
    return frozenset(motions & program.graph.symbols(nodes) & set(program.inputs))


# ------------------------------------------------------------------------------------------------------------ running


class _Request(ctypes.Structure):
    """``Request`` of templates/engine/drivers/study/study.h."""

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


@dataclass(frozen=True)
class KnotSignals:
    """Inputs over time: value references (i,), knots (k,) in s, values (k, i) in SI; held between knots or linear."""

    references: tuple[int, ...]
    knots: np.ndarray[Any, Any]
    values: np.ndarray[Any, Any]
    hold: bool = False


class Study:
    """Memory in which runs of a library take place, one after the other; for one thread at a time."""

    def __init__(self, library: StudyLibrary, directions: int = 0) -> None:
        """Allocate the memory for derivatives along ``directions`` directions; raises MemoryError if there is none."""
        self.library, self.directions = library, directions
        self._reset, self._set, self._seed = (self.function(f"study_{name}") for name in ("reset", "set", "seed"))
        self._run = self.function("study_run", ctypes.c_int)
        self._message = self.function("study_message", ctypes.c_char_p)
        self._free = self.function("study_free")
        self.handle = ctypes.c_void_p(self.function("study_new", ctypes.c_void_p)(directions))
        if not self.handle.value:
            raise MemoryError(f"no memory for a study of '{library.name}' with {directions} directions")

    def function(self, name: str, result: Any = None) -> Any:
        """A function of the library, by its name in C."""
        function: Any = self.library.functions.function(name)
        function.restype = result
        return function

    def __del__(self) -> None:
        """Give the memory back."""
        if getattr(self, "handle", None):
            self._free(self.handle)

    def run(
        self,
        values: Mapping[int, float],
        times: np.ndarray[Any, Any],
        outputs: Sequence[int],
        *,
        tolerance: float,
        start: float = 0.0,
        signals: KnotSignals | None = None,
        seeds: Sequence[tuple[int, float]] = (),
    ) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], str]:
        """One run from ``start`` (s) with ``values`` {value reference: SI value} to the last of the ``times`` (m,).

        Returns the ``outputs`` (value references) at the times, (m, k); their derivatives along the ``seeds`` (value
        reference, typical size of its change), (m, k, d); and "", or the reason why the run ended early. Rows behind
        the end are NaN.
        """
        found = np.full((len(times), len(outputs)), np.nan)
        slopes = np.full((len(times), len(outputs), self.directions), np.nan)
        self.begin(values, seeds)
        request = PreparedRequest(
            times, outputs, found, start=start, tolerance=tolerance, signals=signals, slopes=slopes
        )
        reached = self._run(self.handle, ctypes.byref(request.request))
        if reached == len(times):
            return found, slopes, ""
        found[reached:], slopes[reached:] = np.nan, np.nan
        return found, slopes, self.message

    def begin(self, values: Mapping[int, float], seeds: Sequence[tuple[int, float]]) -> None:
        """Before a run: start values, and those that are given; see ``run``."""
        references = (ctypes.c_int * len(values))(*values)
        self._reset(self.handle)
        self._set(self.handle, len(values), references, (ctypes.c_double * len(values))(*values.values()))
        for i, (reference, scale) in enumerate(seeds):
            self._seed(self.handle, i, reference, ctypes.c_double(1.0), ctypes.c_double(scale))

    @property
    def message(self) -> str:
        """Why the last run ended early, "" if it did not."""
        return str(self._message(self.handle).decode("utf-8", "replace"))


class PreparedRequest:
    """What a run is asked for, with the arrays that its ``request`` points to; the arguments are those of ``run``."""

    def __init__(
        self,
        times: np.ndarray[Any, Any],
        outputs: Sequence[int],
        values: np.ndarray[Any, Any],
        *,
        start: float,
        tolerance: float,
        signals: KnotSignals | None,
        slopes: np.ndarray[Any, Any] | None = None,
    ) -> None:
        """A request whose results come to ``values`` (m, k) and, if it is given, ``slopes`` (m, k, d)."""
        times = np.ascontiguousarray(times, dtype=float)
        wanted = np.asarray(outputs, dtype=np.intc)
        self._kept = [times, wanted, values, slopes]
        self.request = request = _Request(
            start=start,
            tolerance=tolerance,
            n_times=len(times),
            times=times.ctypes.data,
            n_outputs=len(wanted),
            outputs=wanted.ctypes.data,
            values=values.ctypes.data,
            slopes=None if slopes is None else slopes.ctypes.data,
        )
        if signals is not None:
            inputs = np.asarray(signals.references, dtype=np.intc)
            knots, columns = (np.ascontiguousarray(x, dtype=float) for x in (signals.knots, signals.values))
            request.n_inputs, request.inputs = len(inputs), inputs.ctypes.data
            request.n_knots, request.knots = len(knots), knots.ctypes.data
            request.signals, request.hold = columns.ctypes.data, int(signals.hold)
            self._kept += [inputs, knots, columns]
