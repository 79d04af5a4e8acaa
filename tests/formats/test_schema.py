"""The JSON schema of the text format: it refuses no mechanism, and no key or type that the reader refuses passes it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from everything import everything
from jsonschema import Draft7Validator
from schema_faults import faults
from spatial_mechanisms import everything_spatial

from lag2fmu.errors import TextError
from lag2fmu.formats.keys import CONSTRAINT, EXPRESSIONS, NAMED, SINGLE
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.schema import FILE_NAME, schema, schema_text
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.resources import resource_folder

BROKEN = Path(__file__).parent / "broken"

WRONG_FORM = sorted(
    [
        *BROKEN.glob("type_*.toml"),
        *BROKEN.glob("*misspelt*.toml"),
        *(BROKEN / f"{name}.toml" for name in ("missing_mechanism", "missing_name", "empty")),
        *(BROKEN / f"{name}.toml" for name in ("name_with_space", "constraint_of_unknown_kind", "empty_position")),
        *(BROKEN / f"{name}.toml" for name in ("frames_axis_is_none", "output_quantity_unknown", "load_axes_unknown")),
    ]
)
"""What is wrong in these files are keys and types, not names, numbers or equations."""


def test_the_shipped_file_is_what_is_generated(request: pytest.FixtureRequest) -> None:
    """``pytest tests/formats --update`` writes it anew."""
    path = resource_folder("templates") / FILE_NAME
    if request.config.getoption("--update"):
        path.write_text(schema_text(), "utf-8", newline="\n")
    shipped = path.read_text("utf-8")
    difference = difflib.unified_diff(shipped.splitlines(), schema_text().splitlines(), "shipped", "generated", "", "")
    if shipped != schema_text():
        pytest.fail("\n".join(difference) + "\nif this is meant, run pytest tests/formats --update")


def test_it_is_a_schema() -> None:
    Draft7Validator.check_schema(schema())


@pytest.mark.parametrize("name", bundled())
def test_every_bundled_model_passes(name: str) -> None:
    assert faults(write(load(name))) == []


def test_what_uses_every_concept_passes() -> None:
    assert faults(write(everything())) == []
    assert faults(write(everything_spatial())) == []


@pytest.mark.parametrize("path", WRONG_FORM, ids=lambda path: path.stem)
def test_wrong_keys_and_types_are_refused_at_their_place(path: Path) -> None:
    text = path.read_text("utf-8")
    found = faults(text)
    assert found
    with pytest.raises(TextError) as caught:
        read(text, "file")
    table = re.match(r"file: (?:the file: ')?(\w+)", str(caught.value))
    assert table is not None
    assert any(table[1] in fault for fault in found), (found, str(caught.value))


# ------------------------------------------------------------------------------------- reader and schema, key by key

VALUES = [
    '"y"',
    "1",
    "2.5",
    "true",
    "[]",
    "{}",
    '{ mechanism = { name = "y" } }',
    "2024-01-01",
    '["y", "y"]',
    "[1, 2]",
    '[["z", 1]]',
    "[[1, 1]]",
    "[true]",
]
WRONG_TYPE = re.compile(r"expected (a|an|true|pairs|'x'),? |the array is empty|'mechanism' is missing")


def sub_tables() -> Iterator[tuple[str, dict[str, Any]]]:
    """Every kind of table with its keys."""
    yield from SINGLE.items()
    yield from ((f"{name}.some", keys) for name, keys in NAMED.items())
    yield "constraints.holonomic.some", CONSTRAINT


CASES = [(table, key) for table, keys in sub_tables() for key in keys]


def text_with(table: str, entries: dict[str, str]) -> str:
    head = "" if table == "mechanism" else '[mechanism]\nname = "some"\n'
    return f"{head}[{table}]\n" + "".join(f"{key} = {value}\n" for key, value in entries.items())


def needed(table: str) -> dict[str, str]:
    """The keys that ``table`` cannot do without, each with a value that fits."""
    keys = dict(sub_tables())[table]
    fitting = {"vector": "[1, 2]"}
    return {
        key: fitting.get(entry.kind, '"y"') if isinstance(entry.kind, str) else f'"{entry.kind[0]}"'
        for key, entry in keys.items()
        if entry.required
    }


def verdict(text: str) -> str:
    """What the reader says about ``text``."""
    try:
        read(text, "file")
    except TextError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("table", "key"), CASES, ids=lambda x: x)
def test_reader_and_schema_agree_on_types(table: str, key: str) -> None:
    """A value of another type is refused by both, at this key; and some type is accepted, some not.

    That a string is none of a few words is found later by the reader: see ``output_quantity_unknown.toml``.
    """
    choice = isinstance(dict(sub_tables())[table][key].kind, tuple)
    refused = []
    for value in [value for value in VALUES if not (choice and value == '"y"')]:
        text = text_with(table, {**needed(table), key: value})
        found, message = bool(faults(text)), verdict(text)
        assert found == bool(WRONG_TYPE.search(message)), (text, message)
        assert not found or f"{table}.{key}" in message, (text, message)
        refused.append(found)
    assert any(refused)
    assert choice or not all(refused)


@pytest.mark.parametrize(
    ("table", "key"), [c for c in CASES if dict(sub_tables())[c[0]][c[1]].required], ids=lambda x: x
)
def test_reader_and_schema_agree_on_what_is_needed(table: str, key: str) -> None:
    entries = needed(table)
    del entries[key]
    text = text_with(table, entries)
    assert f"'{key}' is missing" in verdict(text)
    assert any("is a required property" in fault or "not valid under any" in fault for fault in faults(text))


@pytest.mark.parametrize("table", EXPRESSIONS)
def test_reader_and_schema_agree_on_expressions(table: str) -> None:
    for value in VALUES:
        text = text_with(table, {"some": value})
        assert bool(WRONG_TYPE.search(verdict(text))) == bool(faults(text)), text


@pytest.mark.parametrize("table", [name for name, _ in sub_tables()])
def test_a_key_of_another_table_is_refused_by_both(table: str) -> None:
    text = text_with(table, {**needed(table), "colour": '"red"'})
    assert "colour: unknown key" in verdict(text)
    assert any("colour" in fault for fault in faults(text))
