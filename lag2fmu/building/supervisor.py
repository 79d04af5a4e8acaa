"""A program that runs a command, and ends it with all its children when its own standard input is closed.

That happens when whoever started it is gone, however it went. It runs by itself, with no other module of lag2fmu.
"""

import os
import signal
import subprocess
import sys
import threading


def _end_with_the_input() -> None:
    """Wait for the end of standard input, and then end every process of this program."""
    while os.read(0, 1):
        pass
    if os.name == "posix":
        os.killpg(0, signal.SIGKILL)  # this program leads a group of its own
    else:
        subprocess.run(["taskkill", "/F", "/T", "/PID", str(os.getpid())], check=False, capture_output=True)  # noqa: S607


def _main() -> None:
    threading.Thread(target=_end_with_the_input, daemon=True).start()
    code = subprocess.run(sys.argv[1:], stdin=subprocess.DEVNULL, check=False).returncode
    os._exit(code if code >= 0 else 128 - code)


if __name__ == "__main__":
    _main()
