"""The state of a mechanism, or a batch of states, as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
InputValues = Mapping[str, ArrayLike]
"""{name of an input: SI value, or the values (m,) of a batch}."""


@dataclass(frozen=True)
class StateBatch:
    """A state of a mechanism, or a batch of states, in SI units.

    t is (*batch), q and qd are (n, *batch), inputs are (3 k + m + n + f, *batch) in the order of ``Symbols.inputs``.
    """

    t: Floats
    q: Floats
    qd: Floats
    inputs: Floats

    @cached_property
    def rows(self) -> Floats:
        """Everything stacked: t, q, qd, inputs, (1 + 2 n + 3 k + m + n, *batch)."""
        return np.concatenate([self.t[None], self.q, self.qd, self.inputs])

    def part(self, block: slice) -> StateBatch:
        """The states ``block`` of a batch."""
        return StateBatch(self.t[block], self.q[:, block], self.qd[:, block], self.inputs[:, block])


def batch_first(values: Floats, axes: int) -> Floats:
    """``values`` (its ``axes``, *batch) as (*batch, its axes): a view; NumPy's moveaxis takes six times as long."""
    turned: Floats = values.transpose(*range(axes, values.ndim), *range(axes))
    return turned


def batch_last(values: Floats) -> Floats:
    """``values`` (*batch, n) as (n, *batch): a view."""
    turned: Floats = values.transpose(-1, *range(values.ndim - 1))
    return turned
