"""The commands that make an FMU and run it: export, simulate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lag2fmu.cli.options import (
    CSV,
    HOLD,
    INPUT,
    SET,
    STOP_TIME,
    check_ending,
    check_picture,
    echo_settings,
    load_mechanism,
)
from lag2fmu.cli.terminal import build_progress, print_summary, progress_bar
from lag2fmu.errors import ExportError, Lag2FmuError

if TYPE_CHECKING:
    from lag2fmu.language.units import Unit
    from lag2fmu.mechanism.record import Mechanism
    from lag2fmu.reference.trajectory import Trajectory
    from lag2fmu.verify.entry_points import Model


@click.command("export")
@click.argument("model")
@click.option(
    "-o", "--out", "path", type=click.Path(path_type=Path), metavar="FILE", help="The FMU; default MODEL.fmu."
)
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
@click.option("--force", is_flag=True, help="Overwrite FILE also where it holds another mechanism.")
@SET
def export_command(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    path: Path | None,
    platform: str,
    solver: str | None,
    compiler: str,
    backend: str,
    outputs: tuple[str, ...],
    reference: bool,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the FMU of MODEL, by default to a file of the same name here."""
    from lag2fmu.fmu.exporting import export

    mechanism, extra = load_mechanism(model, settings), {}
    path = Path(f"{Path(model).stem}.fmu") if path is None else path
    if not force:
        _refuse_to_overwrite(path, mechanism)
    if reference:
        from lag2fmu.verify.reference_files import reference_files

        extra = reference_files(mechanism)
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
        )
    click.echo(f"wrote {fmu.path}, solver {fmu.description.solver}{fmu.solver_choice and f': {fmu.solver_choice}'}")
    if fmu.moved_starts:
        click.echo(fmu.moved_starts)


def _refuse_to_overwrite(path: Path, mechanism: Mechanism) -> None:
    """Raise ExportError where ``path`` is a file that holds anything but an older FMU of ``mechanism``."""
    from lag2fmu.fmu.exporting import read_mechanism

    try:
        if not path.is_file():
            return
        name = read_mechanism(path).name
    except OSError:  # no name for a file, which is told when it is written
        return
    except Lag2FmuError:
        name, found = "", "is no FMU of lag2fmu"
    else:
        found = f"holds the mechanism '{name}'"
    if name != mechanism.name:
        raise ExportError(f"'{path}' exists and {found}; overwrite it with --force, or choose another name with -o")


@click.command()
@click.argument("model", metavar="MODEL|FMU")
@STOP_TIME
@click.option("--step", type=float, metavar="S", help="Communication step in seconds.")
@click.option("--tolerance", type=float, help="Relative tolerance of the solver.")
@INPUT
@HOLD
@click.option("-o", "--out", metavar="CSV", help="Write the trajectory; '-' is standard output.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the motion (.png, .svg, .pdf).")
@SET
def simulate(
    model: str,
    stop_time: float | None,
    step: float | None,
    tolerance: float | None,
    inputs: Path | None,
    hold: bool,
    out: str | None,
    plot: Path | None,
    settings: tuple[str, ...],
) -> None:
    """Run MODEL or an FMU by fmpy."""
    from lag2fmu.description.names import SETTINGS
    from lag2fmu.reference.trajectory import read_csv
    from lag2fmu.verify import entry_points

    check_picture(plot)
    if out not in (None, "-"):
        check_ending(Path(out), CSV)
    source, values, units = _source_and_values(model, settings)
    signals = None if inputs is None else read_csv(inputs, units)
    with progress_bar("simulating", stop_time) as progress:
        trajectory = entry_points.simulate(
            source,
            stop_time=stop_time,
            step=step,
            tolerance=tolerance,
            values=values,
            inputs=signals,
            hold=hold,
            progress=progress,
        )
    _write(trajectory, out, units)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.motion import motion_figure

        of_mechanism = {name: value for name, value in values.items() if name not in SETTINGS}
        mechanism = entry_points.mechanism_of(source, of_mechanism)
        title = Path(model).stem if mechanism is None else mechanism.title
        save(motion_figure(title, trajectory, mechanism, signals), plot)


def _source_and_values(model: str, settings: tuple[str, ...]) -> tuple[Model, dict[str, float], dict[str, Unit]]:
    """What to run, the values to set in the FMU (SI), and the units in which its mechanism, if known, is shown.

    The values are all that --set gave, or those of the solver for a MODEL.
    """
    from lag2fmu.description.names import SETTINGS
    from lag2fmu.formats.loading import pairs_of, values_of
    from lag2fmu.mechanism.display import display_units
    from lag2fmu.verify import entry_points

    if entry_points.is_fmu(Path(model)):
        texts, inside = pairs_of(settings), entry_points.mechanism_of(Path(model))
        units = {} if inside is None else display_units(inside)
        echo_settings(texts, units)
        return Path(model), values_of(texts, units), units
    of_solver = [item for item in settings if item.partition("=")[0].strip() in SETTINGS]
    mechanism = load_mechanism(model, tuple(item for item in settings if item not in of_solver))
    texts, units = pairs_of(of_solver), display_units(mechanism)
    echo_settings(texts, units)
    return mechanism, values_of(texts, units), units


def _write(trajectory: Trajectory, out: str | None, units: Mapping[str, Unit]) -> None:
    """The trajectory in ``units`` as CSV to a file or ("-") standard output, or a summary of it."""
    if out == "-":
        click.echo(trajectory.to_csv(units), nl=False)
    elif out is not None:
        trajectory.write_csv(out, units)
        click.echo(f"wrote {out}", err=True)
    else:
        print_summary(trajectory, units)
