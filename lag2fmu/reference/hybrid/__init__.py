"""Hybrid mechanisms on the independent path: contacts, impacts, dry friction, conditions and switches.

SciPy integrates the pieces between events. Modes are found by trying their combinations against the laws themselves.
"""

from lag2fmu.reference.hybrid.kinks import is_hybrid
from lag2fmu.reference.hybrid.modes import Event, Mode, Modes

__all__ = ["Event", "Mode", "Modes", "is_hybrid"]
