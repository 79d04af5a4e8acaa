"""The work of the verb ``ssp``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from lag2fmu.cli.options import check_ending
from lag2fmu.errors import ExportError, LoadError
from lag2fmu.formats.loading import pairs_of, values_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.systems.ssp import ssp
from lag2fmu.verify.entry_points import mechanism_of


def write_system(
    fmus: tuple[str, ...],
    path: Path,
    connect: tuple[str, ...],
    stop_time: float | None,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the system of ``fmus`` and print a summary of it.

    Raises LoadError for FMUs, connections and values that do not fit, ExportError for a file that exists.
    """
    check_ending(path, (".ssp",))
    if path.exists() and not force:
        raise ExportError(f"'{path}' exists; overwrite it with --force, or choose another name with -o")
    named: dict[str, str] = {}
    for fmu in fmus:
        name, equals, file = fmu.rpartition("=")
        name = name if equals else Path(fmu).stem
        if name in named:
            raise LoadError(f"'{fmu}': there is a component '{name}' already; call one otherwise, e.g. {name}_2={file}")
        named[name] = file
    texts = pairs_of(settings)
    values = values_of(texts, _units(named, {name.partition(".")[0] for name in texts}))
    ssp(named, path, connect=connect, values=values, stop_time=stop_time)
    told = f"{len(named)} FMUs, {len(connect)} connections" + (f", {len(values)} values" if values else "")
    click.echo(f"wrote {path}: {told}")


def _units(named: dict[str, str], wanted: Iterable[str]) -> dict[str, Unit]:
    """{COMPONENT.VARIABLE: unit declared by the user} of the FMUs that contain their mechanism."""
    found: dict[str, Unit] = {}
    for name in wanted:
        mechanism = mechanism_of(Path(named[name])) if name in named else None
        if mechanism is not None:
            found |= {f"{name}.{variable}": unit for variable, unit in display_units(mechanism).items()}
    return found
