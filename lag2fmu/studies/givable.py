"""The values that a run of a mechanism can be given: starts, parameters and inputs, with their bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lag2fmu.description import names as words
from lag2fmu.description.symbols import Coordinate, Input, Parameter
from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism


def kinds_of(mechanism: Mechanism) -> dict[str, str]:
    """{name: "starts", "parameters" or "inputs"} of the values that a run of ``mechanism`` can be given."""
    kinds = {p.name: "parameters" for p in mechanism.parameters if p.value is not None}
    for q in mechanism.coordinates:
        kinds |= {q.name: "starts", words.velocity(q.name): "starts", words.generalized_force(q.name): "inputs"}
    kinds |= {z.name: "starts" for z in mechanism.states} | {u.name: "inputs" for u in mechanism.plain_inputs}
    for u in mechanism.motions:
        kinds |= dict.fromkeys((u.name, words.velocity(u.name), words.acceleration(u.name)), "inputs")
    return kinds


def check_names(mechanism: Mechanism, wanted: Sequence[str]) -> None:
    """Raise LoadError for names in ``wanted`` that runs of ``mechanism`` cannot be given."""
    kinds = kinds_of(mechanism)
    for name in wanted:
        if name not in kinds:
            what = "parameter, start or input"
            raise LoadError(f"'{name}' is no {what} of '{mechanism.name}'; {suggestion(name, kinds)}")


def bounds_of(mechanism: Mechanism, wanted: Sequence[str]) -> dict[str, tuple[float, float]]:
    """{name: (least, greatest) value} in SI of those of ``wanted`` that have a bound."""
    parts: list[Parameter | Coordinate | Input] = [*mechanism.parameters, *mechanism.coordinates, *mechanism.inputs]
    return {
        part.name: (-np.inf if part.minimum is None else part.minimum, np.inf if part.maximum is None else part.maximum)
        for part in parts
        if part.name in wanted and (part.minimum, part.maximum) != (None, None)
    }
