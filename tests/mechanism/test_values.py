"""Values of a wrong kind, which only Python can give: every one ends in an error of lag2fmu that names its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from lag2fmu.errors import MechanismError
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Friction,
    Joint,
    Mechanism,
    State,
    Stop,
    Table,
    coordinate,
    parameter,
    signal,
)

WRONG = [None, [1, 2], {"a": 1}, {1}, object(), len, b"x", 1j, "two words", sp.Matrix([1, 2]), np.array([1.0, 2.0])]
x, y = coordinate("x", "m"), coordinate("y", "m", start=1.0)
POINTS: dict[str, Any] = {"columns": [[0, 1], [0, 1]]}

MADE: dict[str, tuple[Callable[[Any], Any], str]] = {
    "coordinate name": (lambda v: system(coordinates=[coordinate(v)]), r"coordinates.* is no name"),
    "coordinate start": (lambda v: coordinate("q", start=(v,)), r"coordinates\.q\.start: expected a number"),
    "parameter value": (lambda v: parameter("p", v), r"parameters\.p(\.value)?: expected"),
    "parameter unit": (lambda v: parameter("p", 1, 1 if v is None else v), r"parameters\.p\.unit: "),
    "signal start": (lambda v: signal("u", start=v), r"inputs\.u\.start: expected a number"),
    "signal motion": (lambda v: signal("u", motion=v), r"inputs\.u\.motion: .* is no kind of motion"),
    "table units": (lambda v: Table("f", **POINTS, units=v), r"tables\.f\.units: "),
    "table outside": (lambda v: Table("f", **POINTS, outside=v), r"tables\.f\.outside: "),
    "joint kind": (lambda v: Joint("j", v, between=("b", "world")), r"joints\.j\.kind: "),
    "contact name": (lambda v: system(contacts=[Contact(v, gap=y)]), r"contacts.*is no name"),
    "contact kind": (lambda v: system(contacts=[Contact("c", kind=v)]), r"contacts\.c"),
    "contact law": (lambda v: system(contacts=[Contact("c", gap=y, law=v)]), r"contacts\.c\.law: "),
    "stop name": (lambda v: system(stops=[Stop(v, of=x, lower=-1)]), r"stops.*is no name"),
    "friction name": (lambda v: system(frictions=[Friction(v, on=x.dot, force=1)]), r"frictions.*is no name"),
    "state start": (lambda v: system(states=[State("z", start=v, derivative=x)]), r"states\.z\.start: "),
    "latch name": (lambda v: system(constraints=[Constraint(v, x, while_=y)]), r"constraints.*is no name"),
    "latch kind": (lambda v: Constraint("catch", x, v, while_=y), r"constraints\.catch: .* is no kind"),
}


def system(**tables: Any) -> Mechanism:
    return Mechanism("s", **{"coordinates": [x, y], "bodies": [Body("b", 1, (x, y))]} | tables)


@pytest.mark.parametrize("value", WRONG, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("made", MADE)
def test_a_value_of_a_wrong_kind_names_its_place(made: str, value: object) -> None:
    make, message = MADE[made]
    with pytest.raises(MechanismError, match=f"(?s){message}"):
        make(value)


@pytest.mark.parametrize("table", ["energy", "ports", "experiment", "contacts", "stops", "frictions", "tables"])
def test_a_table_of_another_kind_is_refused(table: str) -> None:
    with pytest.raises(MechanismError, match=f"{table}: expected"):
        system(**{table: [1, 2]})


def test_a_text_as_units_of_a_table_is_no_list_of_them() -> None:
    with pytest.raises(MechanismError, match=r"units: expected an array of units, got 'rad/s'"):
        Table("f", **POINTS, units="rad/s")
