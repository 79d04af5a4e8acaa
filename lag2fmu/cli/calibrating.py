"""The work of the verb ``calibrate``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.cli.noise import in_unit, size_of
from lag2fmu.cli.options import check_ending, check_picture, refuse_to_overwrite
from lag2fmu.cli.settings import load_with_inputs
from lag2fmu.cli.terminal import console
from lag2fmu.description.names import SETTINGS
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import value_in_si
from lag2fmu.progress import progress_bar
from lag2fmu.studies.calibrated import Calibration
from lag2fmu.studies.calibration import TOLERANCE, calibrate

_MOST = 12
"""The most estimates whose correlations are printed."""


def calibrate_model(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    data: tuple[Path, ...],
    free: str,
    noise: tuple[str, ...],
    bounds: tuple[str, ...],
    hold: bool,
    tolerance: float | None,
    solver: str | None,
    out: Path | None,
    plot: Path | None,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Print the estimates, and write mechanism and picture.

    Raises Lag2FmuError for a model, data or options that do not fit.
    """
    check_picture(plot)
    if out is not None:
        check_ending(out, (".toml",))
        refuse_to_overwrite(out, force=force)
    mechanism, values, units = load_with_inputs(model, settings, SETTINGS)
    with progress_bar("estimating", None, "runs") as progress:
        found = calibrate(
            mechanism,
            list(data),
            values=values,
            solver=solver,
            free=[name.strip() for name in free.split(",") if name.strip()],
            bounds={name: _range(name, text, units) for name, text in pairs_of(bounds).items()},
            noise={name: size_of(name, text, units) for name, text in pairs_of(noise).items()},
            hold=hold,
            tolerance=TOLERANCE if tolerance is None else tolerance,
            progress=progress,
        )
    _print(found, units)
    for warning in found.warnings:
        click.echo(f"warning: {warning}", err=True)
    if out is not None:
        found.save(out)
        click.echo(f"wrote {out}", err=True)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save

        save(found.plot(), plot)
        click.echo(f"wrote {plot}", err=True)


def _range(name: str, text: str, units: Mapping[str, Unit]) -> tuple[float, float]:
    """The bounds ``A:B`` of ``name`` in SI units, infinite if A or B is left out; raises LoadError without colon."""
    low, mark, high = text.partition(":")
    if not mark:
        raise LoadError(f"--bounds {name}={text}: give {name}=A:B, with A or B left out where there is none")
    return tuple(  # type: ignore[return-value]
        value_in_si(name, side.strip(), units) if side.strip() else default
        for side, default in ((low, float("-inf")), (high, float("inf")))
    )


def _print(found: Calibration, units: Mapping[str, Unit]) -> None:
    """Print the tables of estimates (in the declared units) and of correlations, and the noise."""
    console().print(_of_estimates(found, units))
    if 1 < len(found.names) <= _MOST:
        click.echo("correlations")
        console().print(_of_correlations(found))
    sizes = ", ".join(
        f"{name} {in_unit(size, units.get(name)):.3g} {units[name].name if name in units else ''}".strip()
        for name, size in found.noise.items()
    )
    click.echo(f"noise: {sizes}; {found.chi_squared:.4g} squares for {found.degrees_of_freedom} degrees of freedom")


def _of_estimates(found: Calibration, units: Mapping[str, Unit]) -> Table:
    table = _table("", "unit", "estimate", "standard error", "95 % from", "to", left=2)
    for name, x, error in zip(found.names, found.estimates, found.standard_errors, strict=True):
        unit = units.get(name.partition("[")[0])
        numbers = [float(x), *found.confidence(name)]
        value, low, high = numbers if unit is None else map(unit.from_si, numbers)
        shown = (value, in_unit(float(error), unit), low, high)
        table.add_row(escape(name), escape(unit.name if unit else ""), *(f"{number:.6g}" for number in shown))
    return table


def _of_correlations(found: Calibration) -> Table:
    table = _table("", *found.names, left=1)
    for name, row in zip(found.names, found.correlations, strict=True):
        table.add_row(escape(name), *(f"{value:.3f}" for value in row))
    return table


def _table(*headings: str, left: int) -> Table:
    """A table with the first columns aligned to the left, numbers to the right."""
    table = Table(box=None, pad_edge=False)
    for i, heading in enumerate(headings):
        table.add_column(escape(heading), justify="left" if i < left else "right", overflow="fold")
    return table
