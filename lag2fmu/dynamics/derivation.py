"""Derivation from a name or a file: the mechanism is loaded first."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lag2fmu.dynamics import lagrange
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism


def derive(
    model: Mechanism | str | Path, method: str | None = None, *, values: Mapping[str, float] | None = None
) -> lagrange.DerivedEquations:
    """Derive the equations of motion of ``model``: a mechanism, or a name or file that ``load`` takes.

    ``method`` is one of ACCELERATION_METHODS, by default the quicker one; ``values`` are other parameters and starts in
    SI units. Raises LoadError for a ``model`` that cannot be loaded, and DerivationError for another method, and as
    ``lagrange.derive`` does. Source: Hand, Finch, Analytical Mechanics, section 1.9.
    """
    if method is not None and method not in lagrange.ACCELERATION_METHODS:
        known = ", ".join(lagrange.ACCELERATION_METHODS)
        raise DerivationError(f"there is no method {method!r} of solving for accelerations; known are {known}")
    return lagrange.derive(as_mechanism(model, values), method)
