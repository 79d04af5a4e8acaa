"""The work of the verb ``observe``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.analysis.observing import assumed_noise
from lag2fmu.cli.calibrating import in_unit, size_of
from lag2fmu.cli.options import CSV, check_ending, check_picture, refuse_to_overwrite
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import console
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.studies.estimates import Estimates
from lag2fmu.studies.observer import observe


def noise_of(items: Iterable[str], mechanism: Mechanism, units: Mapping[str, Unit]) -> dict[str, float]:
    """{measured name: standard deviation, SI} of ``items`` NAME[=STD]; tells what is assumed where none is given.

    Raises LoadError for items of another form, and for variables of which nothing can be assumed.
    """
    names = [item.strip() for item in items]
    given = pairs_of(name for name in names if "=" in name)
    found: dict[str, float] = {}
    for item in names:
        name = item.partition("=")[0].strip()
        if name in found:
            raise LoadError(f"measure '{name}' is given twice; leave one out")
        if name in given:
            found[name] = size_of(name, given[name], units)
            continue
        found[name] = assumed_noise(mechanism, name)
        unit = units.get(name)
        shown = f"{in_unit(found[name], unit):g}{f' {unit.name}' if unit else ''}"
        told = f"standard deviation {shown}, a hundredth of its nominal value; give {name}=STD for another"
        click.echo(f"measure '{name}': {told}", err=True)
    return found


def observe_data(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    data: Path,
    measure: tuple[str, ...],
    process: tuple[str, ...],
    known: tuple[str, ...],
    estimate: str,
    delay: tuple[str, ...],
    method: str,
    smooth: bool,
    hold: bool,
    out: Path | None,
    plot: Path | None,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Print the estimates at the end, and write all of them and a picture.

    Raises Lag2FmuError for a model, data or options that do not fit.
    """
    check_picture(plot)
    if out is not None:
        check_ending(out, CSV)
        refuse_to_overwrite(out, force=force)
    mechanism = load_mechanism(model, settings)
    units = display_units(mechanism)

    def sizes(pairs: tuple[str, ...]) -> dict[str, float]:
        return {name: size_of(name, text, units) for name, text in pairs_of(pairs).items()}

    found = observe(
        mechanism,
        data,
        measure=noise_of(measure, mechanism, units),
        process=sizes(process),
        start=sizes(known),
        estimate=[name.strip() for name in estimate.split(",") if name.strip()],
        delays={name: float(size_of("time", text, {})) for name, text in pairs_of(delay).items()},
        method=method,
        smooth=smooth,
        hold=hold,
    )
    console().print(_of_estimates(found, units))
    click.echo(f"mean innovation squared by degree: {found.consistency:.3g}; 1 where model and noise are right")
    for warning in found.warnings:
        click.echo(f"warning: {warning}", err=True)
    if out is not None:
        found.save(out)
        click.echo(f"wrote {out}", err=True)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save

        save(found.plot(), plot)
        click.echo(f"wrote {plot}", err=True)


def _of_estimates(found: Estimates, units: Mapping[str, Unit]) -> Table:
    table = Table(box=None, pad_edge=False)
    for i, heading in enumerate((f"at {found.time[-1]:g} s", "unit", "estimate", "standard deviation")):
        table.add_column(heading, justify="left" if i < 2 else "right", overflow="fold")
    for name in found.names:
        unit, value, size = units.get(name), float(found[name][-1]), float(found.deviation(name)[-1])
        shown = value if unit is None else unit.from_si(value)
        table.add_row(escape(name), escape(unit.name if unit else ""), f"{shown:.6g}", f"{in_unit(size, unit):.3g}")
    return table
