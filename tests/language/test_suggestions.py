"""Names that are not known get those that were meant."""

from __future__ import annotations

import random
import string

import pytest
import sympy as sp

from lag2fmu.language.identifiers import suggestion

KNOWN = ["t", "kw", "m", "stiffness", "J", "theta_dot", "qz"]


@pytest.mark.parametrize("seed", range(20))
def test_one_wrong_letter_is_forgiven(seed: int) -> None:
    """Of two letters or more; another letter, one too many, one too few."""
    rng = random.Random(seed)
    name = rng.choice(["kw", "stiffness", "theta_dot"])
    at, letter = rng.randrange(len(name)), rng.choice(string.digits)
    wrong = [name[:at] + letter + name[at + 1 :], name[:at] + letter + name[at:]]
    wrong += [name[:at] + name[at + 1 :]] if len(name) > 2 else []
    for word in wrong:
        assert suggestion(word, KNOWN) == f"did you mean '{name}'?"


def test_capitals_are_told_before_what_is_similar() -> None:
    assert suggestion("j", KNOWN) == "did you mean 'J'?"
    assert suggestion("KW", [*KNOWN, "KV"]) == "did you mean 'kw'?"


def test_what_is_like_nothing_gets_all_names() -> None:
    assert suggestion("vx", KNOWN) == f"known are {', '.join(KNOWN)}"
    assert suggestion("a", KNOWN).startswith("known are")
    assert suggestion("a", []) == "there are none"


def test_a_symbol_in_place_of_its_name_is_told() -> None:
    assert suggestion(sp.Symbol("kw"), KNOWN) == "give the name as a text, 'kw'"
