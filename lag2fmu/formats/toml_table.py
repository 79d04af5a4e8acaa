"""The tables of a TOML text: each entry taken in the type it should have, every fault named with its place."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.keys import Key
from lag2fmu.description.symbols import FILTERED
from lag2fmu.errors import TextError, UnitError
from lag2fmu.formats.quantities import describe, fraction, quantity
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.parser import parse
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import Unit


class Surroundings(NamedTuple):
    """The surroundings of a text: the ``folder`` of files that it names, and the ``tables`` that expressions may call.

    ``files`` are those of mechanisms that are being read, the first one being that of the whole. ``known`` {file:
    Description} are those that have been read already.
    """

    folder: Path = Path()
    tables: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    known: dict[Path, Description] = {}  # noqa: RUF012 (every text that is read has its own)


class TomlTable:
    """One table of the text with its place; hands out each entry in the type it should have, or raises TextError."""

    def __init__(
        self,
        where: str,
        content: object,
        keys: Iterable[str] | None = None,
        around: Surroundings = Surroundings(),  # noqa: B008 (frozen)
    ) -> None:
        """``keys`` are the ones that may stand here (None: any)."""
        if not isinstance(content, dict):
            listed = "" if keys is None else f"; its keys are {', '.join(keys)}"
            listed = f"; write [{where}.NAME] for each" if isinstance(content, list) and keys is None else listed
            if keys is not None and isinstance(content, Decimal | int) and "value" in keys:
                listed = f"; write {{ value = {str(content).lower()} }}{listed}"
            raise TextError(f"{where}: expected a table {{ ... }}, got {describe(content)}{listed}")
        self.where, self.content, self.around = where, content, around
        known = content if keys is None else tuple(keys)
        for key in content:
            if key not in known:
                hint = _turned(self.where, key, content[key], known) or _speaking_of(key, keys)
                raise TextError(f"{self.place(key)}: unknown key; {suggestion(key, known)}{hint}")

    def place(self, key: str) -> str:
        """``TABLE.KEY``, as messages begin with it."""
        short = key if len(key) <= 60 else f"{key[:57]}..."
        return f"{self.where}.{short}" if self.where else short

    def table(self, key: str, keys: Iterable[str] | None = None) -> TomlTable:
        """The table ``key``, empty if it is not there."""
        return TomlTable(self.place(key), self.content.get(key, {}), keys, self.around)

    def text(self, key: str, default: str | None = "") -> str | None:
        """The string ``key``, ``default`` if it is not there; raises TextError for another type."""
        value = self.content.get(key, default)
        if key in self.content and not isinstance(value, str):
            raise TextError(f"{self.place(key)}: expected a string, got {describe(value)}")
        return value

    def flag(self, key: str) -> bool:
        """The boolean ``key``, false if it is not there; raises TextError for another type."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise TextError(f"{self.place(key)}: expected true or false, got {describe(value)}")
        return value

    def motion(self, key: str) -> bool | str:
        """The boolean or the word ``key``, false if it is not there; raises TextError for anything else."""
        value = self.content.get(key, False)
        if value is True or value is False:
            return value
        if value != FILTERED:
            raise TextError(f"{self.place(key)}: expected true, false or '{FILTERED}', got {describe(value)}")
        return FILTERED

    def number(self, key: str, convert: Callable[[Fraction], float] = float) -> float | None:
        """The number ``key`` passed through ``convert`` (to SI); None if it is not there.

        Raises TextError for a value that is no number.
        """
        return convert(fraction(self.content[key], self.place(key))) if key in self.content else None

    def quantity(self, key: str, unit: Unit, difference: bool = False, per: Unit | None = None) -> float | None:
        """The number ``key`` in SI, None if it is not there, see ``quantities.quantity``; raises TextError as that."""
        if key not in self.content:
            return None
        return quantity(self.content[key], self.place(key), unit, difference=difference, per=per)

    def unit(self, key: str = "unit") -> Unit | None:
        """The unit ``key``, None if there is none; raises TextError for a text that is no unit."""
        text = self.text(key, None)
        try:
            return None if text is None else parse_unit(text)
        except UnitError as error:
            raise TextError(f"{self.place(key)}: {error}") from error

    def require(self, key: str, remedy: str = "") -> None:
        """Raise TextError unless ``key`` is there; a ``remedy`` ends its message."""
        if key not in self.content:
            raise TextError(f"{self.where or 'the file'}: '{key}' is missing{remedy}")

    def expression(self, key: str, required: bool = False) -> sp.Expr | None:
        """The expression ``key``, a string or a number; None if it is not there and not required.

        Raises TextError for anything else.
        """
        if required:
            self.require(key)
        return self._expression(self.content[key], self.place(key)) if key in self.content else None

    def vector(self, key: str) -> tuple[sp.Expr, ...] | None:
        """The expressions of the array ``key``, None if it is not there; raises TextError if it is empty."""
        value = self._array(key, "expressions")
        return value and tuple(self._expression(item, f"{self.place(key)}[{i}]") for i, item in enumerate(value))

    def scalar_or_vector(self, key: str) -> sp.Expr | tuple[sp.Expr, ...] | None:
        """The expression ``key``, or the expressions of the array ``key``; None if it is not there.

        Raises TextError for anything else.
        """
        return self.vector(key) if isinstance(self.content.get(key), list) else self.expression(key)

    def names(self, key: str) -> tuple[str, ...] | None:
        """The strings of the array ``key``, None if it is not there; raises TextError for other entries."""
        value = self._array(key, "names")
        for i, item in enumerate(value or ()):
            if not isinstance(item, str):
                raise TextError(f"{self.place(key)}[{i}]: expected a name, got {describe(item)}")
        return value

    def choice(self, key: str) -> tuple[str, ...] | str | None:
        """The strings of the array ``key``, which may be empty, or one string; None if it is not there.

        Raises TextError for anything else.
        """
        value = self.content.get(key)
        return () if value == [] else self.names(key) if isinstance(value, list) else self.text(key, None)

    def acting(self, key: str) -> tuple[str, ...] | dict[str, str]:
        """The strings of the array ``key``, or of the table {place: axes}; empty if it is not there.

        Raises TextError for anything else.
        """
        if not isinstance(self.content.get(key), dict):
            return self.names(key) or ()
        table = self.table(key)
        return {place: str(table.text(place)) for place in table.content}

    def rotations(self, key: str) -> tuple[tuple[str | tuple[sp.Expr, ...], sp.Expr], ...]:
        """The pairs [axis, angle] of the array ``key``, an axis being a string or an array; may be empty or absent.

        Raises TextError for anything else.
        """
        turns = []
        pairs = () if self.content.get(key) == [] else self._array(key, "pairs of axis and angle")
        for i, item in enumerate(pairs or ()):
            place = f"{self.place(key)}[{i}]"
            if not isinstance(item, list) or len(item) != 2:
                raise TextError(f'{place}: expected a pair of axis and angle, e.g. ["z", "q"], got {describe(item)}')
            axis, angle = item
            turns.append((self._axis(axis, f"{place}.axis"), self._expression(angle, f"{place}.angle")))
        return tuple(turns)

    def axis(self, key: str) -> str | tuple[sp.Expr, ...] | None:
        """The axis ``key``, a string or an array of expressions; None if it is not there.

        Raises TextError for anything else.
        """
        return self._axis(self.content[key], self.place(key)) if key in self.content else None

    def file(self, key: str) -> Path | None:
        """The file ``key``, below the folder of the text; None if it is not there.

        Raises TextError for a path that leads elsewhere, and where the data are given otherwise too.
        """
        text = self.text(key, None)
        if text is None:
            return None
        for other in ("columns", "of"):
            if other in self.content:
                raise TextError(f"{self.where}: '{other}' and '{key}' exclude each other; leave one out")
        path = PurePath(text)
        if path.is_absolute() or ".." in path.parts or not path.parts:
            raise TextError(f"{self.place(key)}: '{text}' is no file beside the text or below; put it there")
        return self.around.folder / path

    def columns(self, key: str) -> tuple[Any, ...] | None:
        """The arrays of numbers in the array ``key``, which may hold arrays again; None if it is not there.

        Raises TextError for anything else.
        """
        value = self._array(key, "columns")
        return value and tuple(_numbers(item, f"{self.place(key)}[{i}]") for i, item in enumerate(value))

    def units(self, key: str) -> tuple[Unit, ...]:
        """The units in the array ``key``; raises TextError for a text that is no unit."""
        try:
            return tuple(parse_unit(text) for text in self.names(key) or ())
        except UnitError as error:
            raise TextError(f"{self.place(key)}: {error}") from error

    def _axis(self, value: object, where: str) -> str | tuple[sp.Expr, ...]:
        if value == []:
            raise TextError(f"{where}: the array is empty")
        if isinstance(value, list):
            return tuple(self._expression(x, f"{where}[{j}]") for j, x in enumerate(value))
        if not isinstance(value, str):
            raise TextError(f"{where}: expected 'x', 'y', 'z' or an array of 3, got {describe(value)}")
        return value

    def _expression(self, value: object, where: str) -> sp.Expr:
        """A string parsed or a number taken; raises TextError or ExpressionError with ``where``."""
        if isinstance(value, str):
            return parse(value, where=where, tables=self.around.tables)
        if isinstance(value, bool) or not isinstance(value, (int, Decimal)):
            raise TextError(f"{where}: expected an expression (a string or a number), got {describe(value)}")
        fraction(value, where)
        return parse(str(value), where=where)

    def _array(self, key: str, entries: str) -> tuple[Any, ...] | None:
        value = self.content.get(key)
        if key in self.content and not isinstance(value, list):
            raise TextError(f"{self.place(key)}: expected an array of {entries}, got {describe(value)}")
        if value == []:
            raise TextError(f"{self.place(key)}: the array is empty")
        return None if value is None else tuple(value)


def _numbers(value: object, where: str) -> Any:
    """Numbers of an array, as floats, which may be arrays of numbers again."""
    if not isinstance(value, list):
        raise TextError(f"{where}: expected an array of numbers, got {describe(value)}")
    return tuple(
        _numbers(item, f"{where}[{i}]") if isinstance(item, list) else float(fraction(item, f"{where}[{i}]"))
        for i, item in enumerate(value)
    )


def _turned(where: str, key: str, content: object, known: Collection[str]) -> str:
    """A phrase where the table ``key`` has one of the keys in it that are ``known`` outside, as a kind; or ""."""
    inside = next((name for name in known if name in content), "") if isinstance(content, dict) else ""
    return f"; write '{key} = ...' under [{where}.{inside}]" if inside and where else ""


def _speaking_of(word: str, keys: object) -> str:
    """A phrase with the first of ``keys`` whose sentence has the ``word``, as 'body' is in that of 'point'; or ""."""
    known = keys.values() if isinstance(keys, Mapping) else ()
    said = (key for key in known if isinstance(key, Key) and word.lower() in re.findall(r"\w+", key.doc.lower()))
    return next((f"; '{key.name}' is: {key.doc}" for key in said), "")
