"""What ``page`` does."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.cli.settings import load_mechanism
from lag2fmu.errors import ExportError
from lag2fmu.fmu.paging import page
from lag2fmu.verify.page_samples import page_samples


def write_page(
    model: str, path: Path | None, solver: str | None, reference: bool, force: bool, settings: tuple[str, ...]
) -> None:
    """Write the live page of ``model`` and say how large it is; raises Lag2FmuError."""
    mechanism = load_mechanism(model, settings)
    path = Path(f"{Path(model).stem}.html") if path is None else path
    if path.suffix not in (".html", ".htm"):
        raise ExportError(f"the output '{path}' does not end in .html; browsers know pages by this ending")
    if path.exists() and not force:
        raise ExportError(f"'{path}' exists; overwrite it with --force, or choose another name with -o")
    samples = page_samples(mechanism) if reference else None
    text = page(mechanism, path, solver=solver, samples=samples)
    click.echo(f"wrote {path}, {len(text.encode()) / 1000:.0f} kB: open it in a browser")
