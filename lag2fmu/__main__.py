"""The program lag2fmu, also as ``python -m lag2fmu``: the command line in a process of its own."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from contextlib import suppress

_YOUNG = 300_000
"""Objects that a command makes before the first collection of garbage.

Modules and equations are made of objects that stay. Python's own 700 take a tenth of the time of a small export.
"""


def program() -> None:
    """Run the command that the arguments of the process name; the process ends with it."""
    gc.set_threshold(_YOUNG, *gc.get_threshold()[1:])
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started the process: nobody reads
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
    from lag2fmu.cli import main

    ending: list[int] = []
    atexit.register(_end_process, ending)  # called after whatever the command registers
    try:
        main()
    except SystemExit as leaving:
        if isinstance(leaving.code, int):
            ending.append(leaving.code)
        raise


def _end_process(ending: list[int]) -> None:
    """End this process with the exit code in ``ending``, if there is one.

    What the modules and the equations are made of goes with the process. Python alone takes it apart object by object,
    which is a thirtieth of a small export.
    """
    with suppress(OSError):  # of a reader that is gone Python tells
        sys.stdout.flush()
        sys.stderr.flush()
        if ending:
            os._exit(*ending)


if __name__ == "__main__":
    program()
