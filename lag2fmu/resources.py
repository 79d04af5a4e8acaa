"""Where the files are that come with lag2fmu: beside the package in a checkout, inside it when installed."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

from lag2fmu.errors import LoadError


@cache
def resource_folder(name: str) -> Path:
    """The folder called ``name`` (``models`` or ``templates``); raises LoadError if the installation lacks it."""
    package = Path(__file__).resolve().parent
    for folder in (package / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise LoadError(f"the folder '{name}' of lag2fmu is neither in {package} nor beside it; install lag2fmu again")


MODEL_SUFFIXES = (".py", ".toml")
"""The endings of bundled models; ``load`` knows others too."""


@cache
def bundled() -> Mapping[str, Path]:
    """The models that come with lag2fmu: name -> file, sorted by name.

    Raises LoadError where the installation lacks their folder.
    """
    files = (p for p in resource_folder("models").iterdir() if p.suffix in MODEL_SUFFIXES and p.stem.isidentifier())
    return MappingProxyType({path.stem: path for path in sorted(files) if not path.stem.startswith("_")})


def summary(model: Path) -> str:
    """The first sentence of the file ``model``, which says what it is; the file is not run."""
    text = model.read_text("utf-8")
    opening = text.lstrip("# ").splitlines()[:1] if model.suffix == ".toml" else ()
    words = "".join(opening) or ast.get_docstring(ast.parse(text)) or ""
    return " ".join(words.split("\n\n")[0].split()).partition(". ")[0].rstrip(".")
