"""The verbs of studies with their options; the work of each verb is in a module of its own, imported when it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.options import HOLD, INPUT, MODEL, PATH, STOP_TIME, loading


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
@click.option("--solver", metavar="NAME", help="Integrator, one that carries derivatives; default dop853.")
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="TOML", help="Write the calibrated mechanism.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw fit and residuals (.png, .svg, .pdf).")
@click.option("--force", is_flag=True, help="Overwrite a TOML file that exists.")
@loading
def calibrate(**choices: Any) -> None:
    """Estimate parameters and starts of MODEL from measured columns: time,name [unit],... in CSV files."""
    from lag2fmu.cli.calibrating import calibrate_model

    calibrate_model(**choices)


@click.command()
@click.argument("model")
@click.argument("data", type=click.Path(path_type=Path), metavar="CSV")
@click.option(
    "--measure",
    multiple=True,
    required=True,
    metavar="NAME[=STD],...",
    help="A measured column and its noise, by default 1 % of the nominal value; repeatable.",
)
@click.option(
    "--process",
    multiple=True,
    metavar="NAME=DENSITY,...",
    help="White noise of an input, state or parameter, in its unit by the root of Hz; repeatable.",
)
@click.option("--known", multiple=True, metavar="NAME=STD,...", help="How well the start of a state is known.")
@click.option("--estimate", default="", metavar="NAME,...", help="Parameters that are estimated too.")
@click.option("--delay", multiple=True, metavar="NAME=S,...", help="Samples of it are so many s late; repeatable.")
@click.option("--method", type=click.Choice(["ekf", "ukf", "ukf-simplex", "mhe"]), default="ekf", show_default=True)
@click.option(
    "--horizon", type=click.IntRange(min=1), metavar="N", help="mhe looks at the last N samples.  [default: 10]"
)
@click.option("--smooth", is_flag=True, help="Estimates know later samples too.")
@HOLD
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="CSV", help="Write the estimates over time.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the estimates (.png, .svg, .pdf).")
@click.option("--force", is_flag=True, help="Overwrite a CSV file that exists.")
@loading
def observe(**choices: Any) -> None:
    """Estimate all states of MODEL from measured columns, time,name [unit],... in a CSV file."""
    from lag2fmu.cli.observing import observe_data

    observe_data(**choices)


@click.command()
@click.argument("model", metavar="MODEL|FMU")
@click.option(
    "--vary",
    multiple=True,
    required=True,
    metavar="NAME=A:B:N|NAME=V,V,...|NAME=@CSV",
    help="What varies, in its declared unit: N values from A to B, a list, or a column of a table; repeatable. "
    "With --sample A:B is a range.",
)
@click.option("--sample", type=int, metavar="N", help="Draw N runs instead of the full grid.")
@click.option(
    "--sampling",
    type=click.Choice(["random", "sobol", "halton", "latin"]),
    default="random",
    show_default=True,
    help="How they are drawn; the last three are quasi-random.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the sample.")
@click.option("--output", "outputs", multiple=True, metavar="NAME", help="What is read; repeatable; default: outputs.")
@click.option("--at-end", is_flag=True, help="Read outputs at the end only; else at 101 times.")
@click.option("--times", metavar="S,S,...", help="Read outputs at these times in seconds.")
@STOP_TIME
@click.option("--tolerance", type=float, help="Relative tolerance of the solver.")
@click.option("--solver", metavar="NAME", help="Integrator, as in export; not for an FMU.")
@INPUT
@HOLD
@click.option("--workers", type=int, metavar="N", help="Run parts in N processes of this machine; for FMUs.")
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The result, .nc (NetCDF) or .parquet; the same command after an interruption goes on.",
)
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@loading
def sweep(**choices: Any) -> None:
    """Run MODEL, an FMU or a system (.ssp, .ssd) many times, over all that --vary says; write one table of results."""
    from lag2fmu.cli.sweeping import SweepOptions, sweep_model

    sweep_model(SweepOptions(**choices))


@click.command()
@MODEL
@click.option(
    "--at",
    default="start",
    show_default=True,
    metavar="start|equilibrium|S",
    help="About the start, the equilibrium found from there, or the state reached after S seconds.",
)
@click.option("--input", "inputs", multiple=True, metavar="NAME", help="An input u; repeatable; by default all.")
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="NAME",
    help="An output y, any variable that is calculated; repeatable; by default those of the FMU.",
)
@click.option(
    "--sample", type=float, metavar="S", help="Matrices of samples every S seconds, with inputs held between them."
)
@click.option("-o", "--out", "path", type=PATH, metavar="FILE", help="Write .json, .mat or .npz too.")
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@loading
def linearize(**choices: Any) -> None:
    """Print the state space dx/dt = A x + B u, y = C x + D u of small motions, and its poles."""
    from lag2fmu.cli.linearizing import linearize_model

    linearize_model(**choices)
