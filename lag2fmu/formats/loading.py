"""Loading a mechanism by name, from a model file in Python or from text, and setting its values."""

from __future__ import annotations

import importlib.util
import inspect
import math
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from lag2fmu.description import names
from lag2fmu.description.names import suggestion
from lag2fmu.description.record import Description
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import LoadError
from lag2fmu.formats.robots import READERS, robot
from lag2fmu.formats.text import read_file
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, value_in_si
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.resources import MODEL_SUFFIXES, bundled

__all__ = ["as_mechanism", "bundled", "load", "pairs_of", "split_settings", "values_of", "with_settings", "with_values"]


def as_mechanism(model: Mechanism | str | Path) -> Mechanism:
    """``model`` itself if it is a mechanism, else what ``load`` finds under its name; raises LoadError as that does."""
    if isinstance(model, Mechanism):
        return model
    if not isinstance(model, (str, Path)):
        raise LoadError(f"expected a Mechanism, a model's name or a path, got {type(model).__name__}")
    return load(model)


def load(model: str | Path, arguments: Mapping[str, object] | None = None) -> Mechanism:
    """The mechanism called ``model``: a bundled name, or a .py, .toml or .urdf file.

    ``arguments`` are the structural ones of a family (``n`` of ``n_pendulum``), or those of ``robot``; strings are
    converted to the type that the function declares. Raises LoadError if the model is missing, fails or does not take
    the arguments, and MechanismError (TextError) for what is wrong in a text.
    """
    path, arguments = find(model), dict(arguments or {})
    if path.suffix == ".toml":
        if arguments:
            raise LoadError(f"{path}: a mechanism as text has no structural arguments, got {', '.join(arguments)}")
        return read_file(path)
    function = _function_of(path)
    taken = _arguments_of(path, function)
    unknown = next((name for name in arguments if name not in taken), None)
    if unknown is not None:
        known = ", ".join(taken) or "none"
        raise LoadError(f"{path}: '{unknown}' is no structural argument of {function.__name__}; known are: {known}")
    converted = {name: _convert(value, taken[name], f"{path}: {name}") for name, value in arguments.items()}
    missing = [name for name, p in taken.items() if p.default is p.empty and name not in converted]
    if missing:
        raise LoadError(
            f"{path}: {function.__name__} needs the structural argument(s) {', '.join(missing)}; give NAME=VALUE"
        )
    mechanism = function(**converted) if path.suffix in READERS else _guarded(path, lambda: function(**converted))
    if not isinstance(mechanism, Mechanism):
        raise LoadError(f"{path}: {function.__name__} returned {type(mechanism).__name__} instead of a Mechanism")
    return mechanism


def find(model: str | Path) -> Path:
    """The file of ``model``; raises LoadError, with the names near to it, if there is none."""
    if isinstance(model, str) and model in bundled():
        return bundled()[model]
    path = Path(model)
    try:
        exists = path.is_file()
    except (OSError, ValueError) as error:
        raise LoadError(f"{str(model)[:60]!r} is no model: {error}") from None
    known = (*MODEL_SUFFIXES, *READERS)
    if path.suffix not in known:
        beside = next((f for suffix in known if (f := Path(f"{model}{suffix}")).is_file()), None)
        if beside is not None:
            raise LoadError(f"unknown model '{model}'; did you mean the file '{beside}'?")
        remedy = suggestion(str(model), bundled())
        raise LoadError(f"unknown model '{model}'; {remedy} (or give a file: {', '.join(known)})")
    if not exists:
        raise LoadError(f"model file '{path}' {'is not a file' if path.exists() else 'does not exist'}")
    return path


def structural_arguments(model: str | Path) -> dict[str, inspect.Parameter]:
    """The keyword arguments of the model function of ``model``, empty for a text; raises LoadError as ``load``."""
    path = find(model)
    return {} if path.suffix == ".toml" else _arguments_of(path, _function_of(path))


# --------------------------------------------------------------------------------------------------- model files


def _function_of(path: Path) -> Callable[..., object]:
    """What makes the mechanism of the file ``path``, which is no text, from structural arguments."""
    if path.suffix not in READERS:
        return _model_function(path)

    def read(base: str = "fixed", stops: bool = False) -> Mechanism:
        return robot(path, base=base, stops=stops)

    return read


def _model_function(path: Path) -> Callable[..., object]:
    """The public function named like the file, or the only one that is defined there and may return a Mechanism."""
    try:
        source, stamp = path.read_bytes(), path.resolve()
    except OSError as error:
        raise LoadError(f"{path}: cannot be read: {error.strerror}") from error
    module = _module(stamp, source)
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
        raise LoadError(
            f"{path}: expected a function '{path.stem}' that returns a Mechanism; public functions there: {found}"
        )
    return next(iter(declared.values()))


@lru_cache(maxsize=64)
def _module(path: Path, source: bytes) -> ModuleType:
    """The module of a model file, run under a name of its own and leaving no bytecode behind."""
    name = f"lag2fmu_model_{path.stem}_{sha256(str(path).encode() + source).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None:
        raise LoadError(f"{path}: Python cannot import it")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look themselves up there while the module runs
    try:
        _guarded(path, lambda: exec(compile(source, str(path), "exec"), vars(module)))  # noqa: S102 (the user's program)
    finally:
        del sys.modules[name]
    return module


def _guarded(path: Path, action: Callable[[], object]) -> object:
    """What ``action`` returns; raises LoadError with the line of ``path`` for whatever exception it ends with."""
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


def _arguments_of(path: Path, function: Callable[..., object]) -> dict[str, inspect.Parameter]:
    parameters = inspect.signature(function).parameters
    for p in parameters.values():
        if p.kind in (p.POSITIONAL_ONLY, p.VAR_POSITIONAL, p.VAR_KEYWORD):
            raise LoadError(
                f"{path}: {function.__name__} takes '{p}'; structural arguments are plain keyword arguments"
            )
    return dict(parameters)


def _convert(value: object, p: inspect.Parameter, where: str) -> object:
    """``value`` in the type of ``p`` (int, float, str or bool, by annotation or default); raises LoadError."""
    kinds = {"int": int, "float": float, "str": str, "bool": bool}
    annotation = p.annotation if isinstance(p.annotation, str) else getattr(p.annotation, "__name__", "")
    kind = kinds.get(annotation, kinds.get(type(p.default).__name__))
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


# -------------------------------------------------------------------------------------------------------- settings


def split_settings(model: str | Path, items: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """``NAME=VALUE`` items as texts: (structural arguments of ``model``, the values of what its mechanism has).

    Raises LoadError for an item of another form and a name given twice.
    """
    pairs, taken = pairs_of(items), structural_arguments(model)
    structural = {name: text for name, text in pairs.items() if name in taken}
    return structural, {name: text for name, text in pairs.items() if name not in taken}


def pairs_of(items: Iterable[str]) -> dict[str, str]:
    """``NAME=VALUE`` items as a mapping; raises LoadError for another form or a name given twice."""
    pairs: dict[str, str] = {}
    for item in items:
        name, equals, text = (part.strip() for part in item.partition("="))
        if not (name and equals and text):
            raise LoadError(f"setting '{item}': expected NAME=VALUE")
        if name in pairs:
            raise LoadError(f"setting '{item}': '{name}' is set twice, first to {pairs[name]}")
        pairs[name] = text
    return pairs


def with_settings(mechanism: Mechanism, texts: Mapping[str, str]) -> Mechanism:
    """``mechanism`` with the values in ``texts``, each in the unit that its name is declared in or one of its own.

    Raises as ``with_values`` does, and LoadError for what is no number.
    """
    return with_values(mechanism, values_of(texts, display_units(mechanism)))


def values_of(texts: Mapping[str, str], units: Mapping[str, Unit]) -> dict[str, float]:
    """The values of ``texts`` in SI, finite; raises LoadError for any other."""
    return {name: _check_finite(name, value_in_si(name, text, units)) for name, text in texts.items()}


def with_values(mechanism: Mechanism, settings: Mapping[str, float]) -> Mechanism:
    """``mechanism`` with other values of parameters and start values, all in SI.

    A coordinate's start is set by its name, that of its velocity by ``NAME_dot``, that of an input or further state by
    its name. Raises LoadError for an unknown name or dependent parameter and MechanismError for a value out of its
    bounds.
    """
    left = {name: _check_finite(name, value) for name, value in settings.items()}
    _check_settable(mechanism, left)
    d = _writing_out(mechanism, left)
    found = {q.name: q for q in mechanism.coordinates}
    coordinates = tuple(_started(q, found[q.name], left) for q in d.coordinates)
    parameters = tuple(replace(p, value=left.get(p.name, p.value)) for p in d.parameters)
    inputs = tuple(replace(u, start=left.get(u.name, u.start)) for u in d.inputs)
    states = tuple(replace(z, start=left.get(z.name, z.start)) for z in d.states)
    changed: Any = {"coordinates": coordinates, "parameters": parameters, "inputs": inputs, "states": states}
    return complete(replace(d, **changed, parts=mechanism.parts_with(left)))


def _writing_out(mechanism: Mechanism, settings: Iterable[str]) -> Description:
    """The description of ``mechanism``; parts of joints and loads that ``settings`` name are written out in it."""
    d, settings = mechanism.description, set(settings)

    def brought(table: str) -> tuple[Any, ...]:
        own = (x for x in getattr(mechanism, table) if mechanism.part_of(f"{table}.{x.name}") is None)
        return tuple(own)[len(getattr(d, table)) :]

    if any({q.name, names.velocity(q.name)} & settings for q in brought("coordinates")):
        d = replace(d, coordinates=(*d.coordinates, *brought("coordinates")))
    if any(u.name in settings for u in brought("inputs")):
        written = {load.name: load for load in mechanism.loads}
        d = replace(d, inputs=(*d.inputs, *brought("inputs")), loads=tuple(written[x.name] for x in d.loads))
    return d


def _started(q: Coordinate, found: Coordinate, settings: Mapping[str, float]) -> Coordinate:
    """``q`` as it is written with the starts in ``settings``; they are guesses where those of ``found`` are."""
    rate = names.velocity(q.name)
    return replace(
        q,
        start=settings.get(q.name, q.start),
        velocity=settings.get(rate, q.velocity),
        given=_given(q.given, found.given) if q.name in settings else q.given,
        velocity_given=_given(q.velocity_given, found.velocity_given) if rate in settings else q.velocity_given,
    )


def _given(written: bool | None, found: bool | None) -> bool:
    """Whether a start that is set is exact: as ``written``; without that, unless ``found`` has it as a guess."""
    return found is not False if written is None else written


def _check_settable(m: Mechanism, wanted: Iterable[str]) -> None:
    """Raise LoadError for the first name in ``wanted`` that is no independent parameter or start value of ``m``."""
    dependent = {p.name: p.expression for p in m.parameters if p.expression is not None}
    known = [p.name for p in m.parameters if p.name not in dependent]
    known += [name for q in m.coordinates for name in (q.name, names.velocity(q.name))] + [u.name for u in m.inputs]
    known += [z.name for z in m.states]
    for name in wanted:
        if name in dependent:
            raise LoadError(
                f"'{name}' cannot be set in '{m.name}': it follows from {dependent[name]}; known are {', '.join(known)}"
            )
        if name not in known:
            near = suggestion(name, known)
            listed = "" if near.startswith("known") else f" known are {', '.join(known)}"
            raise LoadError(
                f"'{name}' is no parameter, coordinate, velocity, input or further state of '{m.name}'; {near}{listed}"
            )


def _check_finite(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise LoadError(f"'{name}' cannot be set to {value!r}; give a finite number")
    return float(value)
