"""Names that a package offers without importing their modules, so that one of its modules does not load them all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def offered(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """The ``__getattr__`` of ``package``, which imports the names in ``homes`` {name: module} at their first use.

    It raises AttributeError for any other name. No name may be that of a module of the package. Source: PEP 562.
    """

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'; there are {', '.join(homes)}")
        return getattr(import_module(homes[name]), name)

    return find


def looked_up(module: str, name: str) -> Any:
    """The attribute ``name`` of ``module``, imported at this moment.

    Records use it to draw themselves, because they may not import the rooms that draw.
    """
    return getattr(import_module(module), name)
