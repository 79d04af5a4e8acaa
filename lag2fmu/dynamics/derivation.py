"""Derivation from a name or a file: the mechanism is loaded first."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lag2fmu.dynamics import lagrange
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism


def derive(
    model: Mechanism | str | Path, method: str | None = None, *, values: Mapping[str, float] | None = None
) -> lagrange.DerivedEquations:
    """Derive the equations of motion of ``model``: a mechanism, or a name or file that ``load`` takes.

    ``method`` is one of ACCELERATION_METHODS, by default the quicker one; ``values`` are other parameters and starts in
    SI units. Raises LoadError for a ``model`` that cannot
    be loaded, and DerivationError as ``lagrange.derive`` does. Source: Hand, Finch, Analytical Mechanics, section 1.9.
    """
    return lagrange.derive(as_mechanism(model, values), method)
