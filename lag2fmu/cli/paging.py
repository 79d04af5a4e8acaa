"""The work of the verb ``page``."""

from __future__ import annotations

from pathlib import Path

import click

from lag2fmu.cli.options import refuse_to_overwrite
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.errors import ExportError
from lag2fmu.fmu.live.paging import page
from lag2fmu.progress import progress_bar
from lag2fmu.verify.page_samples import page_samples
from lag2fmu.verify.reference_files import SHORT, reference_of, shortened


def write_page(
    model: str,
    path: Path | None,
    solver: str | None,
    reference: bool,
    limit: float,
    force: bool,
    settings: tuple[str, ...],
) -> None:
    """Write the live page of ``model`` and print its size.

    Raises ExportError for a ``path`` that is no .html or exists, and the errors of ``page``.
    """
    mechanism = load_mechanism(model, settings)
    path = Path(f"{Path(model).stem}.html") if path is None else path
    if path.suffix not in (".html", ".htm"):
        raise ExportError(f"the output '{path}' does not end in .html; browsers know pages by this ending")
    refuse_to_overwrite(path, force=force)
    samples = None
    if reference:
        with progress_bar("integrating directly", 1.0) as share:
            integrated = reference_of(mechanism, share, limit)
        click.echo(shortened(mechanism, integrated, SHORT), nl=False, err=True)
        samples = page_samples(mechanism, integrated)
    with progress_bar("building", None):
        text = page(mechanism, path, solver=solver, samples=samples)
    click.echo(f"wrote {path}, {len(text.encode()) / 1000:.0f} kB: open it in a browser")
