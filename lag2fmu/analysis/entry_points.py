"""``linearize``, ``equilibria`` and ``modes`` of the package, for whatever stands for a mechanism."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lag2fmu.analysis.equilibria import Equilibrium
from lag2fmu.analysis.equilibria import equilibria as equilibria_of
from lag2fmu.analysis.linearization import Linearization
from lag2fmu.analysis.linearization import linearize as linearization_of
from lag2fmu.analysis.modes import Mode, normal_modes
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.mechanism.record import Mechanism

Model = EquationsOfMotion | Mechanism | str | Path
"""Derived equations, a mechanism, or the name or path of a model."""


def linearize(model: Model, **about: Any) -> Linearization:
    """The linearization of ``model`` about its start, or ``about`` q=, qd= (n,), further= (f,) in SI units and t= in s.

    See ``lag2fmu.analysis.linearize``. Raises DerivationError where M is singular or nothing is finite.
    """
    return linearization_of(_equations(model), **about)


def equilibria(model: Model, **options: Any) -> tuple[Equilibrium, ...]:
    """The equilibria of ``model`` that are found from its start and around it, the one found from the start first.

    See ``lag2fmu.analysis.equilibria``. Raises LoadError or DerivationError for a ``model`` that has no equations.
    """
    return equilibria_of(_equations(model), **options)


def modes(model: Model, **about: Any) -> tuple[Mode, ...]:
    """The normal modes of ``model`` about the equilibrium found from its start, or about q= (n,) in SI units.

    Where there is no equilibrium, about the start. See ``lag2fmu.analysis.normal_modes``. Raises LoadError or
    DerivationError for a ``model`` that has no equations.
    """
    equations = _equations(model)
    if not about and (found := equilibria_of(equations, most=1)):
        about = {"q": found[0].q, "further": found[0].further}
    return normal_modes(linearization_of(equations, **about))


def _equations(model: Model) -> EquationsOfMotion:
    return model if isinstance(model, EquationsOfMotion) else derive(model)
