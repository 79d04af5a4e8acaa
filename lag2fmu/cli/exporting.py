"""What ``export`` does."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.analysis.entry_points import resting
from lag2fmu.cli.porting import with_choices
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import build_progress, progress_bar
from lag2fmu.errors import ExportError, Lag2FmuError
from lag2fmu.fmu.carried import name_inside
from lag2fmu.fmu.exporting import export
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.verify.page_samples import page_samples
from lag2fmu.verify.reference_files import reference_files, reference_of


def export_model(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    path: Path | None,
    platform: str,
    solver: str | None,
    compiler: str,
    backend: str,
    outputs: tuple[str, ...],
    inputs: str | None,
    ports: tuple[str, ...],
    fmi: str | None,
    arrays: bool,
    start: str,
    without: tuple[str, ...],
    page: str | None,
    reference: bool,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the FMU of ``model`` and say which solver it has; raises Lag2FmuError."""
    mechanism, extra, samples = with_choices(load_mechanism(model, settings), inputs, ports), {}, None
    mechanism = resting(mechanism) if start == "equilibrium" else mechanism
    path = Path(f"{Path(model).stem}.fmu") if path is None else path
    if not force:
        _refuse_to_overwrite(path, mechanism)
    if reference:
        with progress_bar("integrating directly", 1.0) as share:
            integrated = reference_of(mechanism, share)
        extra = reference_files(mechanism, integrated, arrays=arrays)
        samples = page_samples(mechanism, integrated)
    with build_progress() as progress:
        fmu = export(
            mechanism,
            path,
            solver=solver,
            compiler=compiler,
            platform=platform,
            backend=backend,
            outputs=outputs,
            extra=extra,
            progress=progress,
            fmi=fmi or "2.0",
            arrays=arrays,
            without=[word.strip() for words in without for word in words.split(",")],
            page=page,
            samples=samples,
        )
    click.echo(f"wrote {fmu.path}, solver {fmu.description.solver}{fmu.solver_choice and f': {fmu.solver_choice}'}")
    if fmu.moved_starts:
        click.echo(fmu.moved_starts)


def _refuse_to_overwrite(path: Path, mechanism: Mechanism) -> None:
    """Raise ExportError where ``path`` is a file that holds anything but an older FMU of ``mechanism``."""
    try:
        if not path.is_file():
            return
        name = name_inside(path)
    except OSError:  # the path cannot be a file; the export tells why
        return
    except Lag2FmuError:
        name, found = "", "is no FMU of lag2fmu"
    else:
        found = f"holds the mechanism '{name}'"
    if name not in (mechanism.name, mechanism.title):
        raise ExportError(f"'{path}' exists and {found}; overwrite it with --force, or choose another name with -o")
