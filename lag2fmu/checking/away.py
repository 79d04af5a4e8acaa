"""Points of a run that are no start: what holds at a start, where much is 0, may be wrong elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lag2fmu.checking.description import Variable, number
from lag2fmu.checking.session import Model, Session

_STEPS = 5
_MOVED = 1.01
"""The factor between the value of a parameter elsewhere and its start."""

Values = Sequence[tuple[Variable, Sequence[Any]]]
"""Variables with the values of their elements."""


def lead_away(session: Session) -> None:
    """Lead a started session on, with other inputs. Raises RefusedError, and RecursionError as ``Session.step``."""
    move_inputs(session)
    session.steps(_STEPS)


def move_inputs(session: Session, but: Variable | None = None) -> None:
    """Give the continuous inputs other values, all but one of them. Raises RefusedError if they are not taken."""
    for v in _inputs(session.model):
        if v is not but:
            session.set(v, [x + 0.25 * max(abs(x), 1.0) for x in session.get(v)])


def later_values(model: Model) -> Values:
    """The values that inputs and exact starts have in the middle of a run: none of them 0 that moves.

    Raises RefusedError, and RecursionError as ``Session.step`` does.
    """
    exact = [
        v
        for v in model.description.variables
        if v.initial == "exact" and v.is_continuous and v.causality in ("output", "local") and v.readable
    ]
    with model.session() as session:
        lead_away(session.start())
        return [(v, session.get(v)) for v in (*exact, *_inputs(model))]


def moved_parameters(model: Model) -> Values:
    """Values of floating point parameters a hundredth away from their starts, as far as their bounds allow it.

    Raises RefusedError, also where no motion begins with them: bodies may overlap, or a chain may be too short.
    """
    found = []
    with model.session() as session:
        session.enter()
        for v in (v for v in model.description.variables if v.causality == "parameter" and v.type in model.floats):
            least, most = number(v.attribute("min")), number(v.attribute("max"))
            moved = [_MOVED * x for x in session.get(v)] if v.readable else []
            if moved and not any(x < least or x > most for x in moved):  # bounds that are not given are no numbers
                found.append((v, moved))
    with model.session() as session:
        give(session.enter(), found)
        session.instance.do("ExitInitializationMode")
    return found


def give(session: Session, values: Values) -> None:
    """Set ``values`` as far as they are taken."""
    for v, elements in values:
        session.set(v, elements)


def _inputs(model: Model) -> list[Variable]:
    return [v for v in model.description.variables if v.causality == "input" and v.is_continuous and v.readable]
