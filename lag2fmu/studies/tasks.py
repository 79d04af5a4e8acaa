"""The task of a sweep of a mechanism or of an FMU, checked before any run is made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lag2fmu.description.names import velocity
from lag2fmu.errors import LoadError, UnitError
from lag2fmu.fmu.exported import fmu_path
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.formats.write import write
from lag2fmu.language.given import within
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.design import Design, SweepTask
from lag2fmu.studies.givable import bounds_of, check_names
from lag2fmu.verify.inputs import Inputs, trajectory_of
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.plan import times_of
from lag2fmu.verify.run import Run
from lag2fmu.verify.scalars import scalars_of

_SAMPLES = 101
"""Times at which a run is sampled where none are asked for."""


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a user wants of every run of a sweep, see ``sweep``: the ``run`` but for its ``inputs``, times in s."""

    run: Run
    inputs: Inputs | None
    at_end: bool
    times: Sequence[float] | Floats | None
    solver: str | None

    def common(self, times: Floats, step: float, outputs: Sequence[str]) -> Run:
        """The run until the last of ``times`` (m,), in s; ``outputs`` unless others are wanted.

        ``step`` (s) is that of inputs that are functions. Raises LoadError for inputs that are none.
        """
        stop = float(times[-1])
        inputs = trajectory_of(self.inputs, stop, step)
        return replace(self.run, stop_time=stop, inputs=inputs, outputs=tuple(self.run.outputs or outputs))


def task_of_model(
    model: Any, design: Design, wanted: Wanted, threads: int | None
) -> tuple[SweepTask, dict[str, Unit | None], str]:
    """The task for a mechanism, the units of its names, and a title; see ``SweepTask`` for the other arguments.

    Raises LoadError for names that the mechanism does not have, and for times (s) that a run cannot have.
    """
    mechanism = as_mechanism(model)
    check_names(mechanism, [*design.names, *(wanted.run.values or ())])
    stop = wanted.run.stop_time
    times = times_of_runs(wanted, mechanism.experiment.stop_time if stop is None else stop)
    run = wanted.common(times, mechanism.experiment.step, _outputs_of(mechanism))
    check_names(mechanism, () if run.inputs is None else run.inputs.names)
    shown: dict[str, Unit | None] = dict(display_units(mechanism))
    task = SweepTask(
        model=write(mechanism),
        kind="mechanism",
        names=design.names,
        times=times,
        run=run,
        bounds=bounds_of(mechanism, design.names),
        solver=wanted.solver,
        threads=threads,
    )
    return task, shown, mechanism.title


def _outputs_of(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of outputs: coordinates, velocities, further states and the user's outputs."""
    q = [c.name for c in mechanism.coordinates]
    listed = [*q, *map(velocity, q), *(z.name for z in mechanism.states), *mechanism.output_names]
    return tuple(dict.fromkeys(listed))


def task_of_fmu(model: Any, design: Design, wanted: Wanted) -> tuple[SweepTask, dict[str, Unit | None], str]:
    """The task for an FMU of any tool, the units that it declares, and a title.

    Raises LoadError for a solver, because the FMU has its own, and for names that it does not have.
    """
    path = fmu_path(model).resolve()
    description = description_of(path)
    scalars = scalars_of(description, path)
    if wanted.solver is not None:
        raise LoadError(f"'{path.name}' has its solver inside; leave the solver out")
    _check_known(path.name, (*design.names, *(wanted.run.outputs or ())), scalars)
    stop, step = times_of(path, wanted.run.stop_time, None)
    times = times_of_runs(wanted, stop)
    every = [s.name for s in scalars.values() if s.variable.causality == "output" and not s.variable.alias]
    task = SweepTask(
        model=str(path),
        kind="fmu",
        files=(str(path),),
        names=design.names,
        times=times,
        run=replace(wanted.common(times, step, every), step=min(step, float(times[-1]))),
    )
    return task, _units_of(scalars), str(description.description or description.modelName)


def _check_known(file: str, names: Sequence[str], scalars: Mapping[str, Any]) -> None:
    for name in names:
        if name not in scalars:
            raise LoadError(f"'{file}' has no variable '{name}'; {suggestion(name, scalars)}")


def _units_of(scalars: Mapping[str, Any]) -> dict[str, Unit | None]:
    """The units that the variables of an FMU declare, or their types."""
    texts = {s.name: s.variable.unit or getattr(s.variable.declaredType, "unit", None) for s in scalars.values()}
    return {name: declared_unit(text) for name, text in texts.items()}


def declared_unit(text: str | None) -> Unit | None:
    """The unit called ``text``; None for one that is not known here."""
    try:
        return None if not text else parse_unit(text)
    except UnitError:
        return None


def times_of_runs(wanted: Wanted, stop: float) -> Floats:
    """The times (m,), in s, at which outputs are read; raises LoadError for times that a run cannot have."""
    if wanted.times is not None and wanted.at_end:
        raise LoadError("outputs are wanted at the end and at times; choose one of them")
    if not within(stop, above=0.0):
        raise LoadError(f"the stop time {stop!r} s is not positive and finite")
    usual = [stop] if wanted.at_end else np.linspace(0, stop, _SAMPLES)
    found = np.atleast_1d(np.asarray(usual if wanted.times is None else wanted.times, dtype=float))
    ascends = found.ndim == 1 and len(found) and np.isfinite(found).all() and (np.diff(found) > 0).all()
    if not ascends or found[0] < 0 or found[-1] <= 0:
        raise LoadError("the times of a sweep must be finite, none before 0 s, ascend, and end after 0 s")
    return found
