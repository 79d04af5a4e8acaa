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
from lag2fmu.dynamics.lagrange import derive, with_derived
from lag2fmu.dynamics.program import lower
from lag2fmu.ensemble.batch import DONE, FAILED, REASON, Batch, run_batch
from lag2fmu.ensemble.columns import columns_of
from lag2fmu.ensemble.libraries import KernelLibrary, built, lanes_here
from lag2fmu.ensemble.requests import Asked, batch_of, motions_alone, names_of
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

    If the motion is smooth and the solver explicit, several runs share the lanes of vector registers. Other runs, and
    those that reach a singular position, take the scalar engine of the FMU one by one. Both agree with the FMU within
    the tolerance. The bits of a run depend neither on the other runs of the batch nor on the number of threads.
    """

    def __init__(
        self,
        model: Mechanism | str | Path,
        *,
        solver: str | None = None,
        lanes: int | None = None,
        compiler: str = "zig",
        values: Mapping[str, float] | None = None,
    ) -> None:
        """Derive and compile ``model``, a mechanism or what ``load`` takes.

        - ``solver``: one of METHODS; by default one that suits the motion at the start.
        - ``lanes``: 16, 8, 4, 2 or 1, by default the doubles in two registers of this processor; 0 sends all runs to
          the scalar engine.
        - ``compiler``: 'zig' or 'host'.
        - ``values``: other parameters and starts of all runs, in SI units.

        Raises LoadError, DerivationError, SimulationError (unknown solver or lanes), ExportError (a solver that does
        not take the mechanism) or BuildError.
        """
        if solver is not None and solver not in METHODS:
            raise SimulationError(f"unknown solver '{solver}'; known are {', '.join(METHODS)}")
        if lanes not in {None, 0, 1, 2, 4, 8, 16}:
            raise SimulationError(f"lanes = {lanes}; expected 16, 8, 4, 2, 1 or 0, or None for what the processor has")
        mechanism = as_mechanism(model, values)
        equations = derive(mechanism)
        self.solver = suited_solver(equations, METHODS)[0] if solver is None else solver
        self._method = METHODS[self.solver]
        check_solver(equations.mechanism, self._method)
        time_stepping = isinstance(self._method, TimeStepping)
        self._program = lower(equations, (), self._method.variational, time_stepping)
        self._table = build_table(equations, self._program)
        self.mechanism = with_derived(mechanism, equations)
        indicators, impacts = event_names(self.mechanism, self._program)
        self._events = {
            name: i for i, name in enumerate((*indicators, *impacts)) if name in impacts or not time_stepping
        }
        self._compiler = compiler
        self.lanes = 0
        self._lane_method: LaneMethod | None = None
        method = self._method
        if lanes != 0 and runs_in_lanes(method, self._program, len(self.mechanism.motions)):
            self._lane_method = method
            self.lanes = lanes or lanes_here(compiler)
            self._lanes  # noqa: B018 (compiles the library now, so that the first run does not wait)

    def __repr__(self) -> str:
        """One line: the mechanism, the solver and the number of lanes."""
        return f"<Ensemble of {self.mechanism.name}: solver {self.solver}, {self.lanes or 'no'} lanes>"

    def __getstate__(self) -> dict[str, object]:
        """The state without the loaded libraries; another process compiles them for its own processor."""
        return {name: value for name, value in vars(self).items() if name not in {"_lanes", "_scalar"}}

    @property
    def names(self) -> tuple[str, ...]:
        """The names that ``outputs``, ``extremes`` and ``crossings`` take: states, accelerations, energies and more."""
        return tuple(columns_of(self._table))

    @property
    def events(self) -> tuple[str, ...]:
        """The names that ``events`` takes: event indicators, which are 0 where the equations change, and impacts.

        Time stepping locates no change of the equations. Its only events are impacts, known to within one step.
        """
        return tuple(self._events)

    @cached_property
    def _lanes(self) -> KernelLibrary:
        if self._lane_method is None:
            raise SimulationError(f"solver '{self.solver}' runs in no lanes; give lanes = 0")
        sources = render_lanes(self._program, self._table.tables, self._lane_method, self.lanes)
        return built(sources, "lanes", self._compiler)

    @cached_property
    def _scalar(self) -> KernelLibrary:
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

        One value for all runs, or one for each run (r,), is taken by:

        - ``starts`` {state: value} and ``parameters`` {name: value}.
        - ``stop_time`` (s).
        - ``step`` (s): the fixed step, or the first step of adaptive methods; 0: automatic.
        - ``max_step`` (s): the longest step; 0: a fiftieth of the run under error control.

        Inputs and results:

        - ``inputs`` {input: value}: one number, (r,), or values at the ``input_times`` (k,) in s, (k,) or (r, k).
          Between these times inputs are linear, or constant with ``hold``.
        - ``samples``: ascending times (s), or their number.
        - ``outputs``: names, by default the states; stored at the samples and at the end.
        - ``extremes``: names whose minima and maxima are found, between solver steps by parabolas.
        - ``crossings``: names whose zeros are found, up to ``most_crossings`` of each.
        - ``events``: names whose times are found, up to ``most_events`` of each.
        - ``tolerance``: the relative tolerance; ``threads``: by default the number of processors.

        Raises LoadError for names and shapes that do not fit. ``Runs.reasons`` says why a run failed.
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
    """The results in the arrays of ``batch``, by the ``names`` of outputs, extremes and crossings, and ``events``."""
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
