"""What is not done before it is needed, or twice: modules are imported late, and the latest result is kept."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import wraps
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


def offered(
    package: str, file: str, moved: Mapping[str, str] = MappingProxyType({})
) -> tuple[Callable[[str], object], list[str]]:
    """The ``__getattr__`` and the ``__all__`` of ``package``, whose code is in ``file``.

    The package imports its names under ``if TYPE_CHECKING``, each ``as`` itself. Type checkers read them there, and so
    does this function; a module is imported when one of its names is first used. Other names raise AttributeError,
    which says where those in ``moved`` {name: module} are. No name may be that of a module of the package. Source: PEP
    562.
    """
    homes = _imported_for_types(Path(file).read_text("utf-8"))

    def find(name: str) -> object:
        if name in homes:
            return getattr(import_module(homes[name]), name)
        where = f"it is {moved[name]}.{name}" if name in moved else f"there are {', '.join(homes)}"
        raise AttributeError(f"module '{package}' has no attribute '{name}'; {where}")

    return find, list(homes)


def _imported_for_types(text: str) -> dict[str, str]:
    """{name: module} of the imports under ``if TYPE_CHECKING`` in the ``text`` of a module."""
    blocks = (node for node in ast.parse(text).body if isinstance(node, ast.If))
    imports = (line for block in blocks for line in block.body if isinstance(line, ast.ImportFrom))
    return {alias.name: str(line.module) for line in imports for alias in line.names}


def looked_up(module: str, name: str) -> Any:
    """The attribute ``name`` of ``module``, imported at this moment.

    Records use it to draw themselves, because they may not import the rooms that draw.
    """
    return getattr(import_module(module), name)


def latest(function: Callable[_Given, _Result]) -> Callable[_Given, _Result]:
    """``function``, which keeps its latest result for a call with the very same arguments.

    Arguments are compared by identity: to compare large records would take as long as to use them. The result must be
    one that nobody changes.
    """
    kept: list[tuple[list[tuple[str, object]], _Result]] = []

    @wraps(function)
    def call(*arguments: _Given.args, **named: _Given.kwargs) -> _Result:
        asked = [*(("", x) for x in arguments), *named.items()]
        for known, result in kept:
            if [(name, id(x)) for name, x in known] == [(name, id(x)) for name, x in asked]:
                return result
        found = function(*arguments, **named)
        kept[:] = [(asked, found)]  # another thread may put its own here at once
        return found

    return call
