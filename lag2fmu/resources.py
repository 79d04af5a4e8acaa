"""Where the files are that come with lag2fmu: beside the package in a checkout, inside it when installed."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.errors import LoadError


def resource_folder(name: str) -> Path:
    """The folder called ``name`` (``models`` or ``templates``); raises LoadError if the installation lacks it."""
    package = Path(__file__).resolve().parent
    for folder in (package / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise LoadError(f"the folder '{name}' of lag2fmu is neither in {package} nor beside it; install lag2fmu again")
