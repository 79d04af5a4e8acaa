"""The commands that check an FMU, and exit with 1 if it fails: demo, validate, check."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from lag2fmu.cli.options import HOLD, INPUT, PICTURES, SET, STOP_TIME, check_ending, check_picture, load_mechanism
from lag2fmu.cli.terminal import console, print_report, progress_bar
from lag2fmu.errors import ExportError


@click.command()
@click.option(
    "--plot", "plot", type=click.Path(path_type=Path), help="Write the comparison as a picture (.png, .svg, .pdf)."
)
def demo(plot: Path | None) -> None:
    """Export, simulate and validate a double pendulum; print what was compared."""
    import tempfile

    import lag2fmu
    from lag2fmu.dynamics.lagrange import derive
    from lag2fmu.dynamics.program import lower
    from lag2fmu.solvers.methods import METHODS

    check_picture(plot)
    mechanism = lag2fmu.load("double_pendulum")
    program = lower(derive(mechanism))
    operations = program.operations("mechanism_accelerations")
    click.echo(f"{mechanism.title}: derived; the accelerations take {operations} operations, by {program.method}")
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        fmu = lag2fmu.export(mechanism, Path(folder, "double_pendulum.fmu"))
        solver = METHODS[fmu.description.solver].title
        click.echo(f"exported {fmu.path.name}: {fmu.path.stat().st_size / 1024:.0f} KiB, co-simulation by {solver}")
        with progress_bar("validating", 1.0) as progress:
            report = lag2fmu.validate(fmu, progress=progress)
    print_report(report)
    if plot is not None:
        report.write(plot)
        click.echo(f"wrote {plot}")
    sys.exit(0 if report.passed else 1)


@click.command()
@click.argument("model", metavar="MODEL|FMU")
@STOP_TIME
@click.option("--tolerance", type=float, help="Relative tolerance of the FMU's solver.")
@INPUT
@HOLD
@click.option("--solver", metavar="NAME", help="Integrator of co-simulation, as in export.")
@click.option(
    "--report",
    "reports",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Write .json, .txt, .png, .svg; repeatable.",
)
@SET
def validate(
    model: str,
    stop_time: float | None,
    tolerance: float | None,
    inputs: Path | None,
    hold: bool,
    solver: str | None,
    reports: tuple[Path, ...],
    settings: tuple[str, ...],
) -> None:
    """Compare the FMU with a direct integration of the mechanism on an independent path."""
    from lag2fmu.mechanism.display import display_units
    from lag2fmu.reference.trajectory import read_csv
    from lag2fmu.verify import entry_points

    for path in reports:
        check_ending(path, (".json", ".txt", *PICTURES))
    source: entry_points.Model = Path(model)
    if not entry_points.is_fmu(source):
        source = load_mechanism(model, settings)
    elif settings or solver:
        raise ExportError(f"'{model}' is an FMU: --set and --solver belong to its export; give a MODEL")
    mechanism = entry_points.mechanism_of(source)
    signals = None if inputs is None else read_csv(inputs, {} if mechanism is None else display_units(mechanism))
    with progress_bar("validating", 1.0) as progress:
        report = entry_points.validate(
            source,
            stop_time=stop_time,
            tolerance=tolerance,
            inputs=signals,
            hold=hold,
            solver=solver,
            progress=progress,
        )
    print_report(report)
    for path in reports:
        report.write(path)
        click.echo(f"wrote {path}")
    sys.exit(0 if report.passed else 1)


@click.command()
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--run/--no-run", default=True, show_default=True, help="Run its library, in a process of its own.")
def check(fmu: Path, run: bool) -> None:
    """Check FMU, of any tool, by the rules of FMI 2.0; running it executes code that is in it."""
    from lag2fmu.checking.check import check_fmu

    findings = check_fmu(fmu, run=run)
    console().print(findings.table())
    sys.exit(0 if findings.passed else 1)
