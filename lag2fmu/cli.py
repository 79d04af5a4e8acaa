"""The command line: the verbs of the library. Exit code 0 done, 1 a check failed, 2 bad usage or bad input."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lag2fmu.errors import ExportError, Lag2FmuError
from lag2fmu.version import VERSION

if TYPE_CHECKING:
    from lag2fmu.mechanism import Mechanism
    from lag2fmu.reference import Trajectory
    from lag2fmu.verify import Report

_SET = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter, start value or structural argument; repeatable.",
)
_STOP = click.option("--stop-time", type=float, metavar="S", help="Stop time in seconds.")
_PLOTS = (".png", ".svg", ".pdf")


class _BadInputError(click.ClickException):
    """An error of the user, shown as one line."""

    exit_code = 2


class _Commands(click.Group):
    """A group that turns every error of lag2fmu into one line and exit code 2."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except Lag2FmuError as error:
            raise _BadInputError(str(error)) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, prog_name="lag2fmu")
def main() -> None:
    """From the Lagrangian of a mechanism to a validated FMI 2.0 FMU.

    MODEL is a bundled name (see 'lag2fmu models'), a .py file or a .toml file.
    """


@main.command()
@click.option(
    "--plot", "plot", type=click.Path(path_type=Path), help="Write the comparison as a picture (.png, .svg, .pdf)."
)
def demo(plot: Path | None) -> None:
    """Export, simulate and validate a double pendulum; print what was compared."""
    import lag2fmu
    from lag2fmu.codegen import METHODS
    from lag2fmu.dynamics import derive, lower

    mechanism = lag2fmu.load("double_pendulum")
    program = lower(derive(mechanism))
    operations = program.operations("mechanism_accelerations")
    click.echo(f"{mechanism.title}: derived; the accelerations take {operations} operations, by {program.method}")
    with _folder() as folder:
        fmu = lag2fmu.export(mechanism, folder / "double_pendulum.fmu")
        solver = METHODS[fmu.description.solver].title
        click.echo(f"exported {fmu.path.name}: {fmu.path.stat().st_size / 1024:.0f} KiB, co-simulation by {solver}")
        report = lag2fmu.validate(fmu)
    _print(report)
    if plot is not None:
        report.write(plot)
        click.echo(f"wrote {plot}")
    sys.exit(0 if report.passed else 1)


@main.command()
def models() -> None:
    """List the mechanisms that come with lag2fmu."""
    from rich.table import Table

    import lag2fmu
    from lag2fmu.mechanism.loading import bundled

    table = Table(box=None, pad_edge=False)
    for heading in ("model", "n", "what it is"):
        table.add_column(heading)
    for name in bundled():
        mechanism = lag2fmu.load(name)
        table.add_row(name, str(len(mechanism.coordinates)), mechanism.title)
    _console().print(table)


@main.command()
@click.argument("name")
def new(name: str) -> None:
    """Write NAME.toml, a commented mechanism to start from, and the schema with which editors check it."""
    from lag2fmu.mechanism.starting import write_start

    path, schema = write_start(name, Path())
    click.echo(f"wrote {path}, a cart with a pole to start from: try 'lag2fmu validate {path}'")
    click.echo(f"{schema} beside it lets editors complete and check the file (Even Better TOML, Taplo)")


@main.command()
@click.argument("model")
@click.option("--format", "style", type=click.Choice(["text", "latex", "toml"]), default="text", show_default=True)
@click.option(
    "--plot", type=click.Path(path_type=Path), help="Draw the mechanism and its normal modes (.png, .svg, .pdf)."
)
@click.option("--analysis", is_flag=True, help="Conserved quantities, equilibria, modes and more, after the steps.")
@_SET
def show(model: str, style: str, plot: Path | None, analysis: bool, settings: tuple[str, ...]) -> None:
    """Walk the twelve steps of the textbook procedure, or write the mechanism as text (toml)."""
    from lag2fmu.mechanism.write import write
    from lag2fmu.verify.procedure import procedure

    if analysis and style == "toml":
        raise ExportError("--analysis is written as text or LaTeX; leave out '--format toml'")
    mechanism = _load(model, settings)
    click.echo(write(mechanism) if style == "toml" else procedure(mechanism, style), nl=False)
    if analysis:
        from lag2fmu.dynamics.analysis import analysis_report

        click.echo(analysis_report(mechanism, style), nl=False)
    if plot is not None:
        from lag2fmu.verify.plots import mechanism_figure, save

        save(mechanism_figure(mechanism), plot)


@main.command("export")
@click.argument("model")
@click.option("-o", "--out", "path", type=click.Path(path_type=Path), metavar="FILE", help="The FMU; default NAME.fmu.")
@click.option(
    "--platform",
    type=click.Choice(["host", "linux64", "win64", "darwin", "aarch64-linux", "all"]),
    default="host",
    show_default=True,
    help="Platform of the binary, or all of them.",
)
@click.option("--solver", metavar="NAME", help="Integrator of co-simulation; by default one that suits the start.")
@click.option("--compiler", type=click.Choice(["zig", "host"]), default="zig", show_default=True)
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="NAME",
    help="Make a local variable an output ('all': each); repeatable.",
)
@click.option(
    "--backend",
    type=click.Choice(["c", "python"]),
    default="c",
    show_default=True,
    help="Native library, or readable Python (needs Python on the importing side).",
)
@click.option("--reference", is_flag=True, help="Put a reference trajectory in, to check the FMU with.")
@_SET
def export_command(
    model: str,
    path: Path | None,
    platform: str,
    solver: str | None,
    compiler: str,
    backend: str,
    outputs: tuple[str, ...],
    reference: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the FMU of MODEL."""
    from lag2fmu.fmu import export

    mechanism, extra = _load(model, settings), {}
    if reference:
        from lag2fmu.verify.experiment import reference_files

        extra = reference_files(mechanism)
    with _build_progress() as progress:
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
        )
    click.echo(f"wrote {fmu.path}, solver {fmu.description.solver}{fmu.solver_choice and f': {fmu.solver_choice}'}")


@main.command()
@click.argument("model", metavar="MODEL|FMU")
@_STOP
@click.option("--step", type=float, metavar="S", help="Communication step in seconds.")
@click.option("--tolerance", type=float, help="Relative tolerance of the solver.")
@click.option("--input", "inputs", type=click.Path(path_type=Path), metavar="CSV", help="Signals: time,name,...")
@click.option("-o", "--out", metavar="CSV", help="Write the trajectory; '-' is standard output.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the motion (.png, .svg, .pdf).")
@_SET
def simulate(
    model: str,
    stop_time: float | None,
    step: float | None,
    tolerance: float | None,
    inputs: Path | None,
    out: str | None,
    plot: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Run MODEL or an FMU by fmpy."""
    from lag2fmu.mechanism.loading import numbers_of, pairs_of
    from lag2fmu.mechanism.names import SETTINGS
    from lag2fmu.reference import read_csv
    from lag2fmu.verify import running

    _check_plot(plot)
    source: running.Model = Path(model)
    values = {}
    if running.is_fmu(source):
        values = numbers_of(pairs_of(settings))
    else:
        of_solver = [item for item in settings if item.partition("=")[0].strip() in SETTINGS]
        values = numbers_of(pairs_of(of_solver))
        source = _load(model, tuple(item for item in settings if item not in of_solver))
    signals = None if inputs is None else read_csv(inputs)
    with _progress(stop_time) as progress:
        trajectory = running.simulate(
            source,
            stop_time=stop_time,
            step=step,
            tolerance=tolerance,
            values=values,
            inputs=signals,
            progress=progress,
        )
    if out == "-":
        click.echo(trajectory.to_csv(), nl=False)
    elif out is not None:
        trajectory.write_csv(out)
        click.echo(f"wrote {out}", err=True)
    else:
        _print_summary(trajectory)
    if plot is not None:
        from lag2fmu.verify.plots import motion_figure, save

        of_mechanism = {name: value for name, value in values.items() if name not in SETTINGS}
        mechanism = running.mechanism_of(source, of_mechanism)
        title = Path(model).stem if mechanism is None else mechanism.title
        save(motion_figure(title, trajectory, mechanism, signals), plot)


@main.command()
@click.argument("model", metavar="MODEL|FMU")
@_STOP
@click.option("--tolerance", type=float, help="Relative tolerance of the FMU's solver.")
@click.option("--input", "inputs", type=click.Path(path_type=Path), metavar="CSV", help="Signals: time,name,...")
@click.option("--solver", metavar="NAME", help="Integrator of co-simulation, as in export.")
@click.option(
    "--report",
    "reports",
    multiple=True,
    type=click.Path(path_type=Path),
    help="Write .json, .txt, .png, .svg; repeatable.",
)
@_SET
def validate(
    model: str,
    stop_time: float | None,
    tolerance: float | None,
    inputs: Path | None,
    solver: str | None,
    reports: tuple[Path, ...],
    settings: tuple[str, ...],
) -> None:
    """Compare the FMU with a direct integration of the mechanism on an independent path."""
    from lag2fmu.reference import read_csv
    from lag2fmu.verify import running

    for path in reports:
        _check_ending(path, (".json", ".txt", *_PLOTS))
    source: running.Model = Path(model)
    if not running.is_fmu(source):
        source = _load(model, settings)
    elif settings or solver:
        raise ExportError(f"'{model}' is an FMU: --set and --solver belong to its export; give a MODEL")
    signals = None if inputs is None else read_csv(inputs)
    report = running.validate(source, stop_time=stop_time, tolerance=tolerance, inputs=signals, solver=solver)
    _print(report)
    for path in reports:
        report.write(path)
        click.echo(f"wrote {path}")
    sys.exit(0 if report.passed else 1)


@main.command()
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--run/--no-run", default=True, show_default=True, help="Run its library, in a process of its own.")
def check(fmu: Path, run: bool) -> None:
    """Check FMU, of any tool, by the rules of FMI 2.0; running it executes code that is in it."""
    from lag2fmu.verify.checking import check_fmu

    findings = check_fmu(fmu, run=run)
    _console().print(findings.table())
    sys.exit(0 if findings.passed else 1)


# ----------------------------------------------------------------------------------------------------------- helpers


def _load(model: str, settings: tuple[str, ...]) -> Mechanism:
    """The mechanism with its structural arguments and values; its warnings go to standard error."""
    from lag2fmu.mechanism.loading import load, split_settings, with_values

    structural, values = split_settings(model, settings)
    mechanism = with_values(load(model, structural), values)
    for warning in mechanism.warnings:
        click.echo(f"warning: {warning}", err=True)
    return mechanism


def _console() -> Any:
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 110)


def _print(report: Report) -> None:
    _console().print(report.table())


def _print_summary(trajectory: Trajectory) -> None:
    from rich.table import Table

    table = Table(title=f"0 to {trajectory.time[-1]:g} s, {len(trajectory)} points", title_justify="left")
    for heading in ("output", "start", "least", "greatest", "end"):
        table.add_column(heading, justify="left" if heading == "output" else "right")
    for name in trajectory.names:
        column = trajectory[name]
        table.add_row(name, *(f"{x:.9g}" for x in (column[0], column.min(), column.max(), column[-1])))
    _console().print(table)


def _check_plot(plot: Path | None) -> None:
    if plot is not None:
        _check_ending(plot, _PLOTS)


def _check_ending(path: Path, endings: tuple[str, ...]) -> None:
    """Refuse a file that could not be written, before the work is done."""
    if path.suffix not in endings:
        raise ExportError(f"'{path}': its ending must be one of {', '.join(endings)}")
    if not path.parent.is_dir():
        raise ExportError(f"'{path}': the folder '{path.parent}' does not exist")


@contextmanager
def _folder() -> Iterator[Path]:
    import tempfile

    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        yield Path(folder)


@contextmanager
def _bar(title: str, total: float | None) -> Iterator[Callable[[float], None] | None]:
    """A progress bar with the elapsed time on a terminal's standard error, else nothing."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=total)
        yield lambda completed: bar.update(task, completed=completed)


@contextmanager
def _progress(stop_time: float | None) -> Iterator[Callable[[float], None] | None]:
    """The progress of a simulation: the time it has reached."""
    with _bar("simulating", stop_time) as update:
        yield update


@contextmanager
def _build_progress() -> Iterator[Callable[[int, int, str], None] | None]:
    """The progress of the compiler: the share of the libraries that are done."""
    with _bar("building (the first build for a platform takes minutes)", 1.0) as update:
        yield None if update is None else lambda done, total, _: update(done / total)


if __name__ == "__main__":
    main()
