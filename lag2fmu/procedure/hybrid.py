"""The hybrid elements of a mechanism, in words and formulas.

These are contacts, stops and latches with their laws and modes at the start, dry friction, tables and further states.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.events import Contact, Friction
from lag2fmu.description.parts import Constraint
from lag2fmu.description.tables import Table
from lag2fmu.language.units import SECOND, Unit
from lag2fmu.language.writer import to_read
from lag2fmu.mechanism.completed import Unilateral
from lag2fmu.mechanism.poses import poses_of
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.mechanism.starts import start_values, value_at

_ROUNDING = 1e-9
"""Values are 0 up to this part of their size."""


class Law(NamedTuple):
    """A ``sentence`` with its formulas; each is (name or expression on the left side, right side)."""

    sentence: str
    formulas: tuple[tuple[str | sp.Expr, sp.Expr], ...] = ()


class Hybrid:
    """The laws of the hybrid elements in the mechanism ``m``, whose start values meet its constraints."""

    def __init__(self, m: Mechanism) -> None:
        self.m, self.poses = m, poses_of(m)
        self.start = start_values(m, guesses=True)

    def contacts(self) -> Iterator[Law]:
        """The laws of contacts, stops, compliant contacts and latches, each with its mode at the start."""
        if len(self.m.unilaterals) > 1:
            shared = {"sequential": "in rounds", "simultaneous": "in one problem over all that touch"}
            yield Law(f"impacts of several contacts are solved {shared[self.m.impacts]}")
        for unilateral in self.m.unilaterals:
            yield self._of_unilateral(unilateral)
        for contact in self.m.contacts:
            if contact.law == "compliant":
                yield self._of_compliant(contact)
        for latch in self.m.latches:
            yield self._of_latch(latch)

    def forces(self) -> Iterator[Law]:
        """The laws of dry frictions and tables."""
        for friction in self.m.frictions:
            yield self._of_friction(friction)
        for table in self.m.tables:
            yield Law(_of_table(table))

    # ------------------------------------------------------------------------------------------------ one by one

    def _of_unilateral(self, u: Unilateral) -> Law:
        kind = "stop" if u.where.startswith("stops.") else "contact"
        laws = [
            f"{kind} {u.name}: gap and force are at least 0, and one of them is 0",
            f"restitution {to_read(u.restitution)}",
        ]
        formulas: list[tuple[str | sp.Expr, sp.Expr]] = [(names.gap(u.name), self.poses.resolved(u.gap))]
        if u.slips:
            static = "" if u.static_friction == u.friction else f", sticking {to_read(u.static_friction)}"
            laws.append(f"friction {to_read(u.friction)}{static}")
            several = len(u.slips) > 1
            formulas += [
                (_slip(f"{u.name}_{k}" if several else u.name), self.poses.resolved(slip))
                for k, slip in enumerate(u.slips, 1)
            ]
        mode = self._opening(u.gap, u.unit)
        if mode == "closed at the start" and u.slips:
            speeds = [self._value(slip) for slip in u.slips]
            mode += "" if None in speeds else f", {_moving(speeds, u.unit)}"  # type: ignore[arg-type]
        return Law("; ".join(filter(None, [*laws, mode])), tuple(formulas))

    def _of_compliant(self, contact: Contact) -> Law:
        gap = next(d.expression for d in self.m.definitions if d.name == names.gap(contact.name))
        damped = f"*(1 + {to_read(sp.sympify(contact.damping))}*d_dot)" if contact.damping is not None else ""
        laws = [
            f"compliant contact {contact.name}: presses by {to_read(sp.sympify(contact.stiffness))}*d**1.5{damped}, d "
            "being its penetration, and never pulls"
        ]
        if contact.slip_speed is not None:
            fading = to_read(sp.sympify(contact.slip_speed))
            laws.append(f"friction {to_read(sp.sympify(contact.friction))}, which fades below the slip speed {fading}")
        unit = next(o.unit for o in self.m.outputs if o.name == names.gap(contact.name))
        laws.append(self._opening(gap, unit if isinstance(unit, Unit) else None))
        return Law("; ".join(filter(None, laws)), ((names.gap(contact.name), self.poses.resolved(gap)),))

    def _of_latch(self, latch: Constraint) -> Law:
        margin = self._value(sp.sympify(latch.while_))
        mode = "" if margin is None else f"; {'holds' if margin > 0 else 'released'} at the start"
        condition = to_read(sp.sympify(latch.while_))
        sentence = f"{latch.kind} constraint {latch.name}, which holds while {condition} is above 0{mode}:"
        return Law(sentence, ((self.poses.resolved(latch.expression), sp.S.Zero),))

    def _of_friction(self, friction: Friction) -> Law:
        holding = "as much" if friction.static is None else to_read(sp.sympify(friction.static))
        speed = self._value(sp.sympify(friction.on))
        mode = "" if speed is None else f"; {_moving([speed], None)} at the start"
        sentence = (
            f"dry friction {friction.name}: {to_read(sp.sympify(friction.force))} against the slip, up to {holding} "
            f"while it sticks{mode}"
        )
        return Law(sentence, ((_slip(friction.name), self.poses.resolved(friction.on)),))

    def _opening(self, gap: object, unit: Unit | None) -> str:
        """The sentence that a contact is open or closed at the start; "" if the ``gap`` has no value there."""
        whole = self.poses.resolved(sp.sympify(gap))
        value = self._value(whole)
        if value is None:
            return ""
        size = sum(abs(self._value(term) or 0.0) for term in sp.Add.make_args(whole))
        if value > _ROUNDING * size:
            return f"open at the start, by {_quantity(value, unit)}"
        rate = self._value(self._rate(whole)) or 0.0
        return "closed at the start" if rate == 0 else f"{'opens' if rate > 0 else 'an impact'} at the start"

    def _rate(self, expression: object) -> sp.Expr:
        return self.poses.rate(self.poses.resolved(sp.sympify(expression)))

    def _value(self, expression: sp.Expr) -> float | None:
        return value_at(self.poses.resolved(expression), self.start)


def _slip(name: str) -> str:
    return f"slip_{name}"


def _moving(speeds: list[float], unit: Unit | None) -> str:
    speed = sum(v**2 for v in speeds) ** 0.5
    return f"slides at {_quantity(speed, None if unit is None else unit / SECOND)}" if speed else "at rest"


def _quantity(value: float, unit: Unit | None) -> str:
    return f"{value:.6g} {unit.si_name if unit is not None else ''}".strip()


def _of_table(table: Table) -> str:
    size = " by ".join(str(len(axis)) for axis in table.grid.axes)
    outside = {"hold": "held", "extrapolate": "extrapolated", "error": "an error"}[table.outside]
    return f"table {table.name}: {size} points, {table.interpolation} between them, {outside} outside"
