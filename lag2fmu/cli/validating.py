"""The work of the verbs ``demo`` and ``validate``: they compare an FMU with a direct integration."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import click

from lag2fmu.cli.options import PICTURES, check_ending, check_picture
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import console
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.dynamics.program import lower
from lag2fmu.errors import ExportError
from lag2fmu.fmu.exported import Model, is_fmu
from lag2fmu.fmu.exporting import export
from lag2fmu.formats.loading import load
from lag2fmu.mechanism.display import display_units
from lag2fmu.progress import progress_bar
from lag2fmu.reference.trajectory import read_csv
from lag2fmu.solvers.methods import METHODS
from lag2fmu.verify.entry_points import mechanism_of
from lag2fmu.verify.report import STATUS
from lag2fmu.verify.validate import validate


def validate_demo(plot: Path | None) -> None:
    """Export, simulate and validate a double pendulum; exit with the status of the outcome."""
    check_picture(plot)
    mechanism = load("double_pendulum")
    program = lower(derive(mechanism))
    operations = program.operations("mechanism_accelerations")
    click.echo(f"{mechanism.title}: derived; the accelerations take {operations} operations, by {program.method}")
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        fmu = export(mechanism, Path(folder, "double_pendulum.fmu"), page="static")
        solver = METHODS[fmu.description.solver].title
        click.echo(f"exported {fmu.path.name}: {fmu.path.stat().st_size / 1024:.0f} KiB, co-simulation by {solver}")
        with progress_bar("validating", 1.0) as progress:
            report = validate(fmu, progress=progress)
    console().print(report.table())
    if plot is not None:
        report.write(plot)
        click.echo(f"wrote {plot}")
    sys.exit(STATUS[report.outcome])


def validate_model(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    stop_time: float | None,
    tolerance: float | None,
    inputs: Path | None,
    hold: bool,
    solver: str | None,
    fmi: str | None,
    limit: float,
    reports: tuple[Path, ...],
    settings: tuple[str, ...],
) -> None:
    """Validate ``model`` and write the reports; exit with 1 if it fails, with 3 if too little could be compared.

    Raises Lag2FmuError for a model or options that do not fit, SimulationError for a run that fails.
    """
    for path in reports:
        check_ending(path, (".json", ".txt", *PICTURES))
    source: Model = Path(model)
    if not is_fmu(source):
        source = load_mechanism(model, settings)
    elif settings or solver or fmi:
        raise ExportError(f"'{model}' is an FMU: --set, --solver and --fmi belong to its export; give a MODEL")
    mechanism = mechanism_of(source)
    signals = None if inputs is None else read_csv(inputs, {} if mechanism is None else display_units(mechanism))
    with progress_bar("validating", 1.0) as progress:
        report = validate(
            source,
            stop_time=stop_time,
            tolerance=tolerance,
            inputs=signals,
            hold=hold,
            solver=solver,
            fmi=fmi or "2.0",
            limit=limit,
            progress=progress,
        )
    console().print(report.table())
    for path in reports:
        report.write(path)
        click.echo(f"wrote {path}")
    sys.exit(STATUS[report.outcome])
