"""The work of the verb ``export``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from lag2fmu.cli.porting import with_choices
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import build_progress
from lag2fmu.description import names
from lag2fmu.errors import ExportError, Lag2FmuError
from lag2fmu.fmu.backends.backend import identifier_of
from lag2fmu.fmu.contents import identifier_inside
from lag2fmu.fmu.exported import Fmu
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.observers import observed_mechanism
from lag2fmu.formats.loading import pairs_of
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.leaving_out import OMISSIBLE, leaving_out
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import progress_bar

if TYPE_CHECKING:
    from lag2fmu.analysis.observing import Observing
    from lag2fmu.fmu.live.samples import Samples


class ExportOptions(NamedTuple):
    """The options of ``export``, by their names."""

    model: str
    path: Path | None
    platform: str
    solver: str | None
    compiler: str
    backend: str
    outputs: tuple[str, ...]
    inputs: str | None
    ports: tuple[str, ...]
    fmi: str | None
    arrays: bool
    start: str
    inverse: str | None
    time_constant: float | None
    without: tuple[str, ...]
    page: str | None
    reference: bool
    profile: str
    step: float | None
    sources: str
    observer: str | None
    measure: tuple[str, ...]
    process: tuple[str, ...]
    estimate: str
    sample_times: tuple[str, ...]
    delays: tuple[str, ...]
    limit: float
    force: bool
    settings: tuple[str, ...]

    @property
    def target(self) -> Path:
        """The FMU; by default a file here with the name of the model."""
        suffix = ("" if self.inverse is None else names.INVERSE) + ("" if self.observer is None else names.OBSERVER)
        return Path(f"{Path(self.model).stem}{suffix}.fmu") if self.path is None else self.path

    @property
    def left_out(self) -> list[str]:
        """The words of ``without``, each for itself."""
        return [word.strip() for words in self.without for word in words.split(",")]


def export_model(asked: ExportOptions) -> None:
    """Write the FMU of the model and print which solver it has.

    Raises Lag2FmuError for a model or options that do not fit, and for a file that cannot be written.
    """
    mechanism, outputs = _asked_for(asked)
    path = asked.target
    if not asked.force:
        _refuse_to_overwrite(path, observed_mechanism(mechanism) if asked.observer else mechanism)
    observer = _observer(mechanism, asked)
    extra, samples = _integrated(mechanism, asked) if asked.reference else ({}, None)
    with build_progress() as progress:
        fmu = export(
            mechanism,
            path,
            solver=asked.solver,
            compiler=asked.compiler,
            platform=asked.platform,
            backend=asked.backend,
            outputs=outputs,
            extra=extra,
            progress=progress,
            fmi=asked.fmi or "2.0",
            arrays=asked.arrays,
            without=asked.left_out,
            page=asked.page,
            samples=samples,
            profile=asked.profile,
            step=asked.step,
            sources=asked.sources,
            observer=observer,
        )
    click.echo(f"wrote {fmu.path}, solver {fmu.description.solver}{fmu.solver_choice and f': {fmu.solver_choice}'}")
    if fmu.moved_starts:
        click.echo(fmu.moved_starts)
    for doubt in _doubts(mechanism, fmu, asked):
        click.echo(f"warning: {doubt}", err=True)


def _asked_for(asked: ExportOptions) -> tuple[Mechanism, tuple[str, ...]]:
    """The mechanism of which the FMU is made, and the names of what is promoted to outputs."""
    mechanism = with_choices(load_mechanism(asked.model, asked.settings), asked.inputs, asked.ports)
    if asked.start == "equilibrium":
        from lag2fmu.analysis.at_rest import resting

        mechanism = resting(mechanism)
    if asked.inverse is None:
        if asked.time_constant is not None:
            raise ExportError("--time-constant goes with --inverse, whose motions it filters; add it, or leave it out")
        return mechanism, asked.outputs
    from lag2fmu.analysis.inverse import inverse, needed

    motions = [name.strip() for name in asked.inverse.split(",")]
    omitted = [word for word in asked.left_out if word in OMISSIBLE]
    mechanism = inverse(leaving_out(mechanism, omitted), motions, time_constant=asked.time_constant)
    return mechanism, (*asked.outputs, *needed(mechanism))


def _observer(mechanism: Mechanism, asked: ExportOptions) -> Observing | None:
    """What an observer is asked for, in SI units; None without one."""
    if asked.observer and asked.reference:
        raise ExportError("--reference: it tells how the mechanism moves, but observers follow samples; leave it out")
    if asked.observer is None:
        given = {"measure": asked.measure, "process": asked.process, "estimate": asked.estimate}
        given |= {"sample-time": asked.sample_times, "delay": asked.delays}
        unused = [word for word, choice in given.items() if choice]
        if unused:
            raise ExportError(f"--{unused[0]} goes with --observer; add --observer ekf, or leave it out")
        return None
    from lag2fmu.analysis.observing import Observing
    from lag2fmu.cli.noise import items_of, noise_of, size_of, times_of

    units = display_units(mechanism)

    return Observing(
        asked.observer,
        noise_of(items_of(asked.measure), mechanism, units),
        {name: size_of(name, text, units) for name, text in pairs_of(items_of(asked.process)).items()},
        tuple(filter(None, map(str.strip, asked.estimate.split(",")))),
        times_of(asked.sample_times),
        times_of(asked.delays),
    )


def _integrated(mechanism: Mechanism, asked: ExportOptions) -> tuple[dict[str, bytes], Samples | None]:
    """{name in the archive: content} and the samples of the live page, of a direct integration of ``mechanism``."""
    from lag2fmu.verify.page_samples import page_samples
    from lag2fmu.verify.reference_files import SHORT, reference_files, reference_of, shortened

    with progress_bar("integrating directly", 1.0) as share:
        integrated = reference_of(mechanism, share, asked.limit)
    click.echo(shortened(mechanism, integrated, SHORT), nl=False, err=True)
    return reference_files(mechanism, integrated, arrays=asked.arrays), page_samples(mechanism, integrated)


def _doubts(mechanism: Mechanism, fmu: Fmu, asked: ExportOptions) -> list[str]:
    """What is doubtful in the default run of ``fmu``, if it runs here, or in what an observer's samples show.

    Only laws of contacts and constraints can be. Without them the modules that run FMUs need not be read.
    """
    if asked.observer:
        return [fmu.doubt] if fmu.doubt else []
    if not {"host", "all", "every"} & set(asked.platform.split(",")) or not mechanism.held:
        return []
    from lag2fmu.verify.watched_runs import doubts_of

    return doubts_of(mechanism, fmu.path)


def _refuse_to_overwrite(path: Path, mechanism: Mechanism) -> None:
    """Raise ExportError where ``path`` is a file that holds anything but an older FMU of ``mechanism``."""
    try:
        if not path.is_file():
            return
        name = identifier_inside(path)
    except OSError:  # the path cannot be a file; the export raises the error that says why
        return
    except Lag2FmuError:
        name, found = "", "is no FMU of lag2fmu"
    else:
        found = f"holds the mechanism '{name}'"
    if name != identifier_of(mechanism.name):
        raise ExportError(f"'{path}' exists and {found}; overwrite it with --force, or choose another name with -o")
