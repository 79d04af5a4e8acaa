"""The verbs of systems of FMUs with their options; the work is in a module that is imported when a verb runs."""

from __future__ import annotations

from typing import Any

import click

from lag2fmu.cli.options import PATH, STOP_TIME


@click.command()
@click.argument("fmus", nargs=-1, required=True, metavar="[NAME=]FMU...")
@click.option("-o", "--out", "path", type=PATH, required=True, metavar="FILE", help="The .ssp.")
@click.option(
    "--connect",
    multiple=True,
    metavar="A.X:B.Y",
    help="An output of the component A and an input of B, or two terminals; repeatable.",
)
@click.option(
    "--join",
    multiple=True,
    metavar="A.P:B.P=KIND[:AXIS]",
    help="Two places that are ports, and the ideal joint between them, for 'lag2fmu simulate'; repeatable.",
)
@STOP_TIME
@click.option("--version", default="1.0", show_default=True, metavar="N", help="Of SSP: 1.0 or 2.0.")
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@click.option(
    "--set", "settings", multiple=True, metavar="A.NAME=VALUE", help="A parameter or start value; repeatable."
)
def ssp(**choices: Any) -> None:
    """Write a system of FMUs, of any tool, with their connections and parameters as an archive (SSP)."""
    from lag2fmu.cli.systems import write_system

    write_system(**choices)
