"""What has a drive, whose force is calculated: prescribed motions, and coordinates that the ports name."""

from __future__ import annotations

from lag2fmu.description.description import Description
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion


def carried(m: Description) -> tuple[str, ...]:
    """The names of what has a drive: prescribed motions, and behind them the coordinates among the ports' drives."""
    return (*m.driven, *(q.name for q in m.coordinates if q.name in m.ports.drives))


def check_drives(m: Description) -> None:
    """Raise MechanismError for a drive of a name that is no prescribed motion and no coordinate."""
    for name in m.ports.drives:
        if name not in carried(m):
            remedy = suggestion(name, m.driven)
            raise MechanismError(f"ports.drives: there is no prescribed motion or coordinate '{name}'; {remedy}")
