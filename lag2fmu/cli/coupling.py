"""The table behind the run of a system: its steps, and what the coupling did in each bond."""

from __future__ import annotations

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.cli.terminal import console
from lag2fmu.systems.coupling import CouplingReport


def print_coupling(found: CouplingReport, *, error: bool) -> None:
    """Print it to standard output, or to standard ``error``; nothing where nothing is coupled."""
    if found.error is None and not found.repeated and found.joints is None:
        return
    counts = f"{found.steps} steps of {found.shortest:.3g} to {found.longest:.3g} s, {found.repeated} repeated"
    jumps = f", {found.jumps} of the shortest length for inputs that jump" if found.jumps else ""
    largest = "" if found.error is None else f"; largest error of an input {found.error:.2g} of its size"
    click.echo(f"coupling: {counts}{jumps}{largest}", err=error)
    if found.joints is not None:
        j = found.joints
        click.echo(
            f"joints: open by {j.gap:.2g} m or rad; places astray in a step by {j.astray:.2g} of its size; "
            f"runs of a step {j.median:g} in the median, {j.most} at most",
            err=error,
        )
    if found.bonds:
        table = Table()
        for heading in ("bond", "energy made", "energy exchanged"):
            table.add_column(heading, justify="left" if heading == "bond" else "right", overflow="fold")
        for bond in found.bonds:
            table.add_row(escape(f"{bond.effort}, {bond.motion}"), f"{bond.made:.3g} J", f"{bond.exchanged:.3g} J")
        console(error=error).print(table)
    for sentence in found.unjudged:
        click.echo(f"not judged: {sentence}", err=error)
