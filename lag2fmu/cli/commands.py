"""The verbs of the command line with their options; the work of each verb is in a module of its own.

That module is imported when the verb runs. It takes about a second to import, and ``--help`` must not wait for it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.options import (
    APART,
    CONNECT,
    COUPLING,
    FMI,
    HOLD,
    INPUT,
    JOIN,
    MODEL,
    MODEL_OR_FMU,
    MODELS,
    PATH,
    PATIENCE,
    PLATFORM,
    SOLVER,
    STOP_TIME,
    TIME_LIMIT,
    WITHIN,
    loading,
    observing,
)
from lag2fmu.cli.terminal import console
from lag2fmu.formats.starting import write_start
from lag2fmu.resources import bundled, summary


@click.command()
@click.option("--plot", "plot", type=PATH, help="Write the comparison as a picture (.png, .svg, .pdf).")
def demo(**choices: Any) -> None:
    """Export, simulate and validate a double pendulum; print what was compared."""
    from lag2fmu.cli.validating import validate_demo

    validate_demo(**choices)


@click.command()
def models() -> None:
    """List the mechanisms that come with lag2fmu."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    for heading in ("model", "what it is"):
        table.add_column(heading)
    for name, path in bundled().items():
        table.add_row(name, summary(path))
    console().print(table)


@click.command()
@click.argument("name")
def new(name: str) -> None:
    """Write NAME.toml, a commented mechanism to start from, and the schema with which editors check it."""
    path, schema = write_start(name, Path())
    click.echo(f"wrote {path}, a cart with a pole to start from: try 'lag2fmu validate {path}'")
    click.echo(f"{schema} beside it lets editors complete and check the file (Even Better TOML, Taplo)")


@click.command()
@MODEL
@click.option(
    "--format",
    "style",
    type=click.Choice(["text", "unicode", "latex", "toml"]),
    help="Formulas: unicode by default on a terminal that knows it, else text. toml: the mechanism itself.",
)
@click.option("--plot", type=PATH, help="Draw the mechanism and its normal modes (.png, .svg, .pdf).")
@click.option("--analysis", is_flag=True, help="Conserved quantities, equilibria, modes and more, after the steps.")
@click.option("--coupling", is_flag=True, help="The analysis, with communication steps that go with other FMUs.")
@click.option("--full", is_flag=True, help="Write long formulas to their end.")
@click.option("--realtime", is_flag=True, help="What it takes as plain C: memory, stack, code; instead of steps.")
@WITHIN
@loading
def show(**choices: Any) -> None:
    """Walk the twelve steps of the textbook procedure, or write the mechanism as text (toml)."""
    from lag2fmu.cli.showing import show_mechanism

    show_mechanism(**choices)


@click.command("export")
@MODEL
@click.option("-o", "--out", "path", type=PATH, metavar="FILE", help="The FMU; default MODEL.fmu.")
@PLATFORM
@SOLVER
@click.option("--compiler", type=click.Choice(["zig", "host"]), default="zig", show_default=True)
@click.option(
    "--output",
    "outputs",
    multiple=True,
    metavar="NAME",
    help="Make a local variable an output ('all': each); repeatable.",
)
@click.option(
    "--inputs", metavar="NAMES", help="The inputs that there are: F,Q_x or 'none' or 'all'; others keep still."
)
@click.option(
    "--port",
    "ports",
    multiple=True,
    metavar="KEY=NAMES,...",
    help="Forces, torques in, poses, velocities, accelerations of places out: forces=tip,hand:frame,poses=tip; "
    "repeatable.",
)
@click.option(
    "--backend",
    type=click.Choice(["c", "python"]),
    default="c",
    show_default=True,
    help="Native library, or readable Python (needs Python on the importing side).",
)
@FMI
@click.option("--arrays", is_flag=True, help="FMI 3.0: coordinates, velocities, accelerations and forces as arrays.")
@click.option(
    "--start",
    type=click.Choice(["given", "equilibrium"]),
    default="given",
    show_default=True,
    help="Start as the model says, or at rest in the equilibrium found from there.",
)
@click.option(
    "--inverse",
    metavar="NAMES",
    help="Inverse dynamics: these coordinates (a,b or 'all') or places are inputs, the forces that move them so are "
    "outputs.",
)
@click.option(
    "--time-constant",
    type=float,
    metavar="S",
    help="With --inverse: positions alone come in, and are smoothed by a filter of this time constant.",
)
@click.option(
    "--without",
    multiple=True,
    metavar="WORD",
    help="Leave out: sources, equations (of the page), description (the mechanism), clocks (of FMI 3.0); or friction, "
    "stops, contacts of MODEL; repeatable, or a,b.",
)
@click.option(
    "--page",
    type=click.Choice(["live", "static"]),
    help="Page of the documentation: the mechanism in motion (the default), or a picture and less to carry.",
)
@click.option("--reference", is_flag=True, help="Put a reference trajectory in, to check FMU and page with.")
@click.option(
    "--profile",
    type=click.Choice(["desktop", "realtime"]),
    default="desktop",
    show_default=True,
    help="realtime: steps of bounded work, no memory after instantiation.",
)
@click.option("--step", type=float, metavar="S", help="Longest communication step of the profile realtime.")
@click.option(
    "--sources",
    type=click.Choice(["many", "single"]),
    default="many",
    show_default=True,
    help="The C code in many files, or in a single one.",
)
@observing
@WITHIN
@click.option("--force", is_flag=True, help="Overwrite FILE also where it holds another mechanism.")
@loading
def export_command(**choices: Any) -> None:
    """Write the FMU of MODEL, by default to a file of the same name here."""
    from lag2fmu.cli.exporting import ExportOptions, export_model

    export_model(ExportOptions(**choices))


@click.command("page")
@MODEL
@click.option("-o", "--out", "path", type=PATH, metavar="FILE", help="The page; default MODEL.html.")
@SOLVER
@click.option(
    "--reference/--no-reference",
    default=True,
    show_default=True,
    help="Integrate the default experiment directly too, for the page to compare itself with.",
)
@WITHIN
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@loading
def page_command(**choices: Any) -> None:
    """Write a page in which MODEL moves: one file of HTML that needs no network."""
    from lag2fmu.cli.paging import write_page

    write_page(**choices)


@click.command()
@MODELS
@CONNECT
@JOIN
@APART
@PATIENCE
@COUPLING
@STOP_TIME
@click.option("--step", type=float, metavar="S", help="Communication step in seconds.")
@click.option("--tolerance", type=float, help="Relative tolerance of the solver.")
@SOLVER
@INPUT
@HOLD
@click.option(
    "--output",
    "wanted",
    multiple=True,
    metavar="NAME",
    help="Record another variable too, as a force or an energy ('all': each local one); repeatable.",
)
@click.option("-o", "--out", metavar="CSV", help="Write the trajectory; '-' is standard output.")
@click.option("--plot", type=PATH, help="Draw the motion (.png, .svg, .pdf).")
@click.option("--animate", "animation", type=PATH, metavar="FILE", help="Show it moving (.gif, .mp4, .html).")
@click.option("--force", is_flag=True, help="Overwrite a CSV file that exists.")
@loading
def simulate(**choices: Any) -> None:
    """Run MODEL, an FMU, or a system by fmpy: .ssp, .ssd, or models, FMUs and functions FILE.py:NAME@S by name."""
    from lag2fmu.cli.motions import SimulateOptions, is_one_model

    if not is_one_model(choices["models"]):
        from lag2fmu.cli.systems import run_system as run
    else:
        from lag2fmu.cli.simulating import simulate_model as run
    run(SimulateOptions(**choices))


@click.command()
@MODEL_OR_FMU
@STOP_TIME
@click.option("--tolerance", type=float, help="Relative tolerance of the FMU's solver.")
@WITHIN
@INPUT
@HOLD
@SOLVER
@FMI
@click.option(
    "--report",
    "reports",
    multiple=True,
    type=PATH,
    help="Write .json, .txt, .png, .svg; repeatable.",
)
@loading
def validate(**choices: Any) -> None:
    """Compare the FMU with a direct integration of the mechanism; exit with 3 where too little could be compared."""
    from lag2fmu.cli.validating import validate_model

    validate_model(**choices)


@click.command("import")
@click.argument("model", metavar="FILE")
@click.option("-o", "--out", "path", metavar="FILE", help="The text, .toml; default NAME.toml, '-' is standard output.")
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@loading
def import_command(**choices: Any) -> None:
    """Write the robot (.urdf, MJCF as .xml) or SymPy's mechanics (FILE.py:NAME) in FILE as a mechanism in text."""
    from lag2fmu.cli.importing import import_model

    import_model(**choices)


@click.command()
@click.argument("fmu", type=PATH)
@click.option("--run/--no-run", default=True, show_default=True, help="Run its library, in a process of its own.")
@click.option("--key", help="FMU.minisig has to be signed by this public key of minisign, a text or a file.")
@TIME_LIMIT
def check(**choices: Any) -> None:
    """Check FMU, of any tool, by the rules of FMI 2.0 or 3.0; running it executes code that is in it."""
    from lag2fmu.cli.checking import check_archive

    check_archive(**choices)
