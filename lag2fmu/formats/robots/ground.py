"""What of a robot touches the ground, and how: what its user chooses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from lag2fmu.description.events import LAWS
from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion

ALL = "all"
_GOES_WITH = ("friction", "restitution", "law", "pairs")


@dataclass(frozen=True)
class Ground:
    """Which ``links`` touch the ground, all of them if None, and the law of all contacts.

    Without ``friction`` it is that of the file. With ``pairs`` what is round on different links touches, too.
    """

    links: tuple[str, ...] | None
    friction: float | None = None
    restitution: float = 0.0
    law: str = "ideal"
    pairs: bool = False

    def takes(self, link: str) -> bool:
        """Whether ``link`` touches."""
        return self.links is None or link in self.links

    def check_links(self, known: Iterable[str], source: str) -> None:
        """Raise LoadError for a link that is not ``known``, or has no shape that touches."""
        known = sorted(set(known))
        for name in self.links or ():
            if name not in known:
                raise LoadError(f"{source}: ground = '{name}': no such link touches; {suggestion(name, known)}")
        if not known:
            raise LoadError(f"{source}: no link has a shape that could touch the ground; leave ground out")


def ground_of(chosen: dict[str, object], source: str) -> Ground | None:
    """What a user has ``chosen``: {"ground": "all" or names, "friction", ...}; None without ground.

    Names are a text with commas between, or a list. What is not chosen is None. Raises LoadError for what goes with
    ground where there is none, and for values out of bounds.
    """
    given = {name: value for name, value in chosen.items() if value is not None and value is not False}
    named = given.pop("ground", "")  # "" is none
    if not named:
        lonely = next(iter(given), None)
        if lonely is not None:
            raise LoadError(f"{source}: {lonely} goes with ground; say what touches: ground = all, or names of links")
        return None
    names = named.split(",") if isinstance(named, str) else named
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise LoadError(f"{source}: ground = {named!r}; give '{ALL}', or names of links")
    links = tuple(name.strip() for name in names)
    return _checked(Ground(None if links == (ALL,) else links, **given), source)  # type: ignore[arg-type]


def _checked(found: Ground, source: str) -> Ground:
    """``found``; raises LoadError for values out of bounds, and for such that exclude each other."""
    if found.law not in LAWS:
        raise LoadError(f"{source}: law = '{found.law}' is unknown; give one of {', '.join(LAWS)}")
    if found.friction is not None and not 0.0 <= found.friction < math.inf:
        raise LoadError(f"{source}: friction = {found.friction:g} is no coefficient; give 0 or more")
    if not 0.0 <= found.restitution <= 1.0:
        raise LoadError(f"{source}: restitution = {found.restitution:g}; Newton's coefficient is from 0 to 1")
    if found.restitution and found.law == "compliant":
        raise LoadError(f"{source}: restitution belongs to ideal contacts; a compliant one has damping in the text")
    return found
