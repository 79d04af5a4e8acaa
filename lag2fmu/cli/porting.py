"""The options ``--inputs`` and ``--port`` of ``export``: the table [ports] of a mechanism with other choices."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from lag2fmu.description.keys import keys_of
from lag2fmu.description.places import WORLD
from lag2fmu.description.ports import ACTING, ALL, NONE, Ports
from lag2fmu.errors import ExportError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism, complete


def with_choices(mechanism: Mechanism, inputs: str | None, items: Sequence[str]) -> Mechanism:
    """``mechanism`` with ``inputs`` ('F,Q_x', 'all', 'none') and ``items`` KEY=NAME,...,KEY=NAME,... in its ports.

    A key that is given replaces that of the mechanism. A force or torque NAME:frame is along the axes of the frame.
    Raises ExportError for an item of another form, MechanismError for unknown names.
    """
    given = [] if inputs is None else [f"inputs={inputs}"]
    given += [part for item in items for part in re.split(r",(?=[^,]*=)", item)]
    if not given:
        return mechanism
    choices: dict[str, Any] = {}
    keys = keys_of(Ports)
    for item in given:
        key, equals, text = (part.strip() for part in item.partition("="))
        words = [word.strip() for word in text.split(",")]
        if not equals or not all(words):
            raise ExportError(f"--port {item}: expected KEY=NAME,...; e.g. --port forces=tip,hand")
        if key not in keys:
            raise ExportError(f"--port {item}: there is no key '{key}'; {suggestion(key, keys)}")
        choices[key] = _value(key, words)
    return complete(replace(mechanism.description, ports=replace(mechanism.description.ports, **choices)))


def _value(key: str, words: list[str]) -> object:
    if key == "rotation" or (key == "inputs" and words in ([ALL], [NONE])):
        return ",".join(words)
    if key not in ACTING:
        return words
    pairs = (word.partition(":") for word in words)
    return {place: axes or WORLD for place, _, axes in pairs}
