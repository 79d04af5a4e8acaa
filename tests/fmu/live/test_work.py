"""The power in the live page's balance of energy is that of the equations on the independent path."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics.lagrange import derive
from lag2fmu.fmu.live.work import work
from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, coordinate, parameter, signal
from lag2fmu.reference.equations import Equations


def _hauled(**motion: object) -> Mechanism:
    """A bob on a rope that is hauled in over a moving support, with drag: all that changes h but further states."""
    x, y = coordinate("x", "m", start=1.2), coordinate("y", "m", start=-1.6)
    m, c, pull = parameter("m", 1.5, "kg"), parameter("c", 0.4, "N.s/m"), signal("pull", "N", start=2.0)
    side = signal("side", "m", **(motion or {"motion": True}))
    rope = Constraint("rope", x**2 + y**2 - (2 - TIME / 5) ** 2, "holonomic")
    return Mechanism(
        "hauled",
        coordinates=[x, y],
        parameters=[m, c],
        inputs=[pull, side],
        bodies=[Body("bob", m, (x + side, y))],
        energy=Energy(dissipation=c * (x.dot**2 + y.dot**2) / 2),
        forces={x: pull},
        constraints=[rope],
        gravity=9.81,
    )


MADE = {"hauled": _hauled, "followed": lambda: _hauled(motion="filtered", time_constant=0.3)}


@pytest.mark.parametrize("name", [*MADE, "dc_motor", "spring_mass_damper", "motion_driven_pendulum"])
def test_power_is_that_of_the_independent_path(name: str) -> None:
    """Somewhere with all inputs and states at random values, where every part of the power counts."""
    equations = derive(MADE[name]() if name in MADE else load(name))
    mechanism, reference = equations.mechanism, Equations(equations.mechanism)
    generator = np.random.default_rng(1)
    q, qd = generator.uniform(0.5, 1.5, (2, len(mechanism.coordinates)))
    inputs = {given: float(generator.uniform(0.5, 1.5)) for given in reference.energies.input_names}
    q, qd = reference.energies.consistent(q, qd, 0.7, inputs)
    state = reference.energies.state(0.7, q, qd, inputs)
    qdd, multipliers, _ = reference.rates(state)

    values = {"t": 0.7} | inputs | reference.energies.parameters
    values |= {c.name: float(x) for c, x in zip(mechanism.coordinates, q, strict=True)}
    values |= {f"{c.name}_dot": float(x) for c, x in zip(mechanism.coordinates, qd, strict=True)}
    values |= {f"multiplier_{c.name}": float(x) for c, x in zip(mechanism.constraints, multipliers, strict=True)}
    program = work(equations, {name: k for k, name in enumerate(values)})
    (*_, power), (*_, moving) = program.functions[0].results
    expected = reference.balance(0.7, q, qd, qdd, inputs)
    assert (moving != program.graph.zero) == (name in MADE)
    assert program.graph.evaluate([power], values) == pytest.approx([float(expected.power)], rel=1e-12)
    assert abs(expected.residual) < 1e-11 * expected.scale
    assert abs(expected.power) > 1e-3
