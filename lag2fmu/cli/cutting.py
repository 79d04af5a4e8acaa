"""The work of the verb ``cut``."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.cli.options import check_ending, refuse_to_overwrite
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.systems.cutting import cut


def cut_model(
    model: str,
    at: tuple[str, ...],
    path: Path | None,
    fmi: str | None,
    solver: str | None,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the system of the pieces of ``model`` and print what they are.

    Raises Lag2FmuError for a model that cannot be cut there, and for a file that exists or cannot be written.
    """
    target = Path(f"{Path(model).stem}.ssp") if path is None else path
    check_ending(target, (".ssp",))
    refuse_to_overwrite(target, force=force)
    pieces = cut(load_mechanism(model, settings), at, target, fmi=fmi or "2.0", solver=solver)
    click.echo(f"wrote {target}: {', '.join(pieces.descriptions)}")
    for joint in pieces.joints:
        click.echo(f"  {joint.kind} joint between {' and '.join(joint.ends)}")
    if pieces.left_out:
        click.echo(f"left out, of several pieces at once: {', '.join(pieces.left_out)}", err=True)
