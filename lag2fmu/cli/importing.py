"""The work of the verb ``import``."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.cli.options import check_ending, refuse_to_overwrite
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.errors import ExportError
from lag2fmu.formats.write import write
from lag2fmu.progress import progress_bar
from lag2fmu.writing import replacing


def import_model(model: str, path: str | None, force: bool, settings: tuple[str, ...]) -> None:
    """Write ``model`` as text to ``path`` and print a summary of it.

    Raises LoadError for a model that cannot be imported, ExportError for a file that exists.
    """
    target = None if path is None or path == "-" else Path(path)
    if target is not None:
        check_ending(target, (".toml",))
    with progress_bar("reading", None):
        mechanism = load_mechanism(model, settings)
        text = write(mechanism, Path() if target is None else target.parent)
    if path == "-":
        click.echo(text, nl=False)
        return
    target = target or Path(f"{mechanism.name}.toml")
    refuse_to_overwrite(target, force=force)
    try:
        with replacing(target) as new:
            new.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        raise ExportError(f"cannot write '{target}': {error.strerror}; choose another place with -o") from error
    counted = ", ".join(
        f"{len(getattr(mechanism, kind))} {kind}"
        for kind in ("coordinates", "bodies", "frictions", "stops", "constraints", "parameters")
        if getattr(mechanism, kind)
    )
    click.echo(f"wrote {target}: {counted}; try 'lag2fmu validate {target}'")
