"""The work of the verb ``ssp``, and of ``simulate`` for systems."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path

import click

from lag2fmu.cli.coupling import print_coupling
from lag2fmu.cli.motions import SimulateOptions, check_targets, write_motion
from lag2fmu.cli.options import check_ending, refuse_to_overwrite
from lag2fmu.cli.settings import echo_settings
from lag2fmu.cli.system_units import units_of_network
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.exported import is_fmu
from lag2fmu.formats.loading import pairs_of, values_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.progress import progress_bar, reached
from lag2fmu.reference.trajectory import read_csv
from lag2fmu.systems.assembling import Assembly, network_of
from lag2fmu.systems.controller import is_controller
from lag2fmu.systems.controllers import controller_of
from lag2fmu.systems.running import simulate_system, start_values
from lag2fmu.systems.source import is_system
from lag2fmu.systems.ssp import ssp
from lag2fmu.verify.entry_points import mechanism_of
from lag2fmu.verify.run import Run


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
    named = _named(fmus)
    for source in named.values():
        if not is_controller(source) and not is_fmu(Path(source)):
            raise LoadError(f"'{source}' is no FMU, and no FILE.py:NAME@S; write one first: lag2fmu export {source}")
    texts = pairs_of(settings)
    values = values_of(texts, _units(named, {name.partition(".")[0] for name in texts}))
    ssp(named, path, connect=connect, join=join, values=values, stop_time=stop_time, version=version)
    told = f"{len(named)} components, {len(connect)} connections"
    told += (f", {len(join)} joints" if join else "") + (f", {len(values)} values" if values else "")
    click.echo(f"wrote {path}: {told}")


def run_system(asked: SimulateOptions) -> None:
    """Run a system and write, draw or sum up its motion.

    Raises Lag2FmuError for input that does not fit; what a run that fails has recorded until then is written.
    """
    check_targets(asked)
    if asked.animation is not None:
        raise LoadError(f"--animate {asked.animation}: a system has no picture; animate its FMUs one by one")
    if asked.solver is not None:
        raise LoadError(f"--solver {asked.solver}: a system has none; export its mechanisms, each with its own")
    texts = pairs_of(asked.settings)
    with ExitStack() as opened:
        network = opened.enter_context(network_of(*_system(asked)))
        units = units_of_network(network)
        start_values(network, values_of(texts, units))  # raises for what cannot be set, before it is shown as set
        echo_settings(texts, units)
        run = Run(
            asked.stop_time,
            asked.step,
            asked.tolerance,
            values_of(texts, units),
            hold=asked.hold,
            beside=asked.wanted,
        )
        inputs = None if asked.inputs is None else read_csv(asked.inputs)
        progress = opened.enter_context(progress_bar("simulating", 1.0))
        try:
            apart = asked.apart if asked.patience is None else asked.patience
            trajectory = simulate_system(
                network, run, inputs, progress or reached, apart=apart, coupling=asked.coupling
            )
        except SimulationError as error:
            if error.reached is not None and asked.out is not None:
                write_motion(error.reached, asked.out, units)
            raise
    write_motion(trajectory, asked.out, units)
    print_coupling(trajectory.coupling, error=asked.out == "-")
    if asked.plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.motion import motion_figure

        save(motion_figure(network.name, trajectory), asked.plot)


def _named(words: tuple[str, ...]) -> dict[str, str]:
    """{name: component} of words NAME=COMPONENT, or of components alone; raises LoadError for a name that is taken."""
    named: dict[str, str] = {}
    for word in words:
        name, equals, source = word.partition("=")
        if not equals:
            source = word
            name = controller_of(word).label if is_controller(word) else Path(word).stem
        if name in named:
            other = f"{name}_2={source}"
            raise LoadError(f"'{word}': there is a component '{name}' already; call one otherwise, e.g. {other}")
        named[name] = source
    return named


def _system(asked: SimulateOptions) -> tuple[Assembly, tuple[str, ...], tuple[str, ...]]:
    """(the system, its connections, its joints)."""
    whole = len(asked.models) == 1 and is_system(asked.models[0])
    return Path(asked.model) if whole else _named(asked.models), asked.connect, asked.join


def _units(named: dict[str, str], wanted: Iterable[str]) -> dict[str, Unit]:
    """{COMPONENT.VARIABLE: unit declared by the user} of the FMUs that contain their mechanism."""
    found: dict[str, Unit] = {}
    for name in wanted:
        is_fmu = name in named and not is_controller(named[name])
        mechanism = mechanism_of(Path(named[name])) if is_fmu else None
        if mechanism is not None:
            found |= {f"{name}.{variable}": unit for variable, unit in display_units(mechanism).items()}
    return found
