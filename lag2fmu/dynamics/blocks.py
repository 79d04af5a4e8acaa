"""Groups of things that belong together because some of them are tied."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

Member = TypeVar("Member")


def united(groups: Iterable[Iterable[Member]]) -> list[set[Member]]:
    """What remains when ``groups`` with a common member are united: sets without one."""
    apart: list[set[Member]] = []
    for group in map(set, groups):
        whole = group.union(*(other for other in apart if other & group))
        apart = [*(other for other in apart if not other & group), whole]
    return apart
