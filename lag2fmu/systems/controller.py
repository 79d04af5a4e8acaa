"""A Python function that takes part in a system: which one, and how often it runs.

A function ``control(t, inputs)`` gets the time (s) and {input: value}, and returns {output: value}. Its inputs are what
connections end at, and its outputs are what connections begin at. Further arguments with a number as default are
parameters. What needs a state between its samples is a class: each run makes an instance of it and calls that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, TypeGuard

from lag2fmu.errors import LoadError

PYTHON = "application/x-lag2fmu-python"
"""The type (MIME) of a component that is a Python function, in the description of a system."""
FUNCTION = "org.lag2fmu.controller"
"""The type of the annotation that tells the name and the sample time (s) of the function."""
_IN_FILE = ".py:"


@dataclass(frozen=True)
class Controller:
    """A ``function`` that runs every ``sample_time`` (s) from the start of the run on; its outputs are held between.

    ``function`` is one in this process, a class whose instances are called, or a text "FILE.py:NAME".
    """

    function: Callable[..., Any] | str
    sample_time: float

    def __post_init__(self) -> None:
        """Raise LoadError for a sample time that is none."""
        if not (isfinite(self.sample_time) and self.sample_time > 0):
            raise LoadError(
                f"the sample time of '{self.label}' is {self.sample_time!r} s; give a positive one, e.g. 0.001"
            )

    @property
    def file(self) -> Path | None:
        """The program that holds the function; None for a function in this process."""
        return Path(self.function.rpartition(_IN_FILE)[0] + ".py") if isinstance(self.function, str) else None

    @property
    def label(self) -> str:
        """What the function is called."""
        if isinstance(self.function, str):
            return self.function.rpartition(_IN_FILE)[2]
        return getattr(self.function, "__name__", type(self.function).__name__)


def is_controller(source: object) -> TypeGuard[Controller | str]:
    """Whether ``source`` is a Controller, or a text FILE.py:NAME@SAMPLE_TIME."""
    return isinstance(source, Controller) or (isinstance(source, str) and _IN_FILE in source and "@" in source)
