"""Python functions as components of a system: their programs, and connectors from connections and arguments."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from lag2fmu.errors import LoadError
from lag2fmu.formats.programs import program
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism.display import value_in_si
from lag2fmu.systems.components import Component, Connector, component_with
from lag2fmu.systems.connections import GIVES
from lag2fmu.systems.controller import Controller


def controller_of(source: Controller | str) -> Controller:
    """The controller in a text such as 'control.py:balance@0.001' or '...@1 ms'; raises LoadError for another one."""
    if isinstance(source, Controller):
        return source
    function, _, time = source.rpartition("@")
    return Controller(function, value_in_si("sample time", time.strip(), {"sample time": parse_unit("s")}))


def loaded(controller: Controller) -> Callable[..., Any]:
    """The function or class of a ``controller``; a program runs anew.

    Raises LoadError for a program that fails or does not have it.
    """
    if controller.file is None:
        return controller.function  # type: ignore[return-value]
    found = program(controller.file)
    if not callable(found.get(controller.label)):
        known = [name for name, item in found.items() if callable(item) and not name.startswith("_")]
        raise LoadError(
            f"{controller.file}: there is no function '{controller.label}'; {suggestion(controller.label, known)}"
        )
    return found[controller.label]  # type: ignore[no-any-return]


def controller_component(name: str, source: Controller | str) -> Component:
    """The component ``name`` of a Python function, with its parameters as connectors; connections give the others.

    Raises LoadError for a function that does not exist or does not fit.
    """
    controller = controller_of(source)
    try:
        found = parameters_of(loaded(controller), controller.label)
    except LoadError as error:
        raise LoadError(f"the component '{name}': {error}") from error
    connectors = {p: Connector(p, "parameter", "Real", None, (), settable=True) for p in found}
    return component_with(name, controller, connectors)


def parameters_of(function: Callable[..., Any], label: str) -> dict[str, float]:
    """{parameter: default}: the arguments of a ``function`` behind (t, inputs), or those with which a class is made.

    Raises LoadError for a function without these two, and for a parameter whose default is no number.
    """
    is_class = inspect.isclass(function)
    called = [*inspect.signature(function).parameters.values()]
    plain = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if not is_class and (len(called) < 2 or any(p.kind not in plain for p in called[:2])):
        raise LoadError(f"'{label}' takes {inspect.signature(function)}; it has to take (t, inputs), and parameters")
    found = {}
    for p in called if is_class else called[2:]:
        if not isinstance(p.default, (int, float)):
            raise LoadError(f"'{label}' has the argument '{p}'; a parameter needs a number as default, e.g. {p.name}=1")
        found[p.name] = p.default
    return found


def with_connectors(words: Iterable[str], components: Mapping[str, Component]) -> dict[str, Component]:
    """The ``components``, with the inputs and outputs that connections such as 'plant.x:controller.x' give functions.

    Between two functions the output stands first. Words that fit nothing are left to whom connects.
    """
    found = dict(components)
    for word in words:
        left, _, right = (part.strip() for part in word.partition(":"))
        for own, other, by_side in ((left, right, "output"), (right, left, "input")):
            name, _, variable = own.partition(".")
            component = found.get(name)
            if component is None or component.controller is None or not variable:
                continue
            far = _connector(other, components)
            causality = {**dict.fromkeys(GIVES, "input"), "input": "output"}.get(far.causality if far else "", by_side)
            connector = Connector(variable, causality, "Real", None, far.sizes if far else (), settable=False)
            before = component.connectors.get(variable, connector)
            found[name] = replace(component, connectors={**component.connectors, variable: before})
    return found


def _connector(end: str, components: Mapping[str, Component]) -> Connector | None:
    name, _, variable = end.partition(".")
    return components[name].connectors.get(variable) if name in components else None
