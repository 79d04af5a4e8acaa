"""The parts that a live page has in addition to those of a static one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Live(NamedTuple):
    """The ``picture`` and its ``surfaces``, data of a ``Drawing``, and the ``module`` in WebAssembly."""

    picture: Mapping[str, Any] | None
    module: bytes
    surfaces: bytes = b""

    @property
    def spatial(self) -> bool:
        """Whether the mechanism is drawn in space."""
        return self.picture is not None and not self.picture["planar"]
