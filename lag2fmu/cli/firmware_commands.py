"""The verb of plain C with its options; the work is in a module that is imported when it runs."""

from __future__ import annotations

from typing import Any

import click

from lag2fmu.cli.options import MODEL, PATH, loading


@click.command("c")
@MODEL
@click.option("-o", "--out", "folder", type=PATH, required=True, metavar="FOLDER", help="Where the files go.")
@click.option("--solver", metavar="NAME", help="A solver of fixed steps; by default one that suits the start.")
@click.option("--step", type=float, metavar="S", help="Longest step of the program; default: that of the experiment.")
@click.option("--solver-steps", type=int, metavar="N", help="Solver steps in it; default: as many as in an FMU.")
@click.option(
    "--real", type=click.Choice(["double", "float"]), default="double", show_default=True, help="Type of all numbers."
)
@click.option("--own-math", is_flag=True, help="Bring sines and the like, with the same bits on every target.")
@click.option("--prefix", metavar="NAME", help="Of all names in C; default: the name of the mechanism.")
@click.option("--ram", type=int, metavar="BYTES", help="Refuse an instance that takes more.")
@click.option("--compiler", type=click.Choice(["zig", "host"]), default="zig", show_default=True)
@click.option("--report", is_flag=True, help="Write REPORT.md: memory on processors, work and errors of steps.")
@click.option("--force", is_flag=True, help="Overwrite files that exist.")
@loading
def c_command(**choices: Any) -> None:
    """Write MODEL as plain C for firmware: no FMI, no operating system, no heap, steps of bounded work."""
    from lag2fmu.cli.writing_c import write_c

    write_c(**choices)
