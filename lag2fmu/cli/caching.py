"""The verb ``cache``: what is kept in the user's cache."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import click


@click.command()
@click.option("--empty", is_flag=True, help="Remove all of it; what is needed again is compiled again.")
def cache(*, empty: bool) -> None:
    """Show the kept libraries and the compiler's cache, or empty both.

    LAG2FMU_LIBRARIES names another folder for libraries, or is 'off'. ZIG_GLOBAL_CACHE_DIR names another folder for the
    compiler, which is left alone here.
    """
    from lag2fmu.building.build_cache import MOST, kept_files, place, trim
    from lag2fmu.building.folders import cache_folder
    from lag2fmu.building.process import CACHE

    folder, compiler = place(), cache_folder() / "compiler"
    if empty:
        if folder is not None:
            trim(folder, 0)
        shutil.rmtree(compiler, ignore_errors=True)
    if folder is None:
        click.echo("libraries: none are kept, as LAG2FMU_LIBRARIES says")
    else:
        sizes = [found.st_size for _, found in kept_files(folder)]
        click.echo(f"libraries: {len(sizes)}, {_size(sum(sizes))} of at most {_size(MOST)}, in {folder}")
    named = os.environ.get(CACHE)
    click.echo(f"compiler: {_size(_held(compiler))}, in {compiler}" + (f"; not used, {CACHE}={named}" if named else ""))


def _held(folder: Path) -> int:
    """The bytes of all files below a folder; what a compiler removes meanwhile counts as nothing."""
    files = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
    return sum(_bytes(file) for file in files)


def _bytes(file: Path) -> int:
    try:
        return file.stat().st_size
    except OSError:
        return 0


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB"
