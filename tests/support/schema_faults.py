"""What the schema for editors says is wrong with a text."""

from __future__ import annotations

from jsonschema import Draft7Validator

from lag2fmu.formats.schema import schema
from lag2fmu.formats.syntax import tomllib

VALIDATOR = Draft7Validator(schema())


def faults(text: str) -> list[str]:
    """What the schema says is wrong with ``text``, each with its place."""
    found = VALIDATOR.iter_errors(tomllib.loads(text))
    return [f"{'.'.join(map(str, error.absolute_path))}: {error.message}" for error in found]
