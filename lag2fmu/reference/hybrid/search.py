"""The search for modes that meet the laws: by combinations, those near the present ones first, or by projections.

Source: Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 4 to 7.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, islice, product

from lag2fmu.reference.hybrid.laws import Item, Outcome, lawful
from lag2fmu.reference.hybrid.modes import Mode
from lag2fmu.reference.hybrid.projections import in_space, iterated
from lag2fmu.reference.state import Floats

MOST = 3000
"""If there are more combinations, only the first ones are tried, and then the prox iteration."""


def decided(
    D: Floats, c: Floats, items: Sequence[Item], pace: float, present: Sequence[Mode | None] | None = None
) -> Outcome | None:
    """The modes that meet the laws, for D (k, k) and c (k,); of several those that change fewest ``present`` ones.

    ``pace``: the least size, in units of sqrt(D) of its row, that errors of w are measured by. None if no combination
    meets the laws (Painleve's paradox). Source: Ch. Glocker, Set-Valued Force Laws, 2001, chapters 4 to 7.
    """
    if in_space(items):
        return iterated(D, c, items, pace)
    few = math.prod(len(item.options) for item in items) <= MOST
    if present is None:
        present = [None if few else item.options[0] for item in items]
    for modes in islice(_in_turn(items, present), MOST):
        outcome = lawful(D, c, items, modes, pace)
        if outcome is not None:
            return outcome
    return None if few else iterated(D, c, items, pace)


def _in_turn(items: Sequence[Item], present: Sequence[Mode | None]) -> Iterator[tuple[Mode, ...]]:
    """All combinations, those first that change fewest ``present`` modes; None, or what is no option, is no mode."""
    kept = [i for i, item in enumerate(items) if present[i] in item.options]
    for count in range(len(kept) + 1):
        for changed in combinations(reversed(kept), count):
            yield from product(
                *(
                    [mode for mode in item.options if i not in kept or (mode is present[i]) is (i not in changed)]
                    for i, item in enumerate(items)
                )
            )


def all_outcomes(D: Floats, c: Floats, items: Sequence[Item], pace: float) -> list[Outcome]:
    """Every combination of modes that meets the laws, in order; D is (k, k), c is (k,), ``pace`` as in ``decided``."""
    outcomes = (lawful(D, c, items, modes, pace) for modes in product(*(item.options for item in items)))
    return [outcome for outcome in outcomes if outcome is not None]
