"""The search for modes that meet the laws: by combinations, those near the present ones first, or by projections.

Source: Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 4 to 7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import combinations, islice, product

from lag2fmu.reference.hybrid.laws import EXACT, Item, Outcome, idle_contacts, lawful, units
from lag2fmu.reference.hybrid.modes import SENSE, Mode
from lag2fmu.reference.hybrid.projections import in_space, projected
from lag2fmu.reference.state import Floats

MOST = 3000
"""If there are more combinations, only the first ones are tried, and then the prox iteration."""

Solved = Callable[[Sequence[Item]], Outcome | None]
"""The outcome for items, by either way."""


def decided(
    D: Floats, c: Floats, items: Sequence[Item], pace: float, present: Sequence[Mode | None] | None = None
) -> Outcome | None:
    """The modes that meet the laws, for D (k, k) and c (k,): the ``present`` ones where they go on.

    Otherwise what rests gives way to its static friction, and then rubs or holds with its sliding friction. Without
    that either of two frictions in a row could slide and spare the other one. Where contacts slide, those that touch
    take their share of the load if they can: it decides on what slides. ``pace``: the least size, in units of
    sqrt(D) of its row, that errors of w are measured by. None if no combination meets the laws (Painleve's paradox).
    Source: Ch. Glocker, Set-Valued Force Laws, 2001, chapters 4 to 7.
    """
    few = math.prod(len(item.options) for item in items) <= MOST
    known = [None if few else item.options[0] for item in items] if present is None else present

    idle: list[Outcome] = []

    def enumerated(tried: Sequence[Item], most: int = len(items)) -> Outcome | None:
        turns = islice(_in_turn(tried, known, most), MOST)
        return _first(D, c, tried, turns, pace, idle if tried is items else [])

    def by_projections(items: Sequence[Item]) -> Outcome | None:
        return projected(D, c, items, pace)

    if in_space(items):
        return _given_way(by_projections, items, known)
    return (
        enumerated(items, 0)
        or _given_way(enumerated, items, known)
        or enumerated(items)
        or (None if few else _given_way(by_projections, items, known))
        or next(iter(idle), None)
    )


def _first(
    D: Floats, c: Floats, items: Sequence[Item], turns: Iterable[tuple[Mode, ...]], pace: float, idle: list[Outcome]
) -> Outcome | None:
    """The first outcome that meets the laws, for D (k, k) and c (k,), but for those that spare a contact its share.

    The latter are added to ``idle``. None: there is no other one in which such contacts bear.
    """
    most, spared = units(D, c, pace)[1], set[int]()
    for modes in turns:
        outcome = lawful(D, c, items, modes, pace)
        if outcome is None:
            continue
        rubbing = _rubbing(items, outcome, idle_contacts(D, c, items, outcome, pace))
        if rubbing:
            spared |= {n for j in rubbing if (n := items[j].normal) is not None}
            idle.append(outcome)
        elif all(outcome.forces[n] > EXACT * most[n] for n in spared):
            return outcome
    return None


def _rubbing(items: Sequence[Item], outcome: Outcome, idle: list[int]) -> list[int]:
    """The ``idle`` contacts, if one of them or another one slides by friction."""
    closed = [j for j, mode in enumerate(outcome.modes) if mode not in (Mode.OPEN, Mode.STICKS)]
    slides = [j for j in idle if items[j].direction] + [j for j in closed if items[j].normal is not None]
    return idle if any(items[j].slips and items[j].friction > 0 for j in slides) else []


def _given_way(solved: Solved, items: Sequence[Item], present: Sequence[Mode | None]) -> Outcome | None:
    """The outcome where static limits tell what gives way, and sliding ones then hold for that."""
    tried = [x if x.direction or present[i] in SENSE else x.alike(static=True) for i, x in enumerate(items)]
    while (outcome := solved(tried)) is not None:
        slides = [mode not in (Mode.OPEN, Mode.STICKS) for mode in outcome.modes]
        begun = [i for i, x in enumerate(tried) if slides[i] and x.most(outcome.forces) > items[i].most(outcome.forces)]
        if not begun:
            break
        for i in begun:
            tried[i] = items[i].alike(static=False)
    return outcome


def _in_turn(items: Sequence[Item], present: Sequence[Mode | None], most: int) -> Iterator[tuple[Mode, ...]]:
    """Combinations that change ``most`` of the ``present`` modes at most, those first that change fewest.

    A present mode that is None, or no option of its item, is no mode to change.
    """
    kept = [i for i, item in enumerate(items) if present[i] in item.options]
    for count in range(min(len(kept), most) + 1):
        for changed in combinations(reversed(kept), count):
            yield from product(
                *(
                    [mode for mode in item.options if i not in kept or (mode is present[i]) is (i not in changed)]
                    for i, item in enumerate(items)
                )
            )


def all_outcomes(D: Floats, c: Floats, items: Sequence[Item], pace: float) -> list[Outcome]:
    """Every combination of modes that meets the laws, in order; D is (k, k), c is (k,), ``pace`` as in ``decided``.

    Of slips in space, whose directions are not known, the one that projections find.
    """
    if in_space(items):
        found = decided(D, c, items, pace)
        return [] if found is None else [found]
    outcomes = (lawful(D, c, items, modes, pace) for modes in product(*(item.options for item in items)))
    return [outcome for outcome in outcomes if outcome is not None]
