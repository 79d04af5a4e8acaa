"""A start file: the text of a mechanism that runs as it is, with every table of the format explained."""

from __future__ import annotations

import json
from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import SCHEMA_NAME, check_identifier
from lag2fmu.resources import resource_folder


def write_start(name: str, folder: Path) -> tuple[Path, Path]:
    """Write ``folder/NAME.toml`` and, for editors, the schema its first line names; return the two paths.

    A schema of another version of lag2fmu is replaced. Raises MechanismError if ``name`` is no identifier, LoadError if
    there is such a file, another file in the place of the schema, or one cannot be written.
    """
    check_identifier(name, "NAME")
    templates = resource_folder("templates")
    text = (templates / "start.toml").read_text("utf-8")
    text = text.replace('name = "start"', f'name = "{name}"', 1).replace("start.toml", f"{name}.toml")
    schema_text = (templates / SCHEMA_NAME).read_text("utf-8")
    path, schema = folder / f"{name}.toml", folder / SCHEMA_NAME
    try:
        if path.exists():
            raise LoadError(f"'{path}' exists and is not overwritten; give another name, or move or delete it")
        if not schema.exists():
            schema.write_text(schema_text, "utf-8", newline="\n")
        elif (found := schema.read_bytes()) != schema_text.encode():
            if _title(found) != _title(schema_text.encode()):
                raise LoadError(f"'{schema}' exists and is no schema of lag2fmu; move or delete it")
            schema.write_text(schema_text, "utf-8", newline="\n")  # that of another version
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except OSError as error:
        raise LoadError(f"'{path}' cannot be written: {error.strerror}") from error
    return path, schema


def _title(schema: bytes) -> object:
    """The title of a JSON ``schema``; None for anything else."""
    try:
        found = json.loads(schema)
    except ValueError:
        return None
    return found.get("title") if isinstance(found, dict) else None
