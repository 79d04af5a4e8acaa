"""The states in which each function may be called: the state machine of co-simulation, FMI 2.0.5, section 4.2.4.

A column is a mode of the instance (the order of MODES: instantiated, initialization, step complete, step failed,
terminated, error). x: legal; d: legal for debugging; o: beyond the standard, but importers do it and it is harmless;
a dot: illegal. fmi2Reset and fmi2FreeFMUstate are always legal and do not come here.
"""

from __future__ import annotations

from .model import ACCELERATION, DEPENDENT, FURTHER_RATE, INPUT, LOCAL, PARAMETER, SETTING, STATE, TIME
from .state import MODES

CALLS = {
    #                             i z s f t x
    "SetupExperiment":           "x . . . . .",
    "EnterInitializationMode":   "x . . . . .",
    "ExitInitializationMode":    ". x . . . .",
    "Terminate":                 ". . x x . .",
    "GetReal":                   "o x x d x d",
    "SetReal":                   "x x x . . .",
    "GetFMUstate":               "x x x d x d",
    "SetFMUstate":               "x x x x x x",
    "DoStep":                    ". . x . . .",
}  # fmt: skip

SETTABLE = {
    #              i z s f t x
    TIME:         ". . . . . .",
    STATE:        "x x . . . .",
    ACCELERATION: ". . . . . .",
    FURTHER_RATE: ". . . . . .",
    INPUT:        "o x x . . .",
    PARAMETER:    "x x x . . .",
    SETTING:      "x x . . . .",
    DEPENDENT:    ". . . . . .",
    LOCAL:        ". . . . . .",
}  # fmt: skip


def verdict(row: str, mode: str) -> str:
    """The character of a row for ``mode``."""
    return row.split()[MODES.index(mode)]


def legal_modes(row: str) -> str:
    """The modes in which a row is legal, as text."""
    return ", ".join(mode for mode in MODES if verdict(row, mode) == "x")
