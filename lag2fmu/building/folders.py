"""The folders of the user's cache: where they are, and whether what they hold may be trusted."""

from __future__ import annotations

import logging
import os
import shutil
from functools import lru_cache
from pathlib import Path

LEAST_FREE = 64 * 2**20
"""With less room on the disk (bytes) than this, a folder counts as full: the compiler's parts of one platform take
as much."""

_LOGGER = logging.getLogger("lag2fmu")


def cache_folder() -> Path:
    """The folder of lag2fmu in the user's cache, by the habits of the platform; it need not exist."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("lag2fmu", appauthor=False))


def refusal(folder: Path) -> str:
    """Make ``folder`` for this user alone; the reason why it cannot be used, or nothing.

    A folder that others own or may write to is refused, because what lies there is run. Windows guards the user's
    folders by itself.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found, free = folder.stat(), shutil.disk_usage(folder).free
    except OSError as error:
        return error.strerror or str(error)
    reason = foreign(found)
    if not reason and not os.access(folder, os.W_OK | os.X_OK):
        reason = "it cannot be written"
    if not reason and free < LEAST_FREE:
        reason = f"its disk is full, {free / 2**20:.0f} MB are left"
    return reason


def foreign(found: os.stat_result) -> str:
    """Why what ``found`` tells of is not this user's alone, or nothing."""
    if os.name != "posix":
        return ""
    if found.st_uid != os.geteuid():
        return f"it belongs to another user, of number {found.st_uid}"
    return "other users may write to it" if found.st_mode & 0o022 else ""


@lru_cache(maxsize=256)
def say_once(text: str) -> None:
    """Log the warning ``text``, once in a process."""
    _LOGGER.warning("warning: %s", text)
