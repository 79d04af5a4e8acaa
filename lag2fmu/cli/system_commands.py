"""The verbs of systems of FMUs with their options; the work is in a module that is imported when a verb runs."""

from __future__ import annotations

from typing import Any

import click

from lag2fmu.cli.options import CONNECT, FMI, JOIN, MODEL, PATH, SOLVER, STOP_TIME, loading


@click.command()
@click.argument("fmus", nargs=-1, required=True, metavar="[NAME=]COMPONENT...")
@click.option("-o", "--out", "path", type=PATH, required=True, metavar="FILE", help="The .ssp.")
@CONNECT
@JOIN
@STOP_TIME
@click.option("--version", default="1.0", show_default=True, metavar="N", help="Of SSP: 1.0 or 2.0.")
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@click.option(
    "--set", "settings", multiple=True, metavar="A.NAME=VALUE", help="A parameter or start value; repeatable."
)
def ssp(**choices: Any) -> None:
    """Write FMUs, of any tool, and functions FILE.py:NAME@S with their connections and values as an archive (SSP)."""
    from lag2fmu.cli.systems import write_system

    write_system(**choices)


@click.command("cut")
@MODEL
@click.option(
    "--at",
    multiple=True,
    required=True,
    metavar="NAME",
    help="A frame, or the coordinate by which it or bodies of the plane move, to be cut off; repeatable.",
)
@click.option("-o", "--out", "path", type=PATH, metavar="FILE", help="The .ssp; default MODEL.ssp.")
@FMI
@SOLVER
@click.option("--force", is_flag=True, help="Overwrite a file that exists.")
@loading
def cut_command(**choices: Any) -> None:
    """Cut MODEL into FMUs at joints of its tree, and write the system that holds them together by ideal joints."""
    from lag2fmu.cli.cutting import cut_model

    cut_model(**choices)
