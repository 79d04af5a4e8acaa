"""SymPy's mechanics as mechanisms: LagrangesMethod, KanesMethod and System of ``sympy.physics.mechanics``."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature

from sympy.physics.mechanics import KanesMethod, LagrangesMethod, System

from lag2fmu.formats.mechanics.equations import from_kane, from_lagrange, from_system
from lag2fmu.formats.mechanics.translation import Translation
from lag2fmu.mechanism.record import Mechanism


def maker(found: object, name: str) -> Callable[..., Mechanism]:
    """The function that makes the mechanism ``name`` of ``found``, an object of SymPy's.

    Its keyword arguments are the values of all symbols that are constant, in one system of units. Raises LoadError if
    something is missing in ``found`` or cannot be translated, and MechanismError if the mechanism is not complete.
    """
    read = next(f for kind, f in _READERS.items() if isinstance(found, kind))
    translation = Translation(read(found, name), name)

    def make(**values: float) -> Mechanism:
        return translation.mechanism(values)

    keywords = [Parameter(p, Parameter.KEYWORD_ONLY, annotation=float) for p in translation.parameters]
    make.__name__ = name
    make.__signature__ = Signature(keywords)  # type: ignore[attr-defined]  # inspect.signature reads it
    make.spelled = translation.spelled  # type: ignore[attr-defined]  # ``load`` finds the keywords by it
    make.moving = translation.moving  # type: ignore[attr-defined]  # what has a start instead of being a keyword
    return make


_READERS = {LagrangesMethod: from_lagrange, KanesMethod: from_kane, System: from_system}
