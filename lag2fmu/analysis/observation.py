"""The functions of a mechanism that an observer works with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lag2fmu.analysis.evaluation import operating_inputs
from lag2fmu.analysis.observing import (
    METHODS_OF_OBSERVERS,
    RESOLVED,
    Observing,
    check_estimated,
    check_noise,
    check_process,
    doubt_of,
    hidden_states,
    known_starts,
    residuals_of,
)
from lag2fmu.analysis.subspaces import null_space
from lag2fmu.description.names import velocity
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Function, Program
from lag2fmu.dynamics.plain import KNOWNS, PlainFunctions, plain_functions
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.graph.batches import Floats, evaluate
from lag2fmu.graph.nodes import Node
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Observation:
    """The functions of an observer of n states that measures o variables, under c conditions on its state.

    - ``names`` (n): what is estimated; ``start`` (n,) and ``deviations`` (n,): its start, and how well that is known.
    - ``program`` has ``observed_slopes``, which fills f with the rates (N,) of the states, what is measured (o,) and
      the residuals (c,), and J with their derivatives that are not always zero; ``observed_rates`` and
      ``observed_outputs`` fill the first and the second part of f alone.
    - ``entries``: (row, column) of each J. Rows are those of f; columns are the n states, then the ``process``.
    - ``estimated``: the places of the estimated parameters among all of them.
    - ``noisy``: for each name of the process its place in the state, -1 for an input.
    - ``expected`` (o,): what is measured at the start, in SI units.
    - ``step`` (s): a solver step that resolves the fastest pole at the start.
    - ``hidden``: the names of states of which the samples say nothing, by the equations linearized at the start.
    """

    asked: Observing
    names: tuple[str, ...]
    start: Floats
    deviations: Floats
    program: Program
    entries: tuple[tuple[int, int], ...]
    estimated: tuple[int, ...]
    noisy: tuple[int, ...]
    expected: Floats
    step: float
    hidden: tuple[str, ...]

    @property
    def doubt(self) -> str:
        """A sentence on what is ``hidden``; "" if nothing is."""
        return doubt_of(self.hidden)


def observation(equations: EquationsOfMotion, asked: Observing) -> Observation:
    """The functions that an observer needs of ``equations``.

    Raises LoadError for what is ``asked`` and cannot be, DerivationError for a mechanism with events or coordinates
    without mass, for an unknown variable, and where the equations have no value at the start.
    """
    m = equations.mechanism
    parameters = [p.name for p in m.parameters if p.value is not None]
    _check(asked, parameters, _state_names(m))
    functions = plain_functions(equations, outputs=(*asked.measure, *residuals_of(m)))
    names, inputs = (*_state_names(m), *asked.estimate), functions.program.inputs
    check_process(asked.process, (*names, *inputs))
    places = [parameters.index(name) for name in asked.estimate]
    n, states = len(names), len(names) - len(places)
    noises = {inputs.index(name): n + k for k, name in enumerate(asked.process) if name not in names}
    columns: dict[str, dict[int, int]] = {
        "t": {},
        "x": {i: i for i in range(states)},
        "u": noises,
        "p": dict(zip(places, range(states, n), strict=True)),
    }
    program, entries = _with_columns(functions, columns, states, len(asked.measure))
    values = operating_inputs(equations)
    start = np.array([values[name] for name in names], dtype=np.float64)
    expected, A, H, T = _at_start(program, entries, values, n, states, len(asked.measure))
    fastest = float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))
    return Observation(
        asked=asked,
        names=names,
        start=start,
        deviations=known_starts(m, names, start),
        program=program,
        entries=entries,
        estimated=tuple(places),
        noisy=tuple(names.index(name) if name in names else -1 for name in asked.process),
        expected=expected,
        step=min(m.experiment.step, RESOLVED / fastest if fastest else math.inf),
        hidden=hidden_states(names, A, H, T),
    )


def _check(asked: Observing, parameters: Sequence[str], states: Sequence[str]) -> None:
    """Raise LoadError for what cannot be asked of an observer of a mechanism with these names."""
    if asked.method not in METHODS_OF_OBSERVERS:
        raise LoadError(f"there is no observer '{asked.method}'; known are {', '.join(METHODS_OF_OBSERVERS)}")
    check_noise(asked.measure, asked.sample_times, "sample time")
    check_noise(asked.measure, asked.delays)
    check_estimated(asked.estimate, parameters, states)


def _state_names(mechanism: Mechanism) -> tuple[str, ...]:
    q = [c.name for c in mechanism.coordinates]
    return (*q, *map(velocity, q), *(z.name for z in mechanism.states))


def _with_columns(
    functions: PlainFunctions, columns: Mapping[str, Mapping[int, int]], rates: int, measured: int
) -> tuple[Program, tuple[tuple[int, int], ...]]:
    """The three functions, with the derivatives by these ``columns`` {known: {its entry: column}}, and their places."""
    derivative, jacobian = functions.program.functions
    nodes = [node for array, _, node in jacobian.results if array == "J"]
    places = [(row, columns[known].get(column)) for known in KNOWNS for row, column in functions.sparsity[known]]
    chosen = [(row, column, node) for (row, column), node in zip(places, nodes, strict=True) if column is not None]
    J = [("J", i, node) for i, (*_, node) in enumerate(chosen)]
    first = [item for item in derivative.results if item[0] == "pivots" or item[1] < rates]
    second = [item for item in derivative.results if item[0] == "f" and rates <= item[1] < rates + measured]
    parts = (
        replace(derivative, name="observed_rates", doc="Rates; pivots.", results=tuple(first)),
        replace(derivative, name="observed_outputs", doc="What is measured.", arrays=("f",), results=tuple(second)),
    )
    slopes = Function(
        "observed_slopes",
        "Rates, what is measured, residuals, and their derivatives J by the states and the noise of inputs; pivots.",
        derivative.arguments,
        ("f", "J", "pivots"),
        (*derivative.results, *J),
    )
    return functions.program._replace(functions=(*parts, slopes)), tuple((row, column) for row, column, _ in chosen)


def _at_start(
    program: Program,
    entries: Sequence[tuple[int, int]],
    values: Mapping[str, float | Floats],
    n: int,
    rates: int,
    measured: int,
) -> tuple[Floats, Floats, Floats, Floats]:
    """What is measured (o,), the rates by the state A (n, n), what is measured by it (o, n), and the free motions T."""
    arrays: dict[str, list[Node]] = {"f": [], "J": [], "pivots": []}
    for array, _, node in program.functions[-1].results:
        arrays[array].append(node)
    found = {array: evaluate(program.graph, nodes, values) for array, nodes in arrays.items()}
    f, J = found["f"], found["J"]
    if not (np.isfinite(f).all() and np.isfinite(J).all() and (found["pivots"] > 0).all()):
        raise DerivationError("an observer cannot begin: the equations have no value at the start; start elsewhere")
    whole = np.zeros((len(f), 1 + max((column for _, column in entries), default=0) + n))
    for (row, column), entry in zip(entries, J, strict=True):
        whole[row, column] = entry
    A = np.zeros((n, n))
    A[:rates] = whole[:rates, :n]
    rows = whole[rates + measured :, :n]
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    T = null_space(rows / np.where(length > 0, length, 1.0)) if len(rows) else np.eye(n)
    return f[rates : rates + measured], A, whole[rates : rates + measured, :n], T
