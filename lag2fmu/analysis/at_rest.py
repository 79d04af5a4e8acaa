"""``equilibria`` and ``modes`` for a mechanism, its name or its file; and the equilibrium as a start."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lag2fmu.analysis.equilibria import Equilibrium
from lag2fmu.analysis.equilibria import equilibria as equilibria_of
from lag2fmu.analysis.linearization import linearize as linearization_of
from lag2fmu.analysis.modes import NaturalMode, normal_modes
from lag2fmu.description import names
from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.language.writer import without_dust
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling

Model = EquationsOfMotion | Mechanism | str | Path
"""Derived equations, a mechanism, or the name or path of a model."""


@telling("searching for equilibria")
def equilibria(model: Model, *, values: Mapping[str, float] | None = None, **options: Any) -> tuple[Equilibrium, ...]:
    """The equilibria of ``model`` that are found from its start, and from places around it, in this order.

    ``values`` are other parameters and starts in SI units, ``options`` those of ``lag2fmu.analysis.equilibria``. Each
    equilibrium has q (n,) in SI units. Raises LoadError or DerivationError for a ``model`` that has no equations.
    """
    return equilibria_of(equations_of(model, values), **options)


@telling("searching for modes")
def modes(model: Model, *, values: Mapping[str, float] | None = None, **about: Any) -> tuple[NaturalMode, ...]:
    """The normal modes of ``model``, with shapes (n,) and eigenvalues in 1/s, see ``lag2fmu.analysis.normal_modes``.

    They are about the equilibrium found from the start, or about the start if there is none. ``values`` are other
    parameters and starts in SI units. ``about`` are arguments of ``lag2fmu.analysis.linearize``: another place is given
    as q= (n,) in SI units. Raises LoadError or DerivationError for a ``model`` that has no equations.
    """
    equations = equations_of(model, values)
    if not about and (found := equilibria_of(equations, most=1)):
        about = {"q": found[0].q, "further": found[0].further}
    return normal_modes(linearization_of(equations, **about))


def resting(model: Mechanism | str | Path) -> Mechanism:
    """``model`` starting at rest in the equilibrium found from its start; raises DerivationError if there is none."""
    equations = derive(model)
    found, coordinates = the_equilibrium(equations), equations.mechanism.coordinates
    starts = {c.name: without_dust(float(x), c.nominal) for c, x in zip(coordinates, found.q, strict=True)}
    starts |= {names.velocity(c.name): 0.0 for c in coordinates}
    starts |= {z.name: float(x) for z, x in zip(equations.mechanism.states, found.further, strict=True)}
    return with_values(as_mechanism(model), starts)


def the_equilibrium(equations: EquationsOfMotion, inputs: Mapping[str, float] | None = None) -> Equilibrium:
    """The equilibrium found from the start, or from places around it, with the ``inputs`` {name: SI value}.

    Raises DerivationError if there is none.
    """
    found = equilibria_of(equations, most=1, inputs=inputs)
    if not found:
        raise DerivationError(
            f"mechanism '{equations.mechanism.name}': no equilibrium was found, neither from the start nor from places "
            "around it; set other start values, or begin at the start"
        )
    return found[0]


def equations_of(model: Model, values: Mapping[str, float] | None = None) -> EquationsOfMotion:
    """The equations of ``model`` with other ``values`` (SI) of parameters and starts; raises LoadError as ``load``."""
    if not isinstance(model, EquationsOfMotion):
        return derive(model, values=values)
    return derive(model.mechanism, values=values) if values else model
