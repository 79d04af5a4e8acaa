"""Loading a mechanism from its name, its file or an object, and setting its values."""

from __future__ import annotations

import inspect
import logging
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import LoadError
from lag2fmu.formats.programs import arguments_of, convert, function_of_mechanics, guarded, is_mechanics, model_function
from lag2fmu.formats.robots import ENDINGS, SOURCES, robot
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, tell_of_lengths, value_in_si
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.resources import MODEL_SUFFIXES, bundled

__all__ = ["as_mechanism", "bundled", "load", "pairs_of", "split_settings", "values_of", "with_settings", "with_values"]

_LOGGER = logging.getLogger("lag2fmu")
_PROGRAM = ".py:"
"""The sign between a file and the name of the thing in it that is meant."""
_TO_VERBS = "parameters and starts go to the verbs, as simulate(..., values={})"


def as_mechanism(model: object, values: Mapping[str, float] | None = None) -> Mechanism:
    """``model`` itself or what ``load`` makes of it, with ``values`` (SI); raises LoadError as ``with_values`` does."""
    mechanism = model if isinstance(model, Mechanism) else load(model)
    changed = with_values(mechanism, values or {})
    tell_of_lengths(mechanism, values or {})
    return changed


def load(model: object, arguments: Mapping[Any, object] | None = None) -> Mechanism:
    """The mechanism that ``model`` is or names.

    What of a robot's file is not taken is told by warnings of the logger "lag2fmu", one for each part; see
    ``read_model`` for ``model`` and ``arguments``. Raises what that raises.
    """
    mechanism = read_model(model, arguments)
    if isinstance(model, (str, Path)) and find(model).suffix in ENDINGS:
        for warning in mechanism.warnings:
            _LOGGER.warning("warning: %s", warning)
    return mechanism


def read_model(model: object, arguments: Mapping[Any, object] | None = None) -> Mechanism:
    """The mechanism that ``model`` is or names, whose warnings are told by nobody.

    ``model`` is a bundled name, a .py, .toml, .urdf or .xml (MJCF) file, FILE.py:NAME for the thing called NAME in a
    program, or a LagrangesMethod, KanesMethod or System of SymPy. ``arguments`` are the structural ones of a family
    (``n`` of ``n_pendulum``), those of ``robot``, or {name: value} of all constants of SymPy's mechanics. Strings are
    converted to the declared type. Raises LoadError if the model is missing, fails or does not take the arguments, and
    MechanismError (TextError) for faults of a text.
    """
    given = {str(name): value for name, value in (arguments or {}).items()}
    if isinstance(model, (str, Path)) and (path := find(model)).suffix == ".toml":
        if given:
            raise LoadError(f"{path}: a mechanism as text has no structural arguments; {_TO_VERBS.format(given)}")
        from lag2fmu.formats.text import read_file

        return read_file(path)
    place, function = source = _function_of(model)
    converted = _converted(source, given)
    mechanism = guarded(place, lambda: function(**converted)) if place.suffix == ".py" else function(**converted)
    if not isinstance(mechanism, Mechanism):
        raise LoadError(f"{place}: {function.__name__} returned {type(mechanism).__name__} instead of a Mechanism")
    return mechanism


def _converted(source: _ModelSource, given: Mapping[str, object]) -> dict[str, object]:
    """The structural arguments ``given``, as the ``source`` takes them.

    Raises LoadError for one that it does not take, that cannot be converted, or that is missing.
    """
    place, function = source
    spelled = getattr(function, "spelled", {})  # the names of SymPy's symbols that are no identifiers
    given = {spelled.get(name, name): value for name, value in given.items()}
    taken = arguments_of(place, function)
    unknown = next((name for name in given if name not in taken), None)
    if unknown is not None and (moving := getattr(function, "moving", {}).get(unknown)):
        start = f"lag2fmu.simulate(..., values={{'{moving}': {given[unknown]}}})"
        raise LoadError(f"{place}: '{unknown}' is no constant, it moves; give its start to the run: {start}")
    if unknown is not None:
        known, owner = ", ".join(taken) or "none", place.name if place.suffix in ENDINGS else function.__name__
        words = f"'{unknown}' is no structural argument of {owner}; known are: {known}"
        raise LoadError(f"{place}: {words}; {_TO_VERBS.format({unknown: given[unknown]})}")
    converted = {name: convert(value, taken[name], f"{place}: {name}") for name, value in given.items()}
    if missing := ", ".join(x for x, p in taken.items() if p.default is p.empty and x not in converted):
        name, of_controller = function.__name__, missing == "t, inputs"
        also = of_controller * f", or of a controller the sample time: {place}:{name}@0.001"
        raise LoadError(f"{place}: {name} needs the structural argument(s) {missing}; give NAME=VALUE{also}")
    return converted


def find(model: str | Path) -> Path:
    """The file of ``model``; raises LoadError, with the names near to it, if there is none."""
    if isinstance(model, str) and model in bundled():
        return bundled()[model]
    path = Path(_split(model)[0])
    try:
        exists = path.is_file()
    except (OSError, ValueError) as error:
        raise LoadError(f"{str(model)[:60]!r} is no model: {error}") from None
    if path.suffix not in (*MODEL_SUFFIXES, *ENDINGS):
        raise LoadError(_what_else(str(model), path))
    if not exists:
        raise LoadError(f"model file '{path}' {'is not a file' if path.exists() else 'does not exist'}")
    return path


def _what_else(model: str, path: Path) -> str:
    """A sentence on a ``model`` whose ending is none of a model's: what it is, and what it may have meant."""
    known = (*MODEL_SUFFIXES, *ENDINGS)
    if path.suffix == ".fmu":
        return f"'{model}' is an FMU; give the model it is exported from ({', '.join(known)})"
    beside = next((f for suffix in known if (f := Path(f"{model}{suffix}")).is_file()), None)
    if beside is not None:
        return f"unknown model '{model}'; did you mean the file '{beside}'?"
    if model and path.exists():
        kind = "a folder" if path.is_dir() else SOURCES.get(path.suffix, "a file with another ending")
        return f"'{model}' is {kind}; a model is a file that ends in one of {', '.join(known)}"
    return f"unknown model '{model}'; {suggestion(model, bundled())} (or give a file: {', '.join(known)})"


def structural_arguments(model: str | Path) -> dict[str, inspect.Parameter]:
    """The keyword arguments of the function that makes ``model``, empty for a text; raises LoadError as ``load``."""
    return {} if find(model).suffix == ".toml" else arguments_of(*_function_of(model))


class _ModelSource(NamedTuple):
    """The place of a model, for messages, and the function that makes its mechanism."""

    place: Path
    function: Callable[..., object]


def _split(model: str | Path) -> tuple[str, str]:
    """FILE.py:NAME as file and name; the name is empty where none is given."""
    file, mark, name = str(model).rpartition(_PROGRAM)
    return (f"{file}.py", name) if mark else (str(model), "")


def _function_of(model: object) -> _ModelSource:
    """The function that makes the mechanism of ``model``, which is no text, from structural arguments."""
    if is_mechanics(model):
        name = type(model).__name__
        return _ModelSource(Path(name), function_of_mechanics(model, "mechanism"))
    if not isinstance(model, (str, Path)):
        got = type(model).__name__
        raise LoadError(f"expected a Mechanism, a model's name or path, or an object of SymPy's mechanics, got {got}")
    path = find(model)
    if path.suffix not in ENDINGS:
        return _ModelSource(path, model_function(path, _split(model)[1]))

    def read(
        base: str = "fixed",
        stops: bool = False,
        pose: Mapping[str, object] | str | None = None,
        ground: str | Sequence[str] | None = None,
        friction: float | None = None,
        restitution: float | None = None,
        law: str | None = None,
        pairs: bool = False,
    ) -> Mechanism:
        of_contacts = {"friction": friction, "restitution": restitution, "law": law, "pairs": pairs}
        return complete(robot(path, base=base, stops=stops, pose=pose, ground=ground, **of_contacts))

    return _ModelSource(path, read)


def split_settings(model: str | Path, items: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """``NAME=VALUE`` items as two mappings of texts: structural arguments of ``model``, and values of its mechanism.

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
    """``mechanism`` with the values in ``texts``, each in the declared unit of its name, or in one of its own.

    Raises LoadError and MechanismError as ``with_values`` does, and LoadError for a text that is no number.
    """
    return with_values(mechanism, values_of(texts, display_units(mechanism))) if texts else mechanism


def values_of(texts: Mapping[str, str], units: Mapping[str, Unit]) -> dict[str, float]:
    """The values of ``texts`` in SI units; raises LoadError for a text that is no finite number."""
    return {name: _check_finite(name, value_in_si(name, text, units)) for name, text in texts.items()}


def with_values(mechanism: Mechanism, settings: Mapping[str, float]) -> Mechanism:
    """``mechanism`` with other values of parameters and start values, all in SI.

    A coordinate's start is set by its name, that of its velocity by ``NAME_dot``, that of an input or further state by
    its name. Raises LoadError for an unknown name or dependent parameter and MechanismError for a value out of its
    bounds.
    """
    if not settings:
        return mechanism
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
    known = [name for name in _with_starts(m) if name not in dependent]
    for name in wanted:
        if name in dependent:
            raise LoadError(
                f"'{name}' cannot be set in '{m.name}': it follows from {dependent[name]}; known are {', '.join(known)}"
            )
        if name not in known:
            if name in map(names.generalized_force, (q.name for q in m.coordinates)):
                raise LoadError(f"'{name}' is an input of the FMU of '{m.name}'; give it as inputs, or to its run")
            near = suggestion(name, known)
            listed = "" if near.startswith("known") else f" known are {', '.join(known)}"
            raise LoadError(
                f"'{name}' is no parameter, coordinate, velocity, input or further state of '{m.name}'; {near}{listed}"
            )


def _with_starts(m: Mechanism) -> Iterator[str]:
    """The names of everything with a value or a start; a filtered motion has one start, that of its target."""
    followed = {x for name in m.filtered for x in (names.velocity(name), names.target(name))}
    yield from (p.name for p in m.parameters)
    for q in m.coordinates:
        yield from (q.name, names.velocity(q.name))
    yield from (name for name in (*(u.name for u in m.inputs), *(z.name for z in m.states)) if name not in followed)


def _check_finite(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise LoadError(f"'{name}' cannot be set to {value!r}; give a finite number")
    return float(value)
