"""Hybrid mechanisms on the independent path: contacts, impacts, dry friction, conditions and switches.

Pieces between events are integrated by SciPy, modes come from trying their combinations against the laws themselves.
"""

from lag2fmu.reference.hybrid.kinks import is_hybrid
from lag2fmu.reference.hybrid.modes import Event, Mode, Modes

__all__ = ["Event", "Mode", "Modes", "is_hybrid"]
