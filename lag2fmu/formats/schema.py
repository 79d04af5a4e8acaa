"""The JSON schema (draft 7) of the text format, with which editors complete, explain and check a mechanism.

It knows keys and types, for both come from the parts' fields; names, units and equations are checked by ``text.read``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from lag2fmu.description import parts, places
from lag2fmu.description.keys import Key
from lag2fmu.description.ports import ALL, NONE
from lag2fmu.description.symbols import FILTERED
from lag2fmu.formats.keys import CONSTRAINT, EXPRESSIONS, NAMED, SINGLE, TABLES
from lag2fmu.formats.quantities import QUANTITY
from lag2fmu.language.identifiers import IDENTIFIER, MAX_NAME, SCHEMA_NAME

Schema = dict[str, Any]

FILE_NAME = SCHEMA_NAME

_EXPRESSION: Schema = {"type": ["string", "number"]}
_VECTOR: Schema = {"type": "array", "items": _EXPRESSION, "minItems": 1}
_AXIS: Schema = {"anyOf": [{"enum": list(places.AXES)}, _VECTOR]}
_PAIR: Schema = {"type": "array", "items": [_AXIS, _EXPRESSION], "minItems": 2, "maxItems": 2}
_NAMES: Schema = {"type": "array", "items": {"type": "string"}, "minItems": 1}
_QUANTITY: Schema = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": QUANTITY.pattern}]}
_ROW: Schema = {"type": "array", "items": {"type": "number"}}
_COLUMN: Schema = {"type": "array", "items": {"anyOf": [{"type": "number"}, _ROW]}}

VALUES: dict[str, Schema] = {
    "string": {"type": "string"},
    "part": {"type": "string"},
    "texts": {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
    "unit": {"type": "string"},
    "number": _QUANTITY,
    "difference": _QUANTITY,
    "flag": {"type": "boolean"},
    "motion": {"anyOf": [{"type": "boolean"}, {"enum": [FILTERED]}]},
    "expression": _EXPRESSION,
    "vector": _VECTOR,
    "expression or vector": {"anyOf": [_EXPRESSION, _VECTOR]},
    "axis": _AXIS,
    "names": _NAMES,
    "choice": {"anyOf": [{"enum": [ALL, NONE]}, {"type": "array", "items": {"type": "string"}}]},
    "acting": {"anyOf": [_NAMES, {"type": "object", "additionalProperties": {"enum": [places.WORLD, "frame"]}}]},
    "places": _NAMES,
    "motions": _NAMES,
    "rotations": {"type": "array", "items": _PAIR},
    "file": {"type": "string"},
    "settings": {"type": "object", "additionalProperties": _EXPRESSION},
    "mechanism": {"anyOf": [{"$ref": "#"}, {"type": "string"}]},
    "columns": {"type": "array", "items": _COLUMN, "minItems": 1},
    "units": _NAMES,
}
"""{kind of a ``Key``: the schema of its values}."""


def schema() -> Schema:
    """The schema as data for ``json``."""
    constraint = {"anyOf": [_EXPRESSION, _table(CONSTRAINT)]}
    tables = {
        **{name: _table(keys) for name, keys in SINGLE.items()},
        **{name: _each(_table(keys)) for name, keys in NAMED.items()},
        **{name: _each(_EXPRESSION) for name in EXPRESSIONS},
        "constraints": _object(dict.fromkeys(parts.KINDS, _each(constraint))),
    }
    described = {name: {"description": doc, **tables[name]} for name, doc in TABLES.items()}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "lag2fmu: a mechanism as text",
        **_object(described, required=["mechanism"]),
    }


def schema_text() -> str:
    """The schema as the text of its file."""
    return json.dumps(schema(), indent=1) + "\n"


def _table(keys: Mapping[str, Key]) -> Schema:
    properties = {name: {"description": key.doc, **_kind(key)} for name, key in keys.items()}
    return _object(properties, required=[name for name, key in keys.items() if key.required])


def _kind(key: Key) -> Schema:
    return VALUES[key.kind] if isinstance(key.kind, str) else {"enum": list(key.kind)}


def _each(entry: Schema) -> Schema:
    """A table with any names, an ``entry`` for each."""
    names = {"pattern": f"^{IDENTIFIER.pattern}$", "maxLength": MAX_NAME}
    return {"type": "object", "propertyNames": names, "additionalProperties": entry}


def _object(properties: Schema, required: list[str] | None = None) -> Schema:
    """A table with these keys and no others."""
    needed = {"required": required} if required else {}
    return {"type": "object", "properties": properties, **needed, "additionalProperties": False}
