"""Mechanisms in a mechanism: a part is a whole mechanism that stands in another one under a name of its own.

Its entries are written out when the mechanism is built; the text has the part as it was given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import sympy as sp

from lag2fmu.description.keys import key
from lag2fmu.description.places import WORLD, Expression, Frame, Place, normalise
from lag2fmu.errors import MechanismError
from lag2fmu.language.vocabulary import normal_form, symbol


class Setting(NamedTuple):
    """The ``value`` of a parameter or start of a part, in SI units, in place of that of the part's own description."""

    name: str
    value: sp.Expr


@dataclass(frozen=True)
class Part:
    """A mechanism ``of`` its own (a Mechanism or Description), whose names become NAME_... in the whole.

    - ``set``: other values of parameters and starts, {name in the part: value in SI units}, a coordinate's velocity
      under NAME_dot. A parameter may be an expression of the whole's parameters.
    - ``share``: parameters, inputs and tables of the part that are those of the whole with the same names.
    - ``parent``: the frame that is the part's world; in the plane it may be a point or body with an angle.
    - ``file``: the file from which the part was read.

    Raises MechanismError for settings that are no expressions.
    """

    name: str
    of: Any = key(
        "mechanism",
        "Instead of a file: the tables of the mechanism, or the name of a part before that is the same.",
        default=None,
    )
    file: str | Path | None = key(
        "file", "The mechanism, a .toml or .urdf file beside this one or below.", default=None, compare=False
    )
    set: Mapping[str, Expression] | Sequence[Setting] = key(
        "settings",
        "Other values of its parameters and starts: numbers in their units, or expressions of the whole's parameters.",
        default=(),
    )
    share: Sequence[str] = key(
        "names", "Its parameters, inputs and tables that are those of the whole with the same names.", default=()
    )
    parent: str | Frame | Place = key(
        "part", "The frame that is its world; in the plane a point or body. By default the world.", default=WORLD
    )

    def __post_init__(self) -> None:
        where = f"parts.{self.name}"
        normalise(self, where)
        items = self.set.items() if isinstance(self.set, Mapping) else self.set
        values = tuple(Setting(str(name), normal_form(value, f"{where}.set.{name}")) for name, value in items)
        vars(self).update(of=getattr(self.of, "description", self.of), set=values)
        if self.of is None:
            raise MechanismError(f"{where}: there is no mechanism; give 'file', or the mechanism itself as 'of'")

    def __getitem__(self, name: str) -> sp.Symbol:
        """The symbol in the whole of the part's ``name``, for expressions of the whole."""
        return symbol(self.prefix + name)

    @property
    def settings(self) -> tuple[Setting, ...]:
        """The settings in ``set``, in normal form."""
        return tuple(item for item in self.set if isinstance(item, Setting))

    @property
    def prefix(self) -> str:
        """The prefix of its names in the whole."""
        return f"{self.name}_"

    @property
    def place(self) -> str:
        """Where it is written, and its file, for messages."""
        return f"parts.{self.name}" + (f" ({Path(self.file).name})" if self.file is not None else "")

    def setting(self, values: Mapping[str, float]) -> Part:
        """The same part with other ``values`` in SI units, by their names in the whole."""
        new = {name.removeprefix(self.prefix): value for name, value in values.items()}
        return replace(self, set={**dict(self.settings), **new}) if new else self
