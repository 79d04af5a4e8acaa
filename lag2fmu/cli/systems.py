"""The work of the verb ``ssp``, and of ``simulate`` for systems."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from lag2fmu.cli.motions import SimulateOptions, check_targets, write_motion
from lag2fmu.cli.options import check_ending, refuse_to_overwrite
from lag2fmu.cli.settings import echo_settings
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import pairs_of, values_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.progress import progress_bar
from lag2fmu.reference.trajectory import read_csv
from lag2fmu.systems.network import network_of
from lag2fmu.systems.running import simulate_system
from lag2fmu.systems.ssp import ssp
from lag2fmu.verify.entry_points import mechanism_of


def write_system(
    fmus: tuple[str, ...],
    path: Path,
    connect: tuple[str, ...],
    join: tuple[str, ...],
    stop_time: float | None,
    version: str,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the system of ``fmus`` and print a summary of it.

    Raises LoadError for FMUs, connections and values that do not fit, ExportError for a file that exists.
    """
    check_ending(path, (".ssp",))
    refuse_to_overwrite(path, force=force)
    named: dict[str, str] = {}
    for fmu in fmus:
        name, equals, file = fmu.rpartition("=")
        name = name if equals else Path(fmu).stem
        if name in named:
            raise LoadError(f"'{fmu}': there is a component '{name}' already; call one otherwise, e.g. {name}_2={file}")
        named[name] = file
    texts = pairs_of(settings)
    values = values_of(texts, _units(named, {name.partition(".")[0] for name in texts}))
    ssp(named, path, connect=connect, join=join, values=values, stop_time=stop_time, version=version)
    told = f"{len(named)} FMUs, {len(connect)} connections"
    told += (f", {len(join)} joints" if join else "") + (f", {len(values)} values" if values else "")
    click.echo(f"wrote {path}: {told}")


def run_system(asked: SimulateOptions) -> None:
    """Run a system and write, draw or sum up its motion.

    Raises Lag2FmuError for input that does not fit; what a run that fails has recorded until then is written.
    """
    check_targets(asked)
    if asked.animation is not None:
        raise LoadError(f"--animate {asked.animation}: a system has no picture; animate its FMUs one by one")
    path = Path(asked.model)
    texts, units = pairs_of(asked.settings), units_of_system(path)
    echo_settings(texts, units)
    try:
        with progress_bar("simulating", 1.0) as progress:
            trajectory = simulate_system(
                path,
                stop_time=asked.stop_time,
                step=asked.step,
                tolerance=asked.tolerance,
                values=values_of(texts, units),
                inputs=None if asked.inputs is None else read_csv(asked.inputs),
                hold=asked.hold,
                beside=asked.wanted,
                share=progress,
            )
    except SimulationError as error:
        if error.reached is not None and asked.out is not None:
            write_motion(error.reached, asked.out, units)
        raise
    write_motion(trajectory, asked.out, units)
    if asked.plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.motion import motion_figure

        save(motion_figure(path.stem, trajectory), asked.plot)


def units_of_system(path: Path) -> dict[str, Unit]:
    """{COMPONENT.VARIABLE: unit that the user declared} of the FMUs of a system that contain their mechanism."""
    found: dict[str, Unit] = {}
    with network_of(path) as network:
        for name, component in network.components.items():
            mechanism = mechanism_of(component.path)
            if mechanism is not None:
                found |= {f"{name}.{variable}": unit for variable, unit in display_units(mechanism).items()}
    return found


def _units(named: dict[str, str], wanted: Iterable[str]) -> dict[str, Unit]:
    """{COMPONENT.VARIABLE: unit declared by the user} of the FMUs that contain their mechanism."""
    found: dict[str, Unit] = {}
    for name in wanted:
        mechanism = mechanism_of(Path(named[name])) if name in named else None
        if mechanism is not None:
            found |= {f"{name}.{variable}": unit for variable, unit in display_units(mechanism).items()}
    return found
