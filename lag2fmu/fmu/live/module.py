"""The module of WebAssembly of a live page: the C sources of an FMU and its picture, compiled."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec

from lag2fmu.analysis.evaluation import attempted
from lag2fmu.codegen.sources import page_sources, public_names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.errors import DerivationError, ExportError
from lag2fmu.fmu.backends.backend import Maker
from lag2fmu.fmu.compilers import compile_module, is_long
from lag2fmu.fmu.live.drawing import drawing
from lag2fmu.fmu.live.parts import Live
from lag2fmu.fmu.live.spots import no_spots
from lag2fmu.fmu.live.work import work
from lag2fmu.fmu.scalar_variable import ScalarVariable

PAGES = ("live", "static")
VARIABLE = "LAG2FMU_PAGE"
"""The environment variable with the kind of page of exports that do not ask for one."""

MOST_TEXT = 12_000_000
"""The characters of C of a live page that was not asked for by name; a slow compiler takes a minute for them. A bound
in time would make the FMU depend on what else the machine does."""
MOST_BYTES = 4_000_000
"""The size of the module of such a page."""
STILL = (
    f"This page stands still: a live one takes more than {MOST_TEXT / 1e6:.0f} MB of C or {MOST_BYTES / 1e6:.0f} MB of "
    "WebAssembly. <code>--page live</code> makes it all the same."
)

_FASTER = "-fno-inline-functions"
"""An option for long sources, which take a tenth less time so."""
_SMALLER = "-flto"
"""An option for others: what is seen as a whole is up to a tenth smaller, and takes half a second more."""

_LOGGER = logging.getLogger("lag2fmu")


def page_choice(page: str | None) -> str:
    """The kind of page: ``page`` if it is given, else that of the environment, else live.

    Without zig there is no compiler for live pages; a page is then static unless ``page`` says live. Raises ExportError
    for an unknown kind.
    """
    choice = page or os.environ.get(VARIABLE) or "live"
    if choice not in PAGES:
        raise ExportError(f"unknown page '{choice}'; known are {', '.join(PAGES)}")
    return choice if page or find_spec("ziglang") is not None else "static"


def page_maker(page: str | None) -> Maker | None:
    """What makes the live page that ``page`` asks for, without bounds if by name; None for a static page.

    Raises ExportError for an unknown kind.
    """
    if page_choice(page) == "static":
        return None
    return live if page else _within_bounds


def _within_bounds(
    equations: EquationsOfMotion, program: Program, variables: Sequence[ScalarVariable], sources: Mapping[str, str]
) -> Callable[[], Live | None]:
    """What ``live`` returns, or what makes nothing and a warning where that exceeds MOST_TEXT or MOST_BYTES."""
    small = sum(map(len, sources.values())) <= MOST_TEXT
    compiled = live(equations, program, variables, sources) if small else None

    def made() -> Live | None:
        page = compiled and compiled()
        if page is None or len(page.module) > MOST_BYTES:
            _LOGGER.warning("warning: %s", re.sub("</?code>", "", STILL))
            return None
        return page

    return made


def live(
    equations: EquationsOfMotion,
    program: Program,
    variables: Sequence[ScalarVariable],
    sources: Mapping[str, str],
) -> Callable[[], Live]:
    """What compiles the picture of the mechanism of ``equations``, and their ``program`` from ``sources`` of an FMU.

    ``variables`` are those of the FMU. The function that is returned raises BuildError if the compiler fails.
    """
    picture = attempted(lambda: drawing(equations.mechanism), None)
    spots = no_spots()
    if picture is not None:
        try:
            spots = picture.spots.program(program)
        except DerivationError:  # a picture that depends on more than the state
            picture = None
    references = {v.name: v.value_reference for v in variables if v.derivative_of is None}
    texts = page_sources(sources, program, {"picture": spots, "work": work(equations, references)})

    def compiled() -> Live:
        module = compile_module(texts, public_names(["page.c"]), _FASTER if is_long(texts) else _SMALLER)
        if picture is None:
            return Live(None, module)
        for note in picture.notes:
            _LOGGER.warning("warning: %s", note)
        return Live(picture.data, module, picture.surfaces)

    return compiled
