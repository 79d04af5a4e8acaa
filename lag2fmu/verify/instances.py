"""FMUs as fmpy loads them: unpacked, instantiated, kept for the next run.

For the next run of the same file an FMU of lag2fmu is reset instead of loaded again. FMUs of other tools are loaded
anew, because many of them cannot be reset.
"""

from __future__ import annotations

import atexit
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ctypes import byref
from functools import cache
from pathlib import Path
from typing import Any

from lag2fmu.archives import DESCRIPTION, opened
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.xml_tree import parse

_WARNING, _OK = 1, 0
_KEPT = 4
"""At most this many instances wait for another run."""


def is_ours(description: Any) -> bool:
    """Whether lag2fmu made the FMU, by its ``description`` as fmpy reads it."""
    return str(description.generationTool or "").startswith("lag2fmu")


class Log:
    """Collects what an FMU says; its last sentences go into the error if a run fails."""

    def __init__(self) -> None:
        self.sentences: list[str] = []
        self.warnings: list[str] = []

    def __call__(self, environment: object, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        """The logger of FMI 2.0.5, section 2.1.5; sentences below a warning are dropped."""
        if status > _OK:
            self.sentences.append(message.decode("utf-8", "replace"))
        if status == _WARNING:
            self.warnings.append(self.sentences[-1])

    def of_fmi3(self, environment: object, status: int, category: bytes, message: bytes) -> None:
        """The logger of FMI 3.0.2, section 2.2.3.1."""
        self(environment, b"", status, category, message)

    def clear(self) -> None:
        """Forget everything, before another run."""
        self.sentences.clear()
        self.warnings.clear()

    def tail(self) -> str:
        """The last sentences, for an error."""
        return " | ".join(self.sentences[-3:]) or "the FMU gave no reason"


class Instance:
    """An instance of the FMU ``path``: ``fmu`` of fmpy, its ``description``, its ``log``."""

    def __init__(self, path: Path, description: Any, kind: str, *, events: bool, followed: Sequence[int]) -> None:
        """Unpack and instantiate; ``events``: with event mode and early return. Raises SimulationError.

        ``followed`` are value references of inputs for which the FMU asks, by FMI 3.0, within communication steps.
        """
        import fmpy
        from fmpy.simulation import instantiate_fmu

        _refuse_without_library(path, description)
        self.description, self.log = description, Log()
        self.asked: Callable[[float], None] | None = None
        self._callbacks: Any = None
        self._files = tempfile.TemporaryDirectory(prefix="lag2fmu-", ignore_cleanup_errors=True)
        self.folder = self._files.name
        try:
            fmpy.extract(str(path), self.folder, include=_needed)
            self.fmu = instantiate_fmu(
                self.folder,
                description,
                kind,
                logger=self.log.of_fmi3 if is_fmi3(description) else self.log,
                debug_logging=True,
                event_mode_used=events,
                early_return_allowed=events,
                intermediate_update=self._updated if followed else None,
                required_intermediate_variables=list(followed) or None,
            )
        except Exception as error:  # fmpy raises bare exceptions
            self._files.cleanup()
            raise SimulationError(f"'{path}': cannot be instantiated: {error}; {self.log.tail()}") from error

    def _updated(self, environment: object, time: float, wanted: bool, *_: object) -> None:
        """The callback of FMI 3.0.2, section 4.2.2: inputs are ``wanted`` at this time."""
        if wanted and self.asked is not None:
            self.asked(time)

    @property
    def lasting(self) -> bool:
        """Whether it can be reset for another run."""
        return is_ours(self.description)

    def reset(self) -> None:
        """Bring the FMU back to the state after instantiation."""
        self.fmu.reset()
        self.log.clear()
        self.listen()

    def listen(self) -> None:
        """What the FMU says comes here: by FMI 2.0 fmpy passes it to the logger that was set last, of whatever FMU."""
        if is_fmi3(self.description):
            return
        from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
        from fmpy.logging import addLoggerProxy

        if self._callbacks is None:  # kept as long as the FMU may call
            self._callbacks, self._logger = fmi2CallbackFunctions(), fmi2CallbackLoggerTYPE(self.log)
        self._callbacks.logger = self._logger  # which fmpy replaces by its own
        addLoggerProxy(byref(self._callbacks))

    def close(self) -> None:
        """Free the instance and remove its files."""
        self.fmu.freeInstance()
        self._files.cleanup()


def _needed(file: str) -> bool:
    """Whether an instance needs the ``file`` of an archive: no sources, no pages, no libraries of other platforms."""
    import fmpy

    folder, _, rest = file.partition("/")
    if folder == "binaries":
        return rest.split("/")[0] in (fmpy.platform, fmpy.platform_tuple)
    return folder not in ("sources", "documentation")


def _refuse_without_library(path: Path, description: Any) -> None:
    """Raise SimulationError for an FMU that was not compiled for this machine."""
    import fmpy

    place = fmpy.platform_tuple if is_fmi3(description) else fmpy.platform
    with opened(path) as archive:
        folders = [name.split("/") for name in archive.namelist()]
    places = sorted({folder[1] for folder in folders if folder[0] == "binaries" and len(folder) > 2})
    if place not in places:
        others = f"only for {', '.join(places)}" if places else "nor for any other"
        own = "compile its sources, or export it with --platform host"
        remedy = own if is_ours(description) else "export it for this machine by the tool that made it"
        raise SimulationError(f"'{path}': has no library for this machine ({place}), {others}; {remedy}")


_waiting: dict[tuple[object, ...], Instance] = {}
_lock = threading.Lock()


@contextmanager
def instance_of(path: Path, kind: str, *, events: bool = False, followed: tuple[int, ...] = ()) -> Iterator[Instance]:
    """An instance of the FMU ``path`` to run from its start, for ``kind`` CoSimulation or ModelExchange of fmpy.

    ``events``: co-simulation by FMI 3.0 uses event mode and early return; ``followed``: inputs that it asks for.
    Raises LoadError for a file that is no FMU, SimulationError for one that cannot be instantiated.
    """
    key = (*state_of(path), kind, events, followed)
    with _lock:
        found = _waiting.pop(key, None)
    instance = Instance(path, description_of(path), kind, events=events, followed=followed) if found is None else found
    try:
        if found is not None:
            instance.reset()
        yield instance
    except BaseException:
        instance.close()
        raise
    if instance.lasting:
        _keep(key, instance)
    else:
        instance.close()


def _keep(key: tuple[object, ...], instance: Instance) -> None:
    """Keep the ``instance`` for another run, until the process ends at the latest."""
    _close_kept_at_exit()
    with _lock:
        dropped = [_waiting.pop(key)] if key in _waiting else []
        _waiting[key] = instance
        if len(_waiting) > _KEPT:
            dropped.append(_waiting.pop(next(iter(_waiting))))
    for other in dropped:
        other.close()


@cache
def _close_kept_at_exit() -> None:
    """Have the kept instances closed when the process ends.

    What is registered last is called first. The folder of an instance registers its own removal when it is made. That
    must come later: Windows removes no library that is loaded, and Python warns of a folder that is removed for us.
    """

    def close_all() -> None:
        while _waiting:
            _waiting.popitem()[1].close()

    atexit.register(close_all)


_descriptions: dict[tuple[object, ...], Any] = {}


def description_of(path: Path) -> Any:
    """The model description of the FMU ``path`` as fmpy reads it; raises LoadError."""
    import fmpy

    key = state_of(path)
    if key not in _descriptions:
        try:
            with opened(path) as archive:
                parse(archive.read(DESCRIPTION), DESCRIPTION)  # raises LoadError for an XML that would take all memory
            found = fmpy.read_model_description(str(path), validate=False)
        except LoadError:
            raise
        except Exception as error:  # fmpy raises bare exceptions
            raise LoadError(f"'{path}': is no FMU that can be read: {error}") from error
        while len(_descriptions) >= _KEPT:
            _descriptions.pop(next(iter(_descriptions)))
        _descriptions[key] = found
    return _descriptions[key]


def state_of(path: Path) -> tuple[object, ...]:
    """Size and times of the file ``path``, which change if it is replaced; raises LoadError if there is none."""
    if not path.exists():
        raise LoadError(f"'{path}': there is no such file")
    state = path.stat()
    return str(path.resolve()), state.st_ino, state.st_mtime_ns, state.st_size


# -------------------------------------------------------------------------------------------------------- other uses


def offers_model_exchange(path: Path) -> bool:
    """Whether the FMU ``path`` can be run in model exchange; an FMU of the python backend cannot.

    Raises LoadError for a file that is no FMU.
    """
    return description_of(path).modelExchange is not None


def has_event_mode(path: Path) -> bool:
    """Whether the FMU ``path`` lets its importer see events in co-simulation, which FMI 3.0 has; raises LoadError."""
    return bool(getattr(description_of(path).coSimulation, "hasEventMode", False))


def is_fmi3(description: Any) -> bool:
    """Whether an FMU with this description, as fmpy reads it, is one of FMI 3.0."""
    return bool(description.fmiVersion.startswith("3."))
