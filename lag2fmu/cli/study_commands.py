"""The verbs of studies with their options; what a verb does stands in a module of its own, loaded when it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.options import BASE, HOLD, SET, STOPS


@click.command()
@click.argument("model")
@click.argument("data", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="CSV...")
@click.option(
    "--free", required=True, metavar="NAME,...", help="Parameters and starts to estimate; each file has own starts."
)
@click.option(
    "--noise",
    multiple=True,
    metavar="NAME=VALUE",
    help="Standard deviation of a column, if it is known; else it is estimated; repeatable.",
)
@click.option(
    "--bounds", multiple=True, metavar="NAME=A:B", help="Bounds beside those of the model, each may be left out."
)
@HOLD
@click.option("--tolerance", type=float, help="Relative tolerance of the runs; default 1e-8.")
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="TOML", help="Write the calibrated mechanism.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw fit and residuals (.png, .svg, .pdf).")
@SET
@BASE
@STOPS
def calibrate(**choices: Any) -> None:
    """Estimate parameters and starts of MODEL from measured columns: time,name [unit],... in CSV files."""
    from lag2fmu.cli.calibrating import calibrate_model

    calibrate_model(**choices)
