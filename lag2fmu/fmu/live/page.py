"""The live page of an FMU: its C sources as a module of WebAssembly, its variables, its picture, in one file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lag2fmu.description import names
from lag2fmu.fmu.elements import ENUMERATIONS
from lag2fmu.fmu.live.document import document
from lag2fmu.fmu.live.parts import Live
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.mechanism.record import Mechanism

if TYPE_CHECKING:
    from lag2fmu.fmu.live.samples import Samples

_SHORT, _LONG, _SHOWN = 3.0, 30.0, 10.0
"""Experiments between these lengths (s) are shown in real time; others are sped up or slowed down to the last one."""
_LINES = 4
"""The most coordinates that are plotted at first."""


def live_document(
    context: Mapping[str, object], description: ModelDescription, made: Live, samples: Samples | None
) -> str:
    """The page as HTML; ``context`` is that of the static page; it compares its trajectory with ``samples``."""
    notes = context["sketch"][1] if context["sketch"] else ()  # type: ignore[index]
    if made.surfaces:
        notes = (*notes, f"The surfaces of bodies take {len(made.surfaces) / 1000:.0f} kB before they are packed.")
    data = _data(description, made.picture, samples)
    return document({**context, "notes": notes}, data, made)


def _data(description: ModelDescription, picture: Mapping[str, Any] | None, samples: Samples | None) -> dict[str, Any]:
    mechanism = description.mechanism
    experiment, coordinates = mechanism.experiment, [c.name for c in mechanism.coordinates]
    stop, units = experiment.stop_time, display_units(mechanism)
    moving, shown = coordinates or [*mechanism.driven], [v for v in description.variables if _is_shown(v)]
    return {
        "name": mechanism.name,
        "experiment": {"stop": stop, "step": experiment.step, "tolerance": experiment.tolerance},
        "speed": 1 if _SHORT <= stop <= _LONG else float(f"{stop / _SHOWN:.1g}"),
        "variables": [_variable(v, mechanism, units) for v in shown],
        "coordinates": coordinates,
        "drawing": picture,
        "plot": [q for q in moving if units.get(q) == units.get(moving[0])][:_LINES],
        "phase": [moving[0], names.velocity(moving[0])] if moving else [shown[0].name] * 2,
        "reference": None if samples is None else samples.data(),
    }


def _is_shown(variable: ScalarVariable) -> bool:
    number = variable.type in {"Real", "Integer", *ENUMERATIONS} and variable.causality != "independent"
    return number and variable.derivative_of is None and variable.name not in names.SETTINGS


def _variable(variable: ScalarVariable, mechanism: Mechanism, units: Mapping[str, Unit]) -> dict[str, Any]:
    """A variable as data for the script: values in SI units, and the one of ``units`` in which it is shown."""
    kind = _kind(variable, mechanism)
    items = ENUMERATIONS[variable.type].items if variable.type in ENUMERATIONS else {}
    return {
        "name": variable.name,
        "index": variable.value_reference,
        "kind": kind,
        "doc": variable.doc,
        **_unit(units.get(variable.name, variable.unit)),
        "start": variable.start or 0.0,
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": {c.name: c.nominal for c in mechanism.coordinates}.get(variable.name, variable.nominal),
        "fixed": variable.variability == "fixed" or kind in {"coordinate", "velocity"},
        "discrete": variable.type != "Real" or variable.variability == "discrete",
        "watched": variable.type != "Real",
        "items": {value: name for name, (value, _) in items.items()} or None,
        "short": variable.name.removeprefix("mode_").removesuffix("_mode"),
    }


def _unit(unit: Unit | None) -> dict[str, Any]:
    """The name of a unit; a value in it is (SI value - offset)/factor."""
    if unit is None:
        return {"unit": "", "factor": 1.0, "offset": 0.0}
    return {"unit": unit.name, "factor": unit.factor, "offset": unit.offset}


def _kind(variable: ScalarVariable, mechanism: Mechanism) -> str:
    coordinates = [c.name for c in mechanism.coordinates]
    states = {z.name for z in mechanism.states if z.name not in mechanism.filtered}
    if variable.name in coordinates or variable.name in mechanism.filtered:
        return "coordinate"
    if variable.name in map(names.velocity, coordinates) or variable.name in states:
        return "velocity"
    return variable.causality if variable.causality in {"parameter", "input"} else "other"
