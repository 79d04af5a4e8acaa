"""The command line: the verbs of the library.

Exit code 0: done, 1: a check failed, 2: bad usage or bad input, 3: too little was compared to judge.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from lag2fmu.cli.caching import cache
from lag2fmu.cli.commands import (
    check,
    demo,
    export_command,
    import_command,
    models,
    new,
    page_command,
    show,
    simulate,
    validate,
)
from lag2fmu.cli.firmware_commands import c_command
from lag2fmu.cli.recording import record_command
from lag2fmu.cli.study_commands import calibrate, linearize, observe, sweep
from lag2fmu.cli.system_commands import cut_command, ssp
from lag2fmu.errors import Lag2FmuError
from lag2fmu.version import VERSION

__all__ = ["main"]


_THREADS = "OPENBLAS_NUM_THREADS"
"""The environment variable of the linear algebra of NumPy and SciPy: how many threads share a product of matrices.

The matrices of a mechanism are too small to be shared. To start the threads takes a twentieth of a small export.
"""


_SAFE_PATH = "PYTHONSAFEPATH"
"""The variable by which processes of Python (3.11 and newer) import nothing from the current folder by chance.

A file signal.py there stood for the module of that name in the workers of a sweep.
"""


class _BadInputError(click.ClickException):
    """An error of the user, shown as one line."""

    exit_code = 2


class _Commands(click.Group):
    """A group that turns every error of lag2fmu into one line and exit code 2."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Read the options; ``--help`` and ``--version`` write here, before any command is run."""
        with _errors_as_lines():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; if it is terminated, its temporary folders are removed."""
        _exit_when_terminated()
        os.environ.setdefault(_THREADS, "1")
        os.environ.setdefault(_SAFE_PATH, "1")
        with warnings.catch_warnings(), _errors_as_lines():
            warnings.simplefilter(
                "ignore", RuntimeWarning
            )  # NumPy's warnings; values that are not finite raise an error that names them
            return super().invoke(ctx)


@contextmanager
def _errors_as_lines() -> Iterator[None]:
    """Turn the errors of lag2fmu and of the files that are written into one line."""
    try:
        yield
    except Lag2FmuError as error:
        raise _BadInputError(str(error)) from error
    except OSError as error:
        if error.errno == errno.EPIPE:  # the reader of our output is gone; click deals with that
            raise
        where = f"'{error.filename}': " if error.filename else ""
        remedy = "is there room, and the right to write, there and in the folder for temporary files (TMPDIR)?"
        raise _BadInputError(f"{where}{error.strerror or error}; {remedy}") from error


def _exit_when_terminated() -> None:
    """Turn the signal to terminate into an exception, so that open files and folders are closed."""

    def leave(number: int, frame: object) -> None:
        sys.exit(128 + number)

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, leave)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, prog_name="lag2fmu")
def main() -> None:
    """From the Lagrangian of a mechanism to a validated FMU, FMI 2.0 or 3.0.

    MODEL is a bundled name (see 'lag2fmu models'), a .py, .toml, .urdf or .xml (MJCF) file, or FILE.py:NAME for a
    mechanism or an object of SymPy's mechanics. A .py file is run as a program, with all that it may do; the others are
    read and never run.
    """


_OF_MODELS = (demo, models, new, import_command, show, export_command, c_command, page_command, linearize)
_OF_RUNS = (simulate, validate, check, record_command, sweep, calibrate, observe, ssp, cut_command, cache)
for _command in (*_OF_MODELS, *_OF_RUNS):
    main.add_command(_command)
