"""Model files in Python: programs of the user, which are run.

They make a mechanism by a function that returns a Mechanism, or by an object of SymPy's mechanics.
"""

from __future__ import annotations

import importlib.util
import inspect
import sys
import traceback
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism


def model_function(path: Path, name: str = "") -> Callable[..., object]:
    """The function that makes the mechanism of the program ``path``: the thing called ``name``, or its model function.

    The model function is the public function named like the file, or the only one that is defined there and may return
    a Mechanism. Raises LoadError if there is none, and, with the line, for any error of the program.
    """
    module = _module(path.resolve(), _source(path))
    return _named(path, module, name) if name else _only_function(path, module)


def _named(path: Path, module: ModuleType, name: str) -> Callable[..., object]:
    """The thing called ``name`` in ``module``, as a function; raises LoadError if it makes no mechanism."""
    if name not in vars(module):
        known = [key for key, item in vars(module).items() if _could_be_meant(item, module)]
        raise LoadError(f"{path}: there is no '{name}'; {suggestion(name, known)}")
    found = vars(module)[name]
    if inspect.isfunction(found) and not inspect.signature(found).parameters:
        found = guarded(path, found)  # a function that makes an object of SymPy's
    if isinstance(found, Mechanism):
        return lambda: found
    if is_mechanics(found):
        return function_of_mechanics(found, name)
    if not inspect.isfunction(found):
        raise LoadError(
            f"{path}: '{name}' is of type {type(found).__name__}; expected a Mechanism, a function that returns one, "
            "or a LagrangesMethod, KanesMethod or System of SymPy"
        )
    return found


def _could_be_meant(item: object, module: ModuleType) -> bool:
    """Whether ``item`` of ``module`` may make a mechanism."""
    own = inspect.isfunction(item) and item.__module__ == module.__name__
    return own or isinstance(item, Mechanism) or is_mechanics(item)


def is_mechanics(found: object) -> bool:
    """Whether ``found`` is an object of SymPy's mechanics; there is none if this package was never imported."""
    mechanics = sys.modules.get("sympy.physics.mechanics")
    kinds = () if mechanics is None else (mechanics.LagrangesMethod, mechanics.KanesMethod, mechanics.System)
    return isinstance(found, kinds)


def function_of_mechanics(found: object, name: str) -> Callable[..., Mechanism]:
    """The function that makes the mechanism ``name`` of an object of SymPy's mechanics; its arguments are constants.

    Raises LoadError for an object that cannot be translated.
    """
    from lag2fmu.formats.mechanics import maker  # SymPy's mechanics takes a while to import

    return maker(found, name)


def _only_function(path: Path, module: ModuleType) -> Callable[..., object]:
    own = {
        name: item
        for name, item in vars(module).items()
        if inspect.isfunction(item) and item.__module__ == module.__name__ and not name.startswith("_")
    }
    if path.stem in own:
        return own[path.stem]
    declared = {n: f for n, f in own.items() if f.__annotations__.get("return") in (Mechanism, "Mechanism")} or own
    if len(declared) != 1:
        found = ", ".join(declared) or "none"
        objects = [key for key, item in vars(module).items() if isinstance(item, Mechanism) or is_mechanics(item)]
        remedy = f"; of objects tell which: {', '.join(f'{path}:{key}' for key in objects)}" if objects else ""
        raise LoadError(
            f"{path}: expected a function '{path.stem}' that returns a Mechanism; public functions there: {found}"
            f"{remedy}"
        )
    return next(iter(declared.values()))


def program(path: Path) -> dict[str, Any]:
    """{name: object} of the program ``path``, which is run anew.

    Raises LoadError for a file that cannot be read, and, with the line, for any error of the program.
    """
    return vars(_executed(path.resolve(), _source(path)))


def _source(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise LoadError(f"{path}: cannot be read: {error.strerror}") from error


def _executed(path: Path, source: bytes) -> ModuleType:
    """The module of a model file, run under a name of its own and leaving no bytecode behind."""
    name = f"lag2fmu_model_{path.stem}_{sha256(str(path).encode() + source).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None:
        raise LoadError(f"{path}: Python cannot import it")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look themselves up there while the module runs
    try:
        guarded(path, lambda: exec(compile(source, str(path), "exec"), vars(module)))  # noqa: S102 (the user's program)
    finally:
        del sys.modules[name]
    return module


_module = lru_cache(maxsize=64)(_executed)


def guarded(path: Path, action: Callable[[], object]) -> object:
    """The result of ``action``; raises LoadError, with the line of ``path``, for any exception in it."""
    try:
        return action()
    except (Exception, SystemExit) as error:
        if isinstance(error, SyntaxError) and error.filename == str(path.resolve()):
            line, text = error.lineno, f"{type(error).__name__}: {error.msg}"
        else:
            frames = traceback.extract_tb(error.__traceback__)
            line = next((f.lineno for f in reversed(frames) if Path(f.filename).resolve() == path.resolve()), None)
            text = f"{type(error).__name__}: {error}"
        raise LoadError(f"{path}, line {line}: {text}" if line else f"{path}: {text}") from error


def arguments_of(path: Path, function: Callable[..., object]) -> dict[str, inspect.Parameter]:
    """The structural arguments of ``function``, by name; raises LoadError for others than plain keyword arguments."""
    parameters = inspect.signature(function).parameters
    for p in parameters.values():
        if p.kind in (p.POSITIONAL_ONLY, p.VAR_POSITIONAL, p.VAR_KEYWORD):
            raise LoadError(
                f"{path}: {function.__name__} takes '{p}'; structural arguments are plain keyword arguments"
            )
    return dict(parameters)


def convert(value: object, p: inspect.Parameter, where: str) -> object:
    """``value`` in the type of ``p`` (int, float, str or bool, by annotation or default); raises LoadError."""
    kinds = {"int": int, "float": float, "str": str, "bool": bool}
    annotation = p.annotation if isinstance(p.annotation, str) else getattr(p.annotation, "__name__", "")
    kind = kinds.get(annotation.removesuffix(" | None"), kinds.get(type(p.default).__name__))
    if kind is None or type(value) is kind:
        return value
    try:
        if kind is bool:
            return {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}[str(value).lower()]
        if isinstance(value, bool) or (kind is int and not isinstance(value, str) and value != int(value)):  # type: ignore[call-overload]
            raise ValueError
        return kind(value)
    except (ValueError, TypeError, KeyError, OverflowError):
        raise LoadError(f"{where} expects {kind.__name__}, got {value!r}") from None
