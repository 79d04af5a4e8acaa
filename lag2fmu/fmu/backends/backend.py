"""The protocol of a backend: it checks the user's choices first, and later builds its files from the equations."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

from lag2fmu.codegen.tables import Vibrations
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.fmu.compilers import Progress
from lag2fmu.fmu.live.parts import Live
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.realtime import RealTime
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.sources import MANY
from lag2fmu.fmu.versions.version import Version
from lag2fmu.mechanism.record import Mechanism

if TYPE_CHECKING:
    from lag2fmu.analysis.observing import Observing
    from lag2fmu.fmu.taken import Taken

MOST_OF_A_NAME = 63
"""Characters of an identifier that C99 distinguishes (section 5.2.4.1), and the most in a name of MATLAB."""

Maker = Callable[[EquationsOfMotion, Program, Sequence[ScalarVariable], Mapping[str, str]], Callable[[], Live | None]]
"""A function from equations, program, variables and C sources of an FMU to one that compiles a live page's content.

The former works on the graph of the equations, where nothing else may work at the same time.
"""


class Choices(NamedTuple):
    """The user's choices for an export: ``solver`` and ``platform`` by name, ``compiler`` 'zig' or 'host'.

    ``progress`` is told how a compiler gets on. ``version`` is that of FMI. ``arrays``: coordinates are to be arrays.
    ``live`` makes the content of a live page; None for a static one. ``without`` names what is left out, of WITHOUT.
    ``realtime`` says how steps are bounded, None where they are not. ``sources`` is the form of the C code, of FORMS.
    ``observing`` is what an observer is asked for; None for an FMU that integrates.
    """

    solver: str
    platform: str
    compiler: str
    progress: Progress | None
    version: Version
    arrays: bool
    without: Collection[str] = ()
    live: Maker | None = None
    realtime: RealTime | None = None
    sources: str = MANY
    observing: Observing | None = None


class Content(NamedTuple):
    """What a backend makes: the description with its GUID, and the backend's own files {name in the archive: content}.

    ``binaries`` is a phrase on the libraries. ``resources`` are lines of HTML on further files, for the FMU's page;
    ``live`` is what makes this page a live one, None for a static one. ``doubt`` is a sentence for the user, or "".
    ``taken`` is what an FMU takes whose steps are bounded.
    """

    description: ModelDescription
    files: Mapping[str, bytes]
    binaries: str
    resources: tuple[str, ...]
    live: Live | None = None
    doubt: str = ""
    taken: Taken | None = None


Build = Callable[[Mechanism, EquationsOfMotion, Program, str, Vibrations], Content]
"""A function from mechanism, equations, program, name of a solver and vibrations to the content of an FMU.

The vibrations are those that this solver gets wrong if its steps do not resolve them.
"""


class Backend(Protocol):
    """A way to an FMU, under the ``name`` that the user gives; ``solvers`` are the methods that it can run."""

    @property
    def name(self) -> str:
        """The name that the user gives."""
        ...

    @property
    def solvers(self) -> Collection[str]:
        """The names of the methods that the FMU can run."""
        ...

    def prepare(self, choices: Choices) -> Build:
        """Check ``choices`` and return the function that builds. Raises ExportError or BuildError.

        The build raises ExportError for equations that the backend cannot print, BuildError if a tool fails.
        """
        ...


def identifier_of(name: str) -> str:
    """A short C identifier for the library of the mechanism ``name``."""
    return re.sub(r"\W", "_", name)[:MOST_OF_A_NAME]
