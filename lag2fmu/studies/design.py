"""Which runs a sweep makes: the full grid of what varies, or a sample of it; and the records of such runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod
from numbers import Integral
from typing import Any, Literal

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.reference.trajectory import Floats
from lag2fmu.verify.run import Run

MOST_RUNS = 10_000_000
"""Runs of a sweep, at most: with ten numbers of each they take a gigabyte."""
SAMPLINGS = ("random", "sobol", "halton", "latin")


@dataclass(frozen=True, eq=False)
class Axis:
    """One thing that varies: ``names`` (k) with ``values`` (n, k) in SI, or a range from ``low`` to ``high``.

    Several names on one axis vary together, as the columns of a table do.
    """

    names: tuple[str, ...]
    values: Floats | None = None
    low: float = 0.0
    high: float = 0.0


@dataclass(frozen=True, eq=False)
class Design:
    """The runs of a sweep: ``names`` (k), ``values`` (runs, k) in SI.

    ``shape`` has the lengths of the ``axes`` of a full grid, in whose order the runs stand, and is () for a sample.
    """

    names: tuple[str, ...]
    values: Floats
    axes: tuple[Axis, ...]
    shape: tuple[int, ...]

    def __len__(self) -> int:
        """The number of runs."""
        return len(self.values)


def axes_of(vary: Mapping[Any, Any]) -> tuple[Axis, ...]:
    """The axes that ``vary`` describes, with values in SI units.

    {name: values (n,)} is a list of values. {name: (low, high)}, a tuple of two, is a range for sampling.
    {(name, ...): table (n, k)} are columns that vary together. Raises LoadError for anything else, and for a name that
    stands twice.
    """
    axes = tuple(axis if isinstance(axis, Axis) else _axis(key, axis) for key, axis in vary.items())
    names = [name for axis in axes for name in axis.names]
    if not names:
        raise LoadError("nothing varies; name a parameter, start or input with its values")
    for i, name in enumerate(names):
        if name in names[:i]:
            raise LoadError(f"'{name}' varies twice; give it once")
    return axes


def _axis(key: Any, values: Any) -> Axis:
    names = (key,) if isinstance(key, str) else tuple(key)
    label = ", ".join(map(str, names))
    try:
        if isinstance(values, tuple) and len(values) == 2 and len(names) == 1:
            low, high = (float(x) for x in values)
            if not low < high:
                raise LoadError(f"the range of '{label}', {low:g} to {high:g}, is empty")
            return Axis(names, None, low, high)
        table = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        raise LoadError(f"the values of '{label}' are no numbers: {values!r:.60}") from None
    table = table[:, None] if table.ndim == 1 else table
    if table.ndim != 2 or table.shape[1] != len(names) or not len(table):
        raise LoadError(f"the values of '{label}' have shape {np.shape(values)}; give (n,), or (n, k) for k names")
    return Axis(names, table)


def check_count(count: int) -> None:
    """Raise LoadError for a ``count`` of runs that no memory holds."""
    if count > MOST_RUNS:
        raise LoadError(f"{count} runs are asked for; give at most {MOST_RUNS}, or sample some of them")


def grid(axes: Sequence[Axis]) -> Design:
    """All combinations, the last axis varying fastest; raises LoadError for a range without a number of values."""
    tables = []
    for axis in axes:
        if axis.values is None:
            raise LoadError(
                f"'{axis.names[0]}' has a range from {axis.low:g} to {axis.high:g} and no number of values; "
                "give the number, or how many runs to sample"
            )
        tables.append(axis.values)
    shape = tuple(map(len, tables))
    check_count(prod(shape))
    places = np.unravel_index(np.arange(prod(shape)), shape)
    columns = [table[place] for table, place in zip(tables, places, strict=True)]
    return Design(_names(axes), np.concatenate(columns, axis=1), tuple(axes), shape)


def sampled(axes: Sequence[Axis], count: int, sampling: str = "random", seed: int = 0) -> Design:
    """``count`` runs with any value of a range, or any row of values and tables, all with equal probability.

    ``sampling`` is "random", or quasi-random: "sobol", "halton" (both scrambled), "latin" (hypercube). Raises LoadError
    for another ``sampling``, for a ``count`` below 1, and for a ``seed`` that is no whole number of at least 0.
    Source: A. B. Owen, Scrambled Sobol and Niederreiter-Xing points, J. Complexity 14, 1998.
    """
    if sampling not in SAMPLINGS:
        raise LoadError(f"unknown sampling '{sampling}'; known are {', '.join(SAMPLINGS)}")
    if count < 1:
        raise LoadError(f"{count} runs are to be sampled; give at least 1")
    if not isinstance(seed, Integral) or seed < 0:
        raise LoadError(f"the seed of a sample is {seed!r}; give a whole number of at least 0")
    check_count(count)
    columns = []
    for axis, u in zip(axes, _unit_points(len(axes), count, sampling, seed).T, strict=True):
        if axis.values is None:
            columns.append((axis.low + u * (axis.high - axis.low))[:, None])
        else:
            columns.append(axis.values[np.minimum((u * len(axis.values)).astype(int), len(axis.values) - 1)])
    return Design(_names(axes), np.concatenate(columns, axis=1), tuple(axes), ())


def _unit_points(dimension: int, count: int, sampling: str, seed: int) -> Floats:
    """Points in the unit cube, (count, dimension)."""
    if sampling == "random":
        return np.random.default_rng(seed).random((count, dimension))
    from scipy.stats import qmc

    engines = {"sobol": qmc.Sobol, "halton": qmc.Halton, "latin": qmc.LatinHypercube}
    engine = engines[sampling](dimension, seed=seed)
    if sampling != "sobol":
        return np.asarray(engine.random(count))
    return np.asarray(engine.random_base2(max(0, (count - 1).bit_length())))[:count]  # balanced at 2^k


def _names(axes: Sequence[Axis]) -> tuple[str, ...]:
    return tuple(name for axis in axes for name in axis.names)


ModelKind = Literal["mechanism", "fmu", "system"]


@dataclass(frozen=True, eq=False)
class SweepTask:
    """What the runs of a sweep have in common; plain data, so that it can be sent anywhere.

    ``model`` is the text of a mechanism, or the path of an FMU or of a system, as ``kind`` says; ``files`` are those on
    which its runs depend. ``run`` is what they share, its outputs are read at the ``times`` (s), the last of which is
    the stop time. ``bounds`` {name: (least, greatest)} in SI.
    """

    model: str
    kind: ModelKind
    names: tuple[str, ...]
    times: Floats
    run: Run
    solver: str | None = None
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    threads: int | None = None
    files: tuple[str, ...] = ()

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names that are read."""
        return tuple(self.run.outputs or ())


@dataclass(frozen=True, eq=False)
class TaskResults:
    """The results of some runs: ``values`` (runs, times, outputs) in SI, and why runs failed, {run: sentence}."""

    values: Floats
    reasons: Mapping[int, str]
