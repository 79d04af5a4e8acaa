"""One mechanism as data: its variables, its equations of motion and the method that integrates them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

Vector = Sequence[float]
Matrix = Sequence[Sequence[float]]

TIME, STATE, ACCELERATION, INPUT = "time", "state", "acceleration", "input"
PARAMETER, SETTING, DEPENDENT, LOCAL = "parameter", "setting", "dependent", "local"
FURTHER_RATE = "further_rate"
"""The kinds of variables; states are (q, qd) with further states behind, whose derivatives are further rates."""


class Unsolvable(Exception):  # noqa: N818
    """The equations have no finite result, or a step of the solver could not be done; the message is a sentence."""

    def __init__(self, sentence: str, singular: bool = False) -> None:
        super().__init__(sentence)
        self.singular = singular


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU: ``index`` in the vector of its ``kind``; start and bounds in ``unit`` (SI)."""

    name: str
    kind: str
    index: int
    start: float = 0.0
    minimum: float = -inf
    maximum: float = inf
    unit: str = ""
    doc: str = ""


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method of s stages.

    k_i = f(t + c_i h, x + h sum_j a_ij k_j),  x_new = x + h sum_i b_i k_i,  error = h sum_i e_i k_i;
    ``a`` holds i weights for stage i = 0 ... s-1; ``e`` is empty for a fixed step. ``second`` are the weights of
    another estimate E' of lower order, or empty: the error then is E^2 / sqrt(E^2 + (E'/10)^2). ``order`` is that of
    x_new, the error is proportional to h^(``error_order`` + 1). Of the step that would just meet the tolerance the part
    ``safety`` is taken.
    """

    order: int
    error_order: int
    safety: float
    a: Sequence[Vector]
    b: Vector
    c: Vector
    e: Vector
    second: Vector

    @property
    def first_same_as_last(self) -> bool:
        """Whether the last stage is the first stage of the next step."""
        return [*self.a[-1], 0.0] == list(self.b) and self.c[-1] == 1.0


@dataclass(frozen=True)
class Model:
    """A mechanism: M(q, t) qdd = f(q, qd, t), and what follows from it.

    ``variables`` are in the order of their value references. ``equations(t, states, inputs, parameters)`` gives M (the
    rows of its lower triangle) and f; ``calculate(..., accelerations)`` the local variables; ``follow(parameters)``
    the dependent parameters. ``nominal`` (n,) is the size of each coordinate, ``default_step`` and
    ``default_duration``, that of the experiment, are in s. Inputs from ``first_motion`` on are prescribed motions: each
    a position, its velocity and its acceleration.
    ``further(..., accelerations)`` gives the derivatives of the further states, (f,), ``nominal_further`` (f,)
    are their sizes. ``kept_inputs`` {index: value} are those inputs that keep their start values, for they are no
    variables.
    """

    name: str
    guid: str
    variables: Sequence[Variable]
    nominal: Vector
    default_step: float
    default_duration: float
    first_motion: int
    tableau: Tableau
    equations: Callable[[float, Vector, Vector, Vector], tuple[Matrix, Vector]]
    calculate: Callable[[float, Vector, Vector, Vector, Vector], Vector]
    follow: Callable[[Vector], Vector]
    further: Callable[[float, Vector, Vector, Vector, Vector], Vector] | None = None
    nominal_further: Vector = ()
    kept_inputs: Mapping[int, float] = field(default_factory=dict)

    def of(self, kind: str) -> list[Variable]:
        """The variables of one kind, by index."""
        return sorted((v for v in self.variables if v.kind == kind), key=lambda v: v.index)

    def starts(self, kind: str) -> list[float]:
        """The start values of one kind, by index; among the inputs those of kept ones, too."""
        found = dict(self.kept_inputs) if kind == INPUT else {}
        found |= {v.index: float(v.start) for v in self.of(kind)}
        return [found[i] for i in sorted(found)]

    def moved(self, inputs: Vector, s: float) -> list[float]:
        """``inputs`` after a time ``s`` (s) in which motions go on as velocity and acceleration say."""
        later = list(inputs)
        for i in range(self.first_motion, len(later), 3):
            y, y_dot, y_ddot = inputs[i : i + 3]
            later[i : i + 2] = y + s * (y_dot + s / 2.0 * y_ddot), y_dot + s * y_ddot
        return later

    @property
    def coordinates(self) -> list[str]:
        """The names of the coordinates, (n,)."""
        return [v.name for v in self.of(STATE)][: len(self.nominal)]
