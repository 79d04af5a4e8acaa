"""A mechanism compiled for batches, built once and run many times."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lag2fmu.codegen.lanes import LaneMethod, render_lanes, render_scalar, runs_in_lanes
from lag2fmu.dynamics.lagrange import complete, derive
from lag2fmu.dynamics.program import lower
from lag2fmu.ensemble.asking import Asked, batch_of, motions_alone, names_of
from lag2fmu.ensemble.batch import DONE, FAILED, REASON, Batch, run_batch
from lag2fmu.ensemble.columns import columns_of
from lag2fmu.ensemble.libraries import Library, built, lanes_here
from lag2fmu.ensemble.results import Runs
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.advice import suited_solver
from lag2fmu.fmu.event_variables import event_names
from lag2fmu.fmu.method_check import check_solver
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import METHODS, TimeStepping

Values: TypeAlias = "Mapping[str, ArrayLike]"


class Ensemble:
    """The equations of a mechanism compiled for batches of runs, with one solver.

    Runs go in lanes of vector registers where the motion is smooth and the solver is explicit; the others, and those
    that come to a singular position, take the runtime of the FMU one by one. Either way they agree with the FMU within
    the tolerance. A run gives the same bits whatever runs beside it and however many threads there are.
    """

    def __init__(
        self,
        model: Mechanism | str | Path,
        *,
        solver: str | None = None,
        lanes: int | None = None,
        compiler: str = "zig",
    ) -> None:
        """Derive and compile ``model``, a mechanism or what ``load`` takes.

        ``solver`` is one of METHODS, by default one that suits the motion at the start. ``lanes`` is 16, 8, 4, 2 or 1,
        by default what this processor has in two registers; 0 sends all runs to the scalar runtime. ``compiler`` is
        'zig' or 'host'. Raises LoadError, DerivationError, ExportError (a solver that does not take the mechanism) or
        BuildError.
        """
        if solver is not None and solver not in METHODS:
            raise SimulationError(f"unknown solver '{solver}'; known are {', '.join(METHODS)}")
        if lanes not in {None, 0, 1, 2, 4, 8, 16}:
            raise SimulationError(f"lanes = {lanes}; expected 16, 8, 4, 2, 1 or 0, or None for what the processor has")
        mechanism = as_mechanism(model)
        equations = derive(mechanism)
        self.solver = suited_solver(equations, METHODS)[0] if solver is None else solver
        self._method = METHODS[self.solver]
        check_solver(equations.mechanism, self._method)
        time_stepping = isinstance(self._method, TimeStepping)
        self._program = lower(equations, (), self._method.variational, time_stepping)
        self._table = build_table(equations, self._program)
        self.mechanism = complete(mechanism, equations)
        indicators, impacts = event_names(self.mechanism, self._program)
        self._events = {
            name: i for i, name in enumerate((*indicators, *impacts)) if name in impacts or not time_stepping
        }
        self._compiler = compiler
        self.lanes = 0
        if lanes != 0 and runs_in_lanes(self._program, self._method, len(self.mechanism.motions)):
            self.lanes = lanes or lanes_here(compiler)
            self._lanes  # noqa: B018 (compiled now, so that the first run does not wait)

    def __repr__(self) -> str:
        """One line: of what, with which solver, in how many lanes."""
        return f"<Ensemble of {self.mechanism.name}: solver {self.solver}, {self.lanes or 'no'} lanes>"

    def __getstate__(self) -> dict[str, object]:
        """All but the loaded libraries, which the process that reads this compiles for its own processor."""
        return {name: value for name, value in vars(self).items() if name not in {"_lanes", "_scalar"}}

    @property
    def names(self) -> tuple[str, ...]:
        """What ``outputs``, ``extremes`` and ``crossings`` may name: states, accelerations, outputs, energies ..."""
        return tuple(columns_of(self._table))

    @property
    def events(self) -> tuple[str, ...]:
        """What ``events`` may name: indicators, which come to 0 where the equations change, and impacts.

        Time stepping does not locate what changes the equations; it has impacts alone, to a step.
        """
        return tuple(self._events)

    @cached_property
    def _lanes(self) -> Library:
        method = self._method
        assert isinstance(method, LaneMethod)
        sources = render_lanes(self._program, self._table.tables, method, self.lanes)
        return built(sources, "lanes", self._compiler)

    @cached_property
    def _scalar(self) -> Library:
        sources = render_scalar(self._program, self._table.tables, self._method)
        return built(sources, "scalar", self._compiler)

    def run(  # noqa: PLR0913 (choices of the user)
        self,
        *,
        starts: Values | None = None,
        parameters: Values | None = None,
        inputs: Values | None = None,
        input_times: ArrayLike | None = None,
        hold: bool = False,
        start_time: float = 0.0,
        stop_time: ArrayLike | None = None,
        samples: ArrayLike | int = (),
        outputs: Sequence[str] | None = None,
        extremes: Sequence[str] = (),
        crossings: Sequence[str] = (),
        most_crossings: int = 16,
        events: Sequence[str] = (),
        most_events: int = 1000,
        tolerance: float = 1e-6,
        step: ArrayLike = 0.0,
        max_step: ArrayLike = 0.0,
        threads: int | None = None,
    ) -> Runs:
        """Integrate a batch of r runs and return what was asked for; all values in SI units.

        ``starts`` {state: value}, ``parameters`` {name: value} and ``stop_time`` (s), ``step`` (s; the fixed step, of
        adaptive methods the first one, 0: automatic) and ``max_step`` (s; 0: a fiftieth of the run under error control)
        take one number for all runs or one for each, (r,); r is the longest of them. ``inputs`` {input: value} takes
        one number, (r,), or with ``input_times`` (k,) in s one at each of these times, (k,) or (r, k): in between
        inputs are linear, or constant if ``hold``.

        ``samples`` are times (s), ascending, or their number over the run; ``outputs`` are stored at the samples and at
        the end, by default the states. Of ``extremes`` the minima and maxima are found, between solver steps by
        parabolas; of ``crossings`` the times of up to ``most_crossings`` zeros, of ``events`` those of up to
        ``most_events``. ``threads`` is by default the number of processors.

        Raises LoadError for names and shapes that do not fit. Runs that fail are told in ``Runs.reasons``.
        """
        asked = Asked(
            starts or {}, parameters or {}, inputs or {}, input_times, hold, start_time, stop_time, samples,
            outputs, extremes, crossings, most_crossings, events, most_events, tolerance, step, max_step,
        )  # fmt: skip
        batch = batch_of(
            asked,
            self._table,
            self._events,
            self.mechanism.experiment.stop_time,
            fixed_step=self._method.error_order == 0,
        )
        if threads is not None and threads < 1:
            raise LoadError(f"threads = {threads}; expected at least 1, or None for as many as processors")
        threads = threads or os.cpu_count() or 1
        if self.lanes and not motions_alone(batch, len(self.mechanism.motions)):
            if self._program.constraints:
                settled = batch.starts.copy()
                run_batch(self._scalar, "scalar_starts", batch, threads, settled)
                batch = replace(batch, starts=settled)
            run_batch(self._lanes, "lane_runs", batch, min(threads, 1 + len(batch.starts) // self.lanes))
        in_lanes = batch.status == DONE
        if not in_lanes.all():
            batch = replace(batch, reasons=np.zeros(len(batch.starts), dtype=f"S{REASON}"))
            run_batch(self._scalar, "scalar_runs", batch, threads)
        return _results(batch, names_of(asked, self._table), events, in_lanes)


def _results(
    batch: Batch,
    names: tuple[Sequence[str], Sequence[str], Sequence[str]],
    events: Sequence[str],
    in_lanes: NDArray[np.bool_],
) -> Runs:
    """What the arrays of ``batch`` hold, by ``names`` of outputs, extremes and crossings, and ``events``."""
    outputs, extremes, crossings = names
    for array in (batch.minima, batch.maxima):
        array[batch.status == FAILED] = np.nan
    return Runs(
        times=batch.sample_times,
        samples={name: batch.sampled[:, :, i] for i, name in enumerate(outputs)},
        final={name: batch.finals[:, i] for i, name in enumerate(outputs)},
        minimum={name: batch.minima[:, i] for i, name in enumerate(extremes)},
        maximum={name: batch.maxima[:, i] for i, name in enumerate(extremes)},
        crossings={name: batch.crossed[:, i] for i, name in enumerate(crossings)},
        crossing_counts={name: batch.crossing_counts[:, i] for i, name in enumerate(crossings)},
        events={
            name: tuple(times[:count].copy() for times, count in zip(batch.event_times[:, i], counts, strict=True))
            for (i, name), counts in zip(enumerate(events), batch.event_counts.T, strict=True)
        },
        event_counts={name: batch.event_counts[:, i] for i, name in enumerate(events)},
        steps=batch.accepted,
        reached=batch.reached,
        in_lanes=in_lanes,
        reasons={int(i): batch.reasons[i].decode("utf-8", "replace") for i in np.flatnonzero(batch.status == FAILED)},
    )
