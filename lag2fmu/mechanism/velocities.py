"""What has to be a velocity: slips of contacts, what frictions oppose, rates of dampers."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.errors import MechanismError
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.writer import to_quote
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.scope import Scope


def check_velocities(m: Description, scope: Scope) -> None:
    """Raise MechanismError for a slip of a contact, a friction's ``on`` or a damper's rate that is no velocity."""
    poses = poses_of(m)
    rates = [(f"dampers.{d.name}.rate", sp.sympify(d.rate)) for d in m.dampers if d.rate is not None]
    for where, expression in (*slips(m), *rates):
        whole = poses.resolved(expression)
        # a damper on a prescribed motion is borne by the drive; what slides needs a velocity that it can change
        wanted = {"velocity", "motion velocity"} if where.startswith("dampers.") else {"velocity"}
        if wanted.isdisjoint(scope.meaning[name] for name in free_names([whole])):
            raise MechanismError(f"{where}: '{to_quote(expression)}' {_without_velocity(expression, whole, scope)}")


def slips(m: Description) -> Iterator[tuple[str, sp.Expr]]:
    """(place, expression) of everything that has to be affine in the velocities."""
    for contact in m.contacts:
        slips = contact.slip if isinstance(contact.slip, tuple) else () if contact.slip is None else (contact.slip,)
        for i, slip in enumerate(slips):
            place = f"contacts.{contact.name}.slip"
            yield f"{place}[{i}]" if isinstance(contact.slip, tuple) else place, sp.sympify(slip)
    for friction in m.frictions:
        yield f"frictions.{friction.name}.on", sp.sympify(friction.on)


def _without_velocity(expression: sp.Expr, whole: sp.Expr, scope: Scope) -> str:
    """What ``expression`` is instead of a velocity, and the remedy; ``whole`` has its definitions written out."""
    found = sorted(name for name in free_names([whole]) if scope.meaning[name] == "coordinate")
    if not found:
        return "contains no velocity; give the relative velocity"
    if expression == sp.Symbol(found[0], real=True):
        return f"is a coordinate, not a velocity; write {names.velocity(found[0])}"
    rates = ", ".join(map(names.velocity, found))
    return f"contains coordinates and no velocity; give its rate, with {rates}"
