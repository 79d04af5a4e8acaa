"""Groups of things that belong together because some of them are tied."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

Member = TypeVar("Member")


def united(groups: Iterable[Iterable[Member]]) -> list[set[Member]]:
    """The sets that remain when ``groups`` with a common member are united; no two of the sets share a member."""
    apart: list[set[Member]] = []
    for group in map(set, groups):
        whole = group.union(*(other for other in apart if other & group))
        apart = [*(other for other in apart if not other & group), whole]
    return apart
