"""The work of the verb ``simulate``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from lag2fmu.cli.fmu_settings import values_of_fmu
from lag2fmu.cli.motions import SimulateOptions, check_targets, write_motion
from lag2fmu.cli.options import ANIMATIONS, check_ending
from lag2fmu.cli.settings import load_with_inputs
from lag2fmu.description.names import SETTINGS
from lag2fmu.errors import LoadError
from lag2fmu.fmu.elements import element_variables
from lag2fmu.fmu.exported import Model, is_fmu
from lag2fmu.fmu.exporting import as_fmu
from lag2fmu.formats.loading import pairs_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import progress_bar
from lag2fmu.reference.trajectory import Trajectory, read_csv
from lag2fmu.verify import entry_points
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.plan import check_known, recorded, times_of
from lag2fmu.verify.run import Run
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.watched_runs import watched


def simulate_model(asked: SimulateOptions) -> None:
    """Run a model and write, draw, animate or sum up its motion; raises Lag2FmuError for input that does not fit."""
    check_targets(asked)
    if asked.animation is not None:
        from lag2fmu.verify.plots.animation import writer_of

        check_ending(asked.animation, ANIMATIONS)
        writer_of(asked.animation)
    source, values, units = _source_and_values(asked.model, asked.settings)
    signals = None if asked.inputs is None else read_csv(asked.inputs, units)
    mechanism = entry_points.mechanism_of(source, values if isinstance(source, Path) else None)
    drawn = mechanism if asked.plot or asked.animation else None
    with (
        as_fmu(source, asked.solver) as path,
        progress_bar("simulating", _until(source, asked.stop_time)) as progress,
    ):
        outputs = _recorded(path, asked.wanted)
        beside = [name for name in _seen_in_plots(drawn) if name not in outputs]
        run = Run(asked.stop_time, asked.step, asked.tolerance, values, signals, asked.hold, outputs, beside)
        given = source if isinstance(source, Mechanism) else None
        trajectory = watched(path, replace(run, progress=progress), given)
    write_motion(trajectory.without(beside), asked.out, units)
    if asked.animation is not None:
        _animate(mechanism, trajectory, asked.animation)
    if asked.plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.motion import motion_figure

        title = getattr(mechanism, "title", Path(asked.model).stem)
        save(motion_figure(title, trajectory, mechanism, signals), asked.plot)


def _until(source: Model, stop_time: float | None) -> float | None:
    """The stop time (s) of the run, None if it is not known before the run."""
    if stop_time is not None:
        return stop_time
    return source.experiment.stop_time if isinstance(source, Mechanism) else times_of(Path(str(source)), None, None)[0]


def _recorded(path: Path, wanted: tuple[str, ...]) -> list[str]:
    """The outputs of the FMU ``path`` and the ``wanted`` variables; raises LoadError for one that it does not have."""
    scalars = scalars_of(description_of(path), path)
    names = recorded(Run(outputs=[*recorded(Run(), scalars), *wanted]), scalars)
    check_known(names, list(scalars), "variable")
    return list(dict.fromkeys(names))


def _seen_in_plots(drawn: Mechanism | None) -> list[str]:
    """The modes, counts and impulses of contacts, stops and frictions of the mechanism that is ``drawn``, if any."""
    return [] if drawn is None else [variable.name for variable, _, _ in element_variables(drawn)]


def _animate(mechanism: Mechanism | None, trajectory: Trajectory, path: Path) -> None:
    """Write the animation and show its progress; raises LoadError if there is no ``mechanism`` to draw."""
    from lag2fmu.verify.plots.animation import animate

    if mechanism is None:
        raise LoadError(f"'{path}': only FMUs of lag2fmu carry the mechanism that an animation draws")
    with progress_bar("drawing", 1.0) as progress:
        animate(mechanism, trajectory, path, progress)
    click.echo(f"wrote {path}", err=True)


def _source_and_values(model: str, settings: tuple[str, ...]) -> tuple[Model, dict[str, float], dict[str, Unit]]:
    """(what to run, values (SI) to set in the FMU, units in which the mechanism is shown, if it is known).

    For an FMU the values are all ``settings``. For a MODEL they are those of the solver and of generalized forces; the
    others go into the model.
    """
    if is_fmu(Path(model)):
        texts, inside = pairs_of(settings), entry_points.mechanism_of(Path(model))
        units = {} if inside is None else display_units(inside)
        return Path(model), values_of_fmu(Path(model), texts, units), units
    return load_with_inputs(model, settings, SETTINGS)
