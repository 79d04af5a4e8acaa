"""The names that have a meaning in every mechanism, so that no part can have them."""

from __future__ import annotations

from lag2fmu.description.names import ENERGIES, SETTINGS
from lag2fmu.language.vocabulary import CONSTANTS, FUNCTIONS, WORDS

GLOBAL_NAMES = {
    "t": "the time",
    "time": "the time",
    **dict.fromkeys(CONSTANTS, "a constant"),
    **dict.fromkeys(FUNCTIONS, "a function"),
    **dict.fromkeys(WORDS, "a word of the language of expressions"),
    **dict.fromkeys(SETTINGS, "a setting of the solver"),
    **dict.fromkeys(ENERGIES, "an energy that is calculated"),
    "external_power": "the power of the external forces",
}
"""{name: its meaning}."""
