"""A mechanism in plain C, for firmware: a header, one C file, a program that runs it, and how to build."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from lag2fmu.codegen.amalgamation import amalgamated
from lag2fmu.codegen.sources import engine_text, public_names, render_sources
from lag2fmu.codegen.tables import RuntimeTables
from lag2fmu.codegen.templates import render
from lag2fmu.codegen.tokens import in_single, with_words
from lag2fmu.dynamics.functions import Program
from lag2fmu.solvers.methods import Method

REALS = ("double", "float")
HEADER = "firmware.h"
"""The header of the engine with the record of an instance."""
SIZE = "FIRMWARE_SIZE"
"""The bytes of an instance, a constant of HEADER."""

OWN_MATH = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
    *("exp", "log", "pow", "hypot"),
)
"""The functions of libm that have other bits on other targets, and own ones in own_math.c."""
EXACT = ("sqrt", "fabs", "fmin", "fmax", "floor", "ceil", "fmod", "ldexp", "frexp", "copysign")
"""Those whose results IEEE 754 and C determine to the last bit."""


@dataclass(frozen=True)
class FirmwareVariable:
    """A variable in plain C: its ``number``, its name as a part of an identifier, what it is in words."""

    number: int
    name: str
    words: str


@dataclass(frozen=True)
class FirmwareStyle:
    """How a mechanism is written in C.

    - ``prefix``: of all names that a program sees; an identifier.
    - ``real``: the type of numbers, one of REALS.
    - ``own_math``: whether sines and the like are of this file, not of libm.
    """

    prefix: str
    real: str = "double"
    own_math: bool = False


def firmware_sources(
    program: Program, tables: RuntimeTables, method: Method, style: FirmwareStyle
) -> Mapping[str, str]:
    """{file name: text} of the engine for ``program`` in C, before it is joined; numbers are of the style's type."""
    sources = dict(render_sources(program, tables, method, "", "firmware"))
    single = style.real == "float"
    if single:
        sources["scale.h"] = engine_text("base/single/scale.h")
    if style.own_math:
        own = {name: f"own_{name}" for name in OWN_MATH}
        sources = {name: _with_own_math(with_words(text, own)) for name, text in sources.items()}
        sources |= {name: engine_text(f"base/own_math/{name}") for name in ("own_math.h", "own_math.c")}
        sources["own_constants.h"] = engine_text(f"base/own_math/{style.real}/own_constants.h")
    if not single:
        return sources
    return {name: in_single(text, (*EXACT, *(() if style.own_math else OWN_MATH))) for name, text in sources.items()}


def _with_own_math(text: str) -> str:
    """The ``text`` of a C file with the header of the own functions behind that of libm's."""
    return text.replace("#include <math.h>\n", '#include <math.h>\n#include "own_math.h"\n', 1)


def firmware_files(
    sources: Mapping[str, str],
    style: FirmwareStyle,
    size: int,
    told: Mapping[str, object],
) -> dict[str, str]:
    """{file name: text} of the folder: the joined ``sources`` with the names of the mechanism, and what goes with them.

    ``size`` is the number of bytes of an instance; ``told`` has what the files say of the mechanism: its ``entries``,
    those that are ``outputs`` and ``inputs``, and texts.
    """
    prefix, names = style.prefix, public_names(sources)
    renamed = [f"#define {name} {prefix}_{name}" for name in names]
    context = {
        "prefix": prefix,
        "real": style.real,
        "own_math": style.own_math,
        "size": size,
        "failures": _enumeration(sources["instance.h"], "FailureKind", prefix),
        "notices": _enumeration(sources["instance.h"], "NoticeKind", prefix),
        "statuses": _enumeration(sources[HEADER], "FirmwareStatus", prefix, "FIRMWARE_"),
        "renamed": "\n".join(renamed),
        "engine": _kept_inside(amalgamated(sources), names),
        **told,
    }
    texts: Mapping[str, Callable[[], str]] = {
        f"{prefix}.h": lambda: render("firmware/name.h.jinja", context),
        f"{prefix}.c": lambda: render("firmware/name.c.jinja", context),
        "main.c": lambda: render("firmware/main.c.jinja", context),
        "Makefile": lambda: render("firmware/Makefile.jinja", context),
        "README.md": lambda: render("firmware/README.md.jinja", context),
    }
    return {name: text() for name, text in texts.items()}


def _kept_inside(text: str, names: Iterable[str]) -> str:
    """C ``text`` whose functions with these ``names`` are static: compilers inline them, and leave out the unused."""
    begin = rf"^(?!static |extern |typedef |return |else )(?=[a-zA-Z][\w \*]*[ \*](?:{'|'.join(names)})\()"
    return re.sub(begin, "static ", text, flags=re.MULTILINE)


def probe_text(style: FirmwareStyle, told: Mapping[str, object]) -> str:
    """A program in C that runs the mechanism and prints, step by step, what it counts; see ``firmware_files``."""
    return render("firmware/probe.c.jinja", {"prefix": style.prefix, "real": style.real, **told})


def _enumeration(text: str, name: str, prefix: str, removed: str = "") -> str:
    """The constants of the enumeration ``name`` in C ``text``, with their comments; each gets the ``prefix``."""
    found = re.search(rf"typedef enum \{{\n((?:(?!typedef enum)[^}}])*)\}} {name};", text)
    if found is None:
        raise ValueError(f"there is no enumeration {name}")
    return re.sub(
        r"^( +)([A-Z_]+)", lambda m: f"{m[1]}{prefix}_{m[2].removeprefix(removed)}", found[1], flags=re.MULTILINE
    )
