"""The FMU and the independent path at single states, without integration: accelerations, momenta, energy, outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lag2fmu.description import names
from lag2fmu.dynamics.massless import continuous_states
from lag2fmu.mechanism import Constraint, Mechanism
from lag2fmu.mechanism.norms import norm_constraints
from lag2fmu.reference import Equations, Reference, sympy_accelerations
from lag2fmu.verify.report import Check
from lag2fmu.verify.simulate import Instance, instance
from lag2fmu.verify.task import ROUNDING, Floats, Task

_SYMPY_LIMIT = 3


def pointwise_checks(task: Task, reference: Reference) -> list[Check]:
    """Accelerations and everything calculated, at random states, inputs and parameters around the motion.

    States are near points of ``reference``, on the constraints; values are relative differences, with the bar ROUNDING.
    Up to 3 coordinates without constraints SymPy's Lagrange equations are compared as well. Raises SimulationError if
    the FMU does not answer.
    """
    generator = np.random.default_rng(7)
    n = len(task.mechanism.coordinates)
    own: list[Floats] = []
    independent: list[Floats] = []
    with instance(task.path) as fmu:
        for _ in range(3):
            parameters = _random_parameters(task.mechanism, generator)
            equations = Equations(task.mechanism, parameters)
            for q, qd, inputs in _random_states(task, reference, generator, equations):
                own.append(_calculated_by_fmu(task, fmu, q, qd, inputs | parameters))
                independent.append(_calculated(equations, q, qd, inputs))
        relative = _relative(own, independent)
        checks = [
            Check("accelerations, random states", float(relative[:n].max()), ROUNDING),
            Check("momenta, energy, outputs, random states", float(relative[n:].max()), ROUNDING),
        ]
        if n <= _SYMPY_LIMIT and not task.mechanism.constraints:
            checks.append(_sympy_check(task, fmu, reference, generator))
    return checks


def _random_parameters(mechanism: Mechanism, generator: np.random.Generator) -> dict[str, float]:
    """The independent parameters that may change, each moved by up to a tenth within its bounds."""
    fixed = mechanism.fixed_parameters
    free = [p for p in mechanism.parameters if p.value is not None and p.name not in fixed]
    moved = {p: (p.value or 0.0) * generator.uniform(0.9, 1.1) for p in free}
    return {p.name: _clipped(value, p.minimum, p.maximum) for p, value in moved.items()}


def _clipped(value: float, low: float | None, high: float | None) -> float:
    return float(np.clip(value, -np.inf if low is None else low, np.inf if high is None else high))


def _random_states(
    task: Task, reference: Reference, generator: np.random.Generator, equations: Equations, count: int = 8
) -> list[tuple[Floats, Floats, dict[str, float]]]:
    """(q, qd, inputs) near points of the trajectory, q and qd (n,), on the constraints."""
    n, energies = len(task.mechanism.coordinates), equations.energies
    moving = {name for m in task.mechanism.motions for name in (m.name, names.velocity(m.name))}
    held = moving if energies.constraints.m else set()
    scales = np.array([reference.scales[name] for name in task.states])
    rows = generator.integers(0, len(reference.trajectory), count)
    points = reference.trajectory.columns(task.states)[rows] + 0.05 * scales * generator.uniform(-1, 1, (count, 2 * n))
    states = []
    for x in points:
        inputs = {name: float(generator.uniform(-1, 1)) for name in energies.input_names if name not in held}
        q, qd = energies.consistent(x[:n], x[n:], 0.0, inputs) if energies.constraints.m else (x[:n], x[n:])
        states.append((q, qd, inputs))
    return states


def _calculated_by_fmu(task: Task, fmu: Instance, q: Floats, qd: Floats, values: Mapping[str, float]) -> Floats:
    """Accelerations, momenta, generalized energy and outputs of the FMU, (2n + 1 + outputs,)."""
    coordinates = [c.name for c in task.mechanism.coordinates]
    wanted = [*map(names.acceleration, coordinates), *map(names.momentum, coordinates), "generalized_energy"]
    wanted += [names.multiplier(c.name) for c in _bearing(task.mechanism)]
    wanted += task.mechanism.output_names
    x = [*q, *qd]
    states = {task.states[i]: x[i] for i in continuous_states(task.mechanism)}  # what has no mass follows
    return fmu.evaluate({**states, **values}, wanted)


def _calculated(equations: Equations, q: Floats, qd: Floats, inputs: Mapping[str, float]) -> Floats:
    """The same from the independent path."""
    state = (0.0, q, qd, inputs)
    energy, outputs = equations.generalized_energy(*state), equations.outputs(*state)
    constraints, bearing = equations.mechanism.constraints, _bearing(equations.mechanism)
    forces = [value for c, value in zip(constraints, equations.multipliers(*state), strict=True) if c in bearing]
    return np.array([*equations.accelerations(*state), *equations.momenta(*state), energy, *forces, *outputs.values()])


def _bearing(mechanism: Mechanism) -> list[Constraint]:
    """The constraints that forces belong to: no norms, and no equilibria of what has no mass."""
    norms = norm_constraints(mechanism)
    return [c for c in mechanism.constraints if c.name not in norms and not c.massless]


def _relative(own: Sequence[Floats], independent: Sequence[Floats]) -> Floats:
    """The largest difference of each quantity over all states, relative to its largest value, (k,).

    What stays below a ten-thousandth of the largest quantity is compared with that: it may be zero but for rounding.
    """
    size = np.abs(independent).max(axis=0)
    size = np.maximum(size, 1e-4 * size.max())
    ratio: Floats = np.abs(np.subtract(own, independent)).max(axis=0) / np.where(size > 0, size, 1.0)
    return ratio


def _sympy_check(task: Task, fmu: Instance, reference: Reference, generator: np.random.Generator) -> Check:
    symbolic = sympy_accelerations(task.mechanism)
    declared = {p.name: p.value for p in task.mechanism.parameters if p.value is not None}
    states = _random_states(task, reference, generator, Equations(task.mechanism))
    own = [_calculated_by_fmu(task, fmu, q, qd, inputs | declared) for q, qd, inputs in states]
    independent = [symbolic(0.0, q, qd, inputs) for q, qd, inputs in states]
    n = len(task.mechanism.coordinates)
    return Check(
        "accelerations, SymPy's equations", float(_relative([x[:n] for x in own], independent).max()), ROUNDING
    )
