"""The work of the verb ``observe``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.cli.noise import in_unit, items_of, noise_of, size_of, times_of
from lag2fmu.cli.options import CSV, check_ending, check_picture, refuse_to_overwrite
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import console
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.studies.estimates import Estimates
from lag2fmu.studies.observer import HORIZON, MOVING_HORIZON, observe


def observe_data(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    data: Path,
    measure: tuple[str, ...],
    process: tuple[str, ...],
    known: tuple[str, ...],
    estimate: str,
    delay: tuple[str, ...],
    method: str,
    horizon: int | None,
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
        return {name: size_of(name, text, units) for name, text in pairs_of(items_of(pairs)).items()}

    found = observe(
        mechanism,
        data,
        measure=noise_of(items_of(measure), mechanism, units),
        process=sizes(process),
        start=sizes(known),
        estimate=[name.strip() for name in estimate.split(",") if name.strip()],
        delays=times_of(delay),
        method=method,
        horizon=_horizon(method, horizon),
        smooth=smooth,
        hold=hold,
    )
    _print(found, units)
    if out is not None:
        found.save(out)
        click.echo(f"wrote {out}", err=True)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save

        save(found.plot(), plot)
        click.echo(f"wrote {plot}", err=True)


def _print(found: Estimates, units: Mapping[str, Unit]) -> None:
    """Print the estimates at the end, their consistency, and the warnings."""
    console().print(_of_estimates(found, units))
    click.echo(f"mean innovation squared by degree: {found.consistency:.3g}; 1 where model and noise are right")
    for warning in found.warnings:
        click.echo(f"warning: {warning}", err=True)


def _horizon(method: str, given: int | None) -> int:
    """The number of samples in a window; raises LoadError where it is given for a filter."""
    if given is not None and method != MOVING_HORIZON:
        raise LoadError(f"--horizon {given}: {method} looks at one sample after the other; leave it out, or take mhe")
    return HORIZON if given is None else given


def _of_estimates(found: Estimates, units: Mapping[str, Unit]) -> Table:
    table = Table(box=None, pad_edge=False)
    for i, heading in enumerate((f"at {found.time[-1]:g} s", "unit", "estimate", "standard deviation")):
        table.add_column(heading, justify="left" if i < 2 else "right", overflow="fold")
    for name in found.names:
        unit, value, size = units.get(name), float(found[name][-1]), float(found.deviation(name)[-1])
        shown = value if unit is None else unit.from_si(value)
        table.add_row(escape(name), escape(unit.name if unit else ""), f"{shown:.6g}", f"{in_unit(size, unit):.3g}")
    return table
