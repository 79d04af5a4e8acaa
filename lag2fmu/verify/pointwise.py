"""The FMU and the independent path at single states, without integration: accelerations, momenta, energy, outputs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from lag2fmu.description import names
from lag2fmu.description.parts import Constraint
from lag2fmu.dynamics.massless import continuous_states
from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.drives import carried
from lag2fmu.mechanism.norms import norm_constraints
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.drives import DriveForces
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.initial_value_problem import PULL_BACK
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.symbolic import sympy_accelerations
from lag2fmu.verify.evaluation import Evaluation, evaluation
from lag2fmu.verify.firmness import Firmness
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import ROUNDING, Floats, Task

_SYMPY_LIMIT = 3
"""The most coordinates for which SymPy's own Lagrange equations are compared, too."""
_ROUNDING = 1e-14
"""Relative: how far beyond its bounds rounding may move a coordinate."""
BEGUN = 1e-12
"""The time (s) of both sides: a kink of the time at 0 is behind, also where rounding hides shorter times, as in
cos(w*t - a) - cos(a)."""
_PULLED = 10
"""Times how much more an FMU may pull back than the independent path, whose residuals of a velocity round otherwise."""
NEARER = (1.0, 0.1, 0.01, 0.0)
"""Random states are moved away from the motion by 5 %, times the first of these parts with which the equations are
defined."""


def pointwise_checks(task: Task, reference: Reference) -> list[Check]:
    """Checks of accelerations and of everything calculated, at random states, inputs and parameters around the motion.

    States are near points of ``reference``, on the constraints. The value of a check is a relative difference. The bar
    is ROUNDING, or the change by rounding of the states, of the mass matrix or of the residuals of constraints if this
    is more. For mechanisms of up to 3 coordinates without constraints SymPy's Lagrange equations are compared as well.
    Raises SimulationError if the FMU does not answer.
    """
    generator = np.random.default_rng(7)
    n = len(task.mechanism.coordinates)
    own: list[Floats] = []
    independent: list[Floats] = []
    moved: list[Floats] = []
    pulled: list[Floats] = []
    with evaluation(task.path, BEGUN) as fmu:
        for _ in range(3):
            parameters = _random_parameters(task.mechanism, generator)
            equations = Equations(task.mechanism, parameters)
            drives = DriveForces(equations)
            for q, qd, inputs in _random_states(task, reference, generator, drives):
                own.append(_calculated_by_fmu(task, fmu, q, qd, inputs | parameters))
                independent.append(_calculated(drives, q, qd, inputs))
                moved.append(_calculated(drives, (1 + ROUNDING / 100) * q, (1 + ROUNDING / 100) * qd, inputs))
                pulled.append(np.concatenate([_pulled_back(equations, q, qd, inputs), independent[-1][n:]]))
        relative, condition = _relative(own, independent), _relative(moved, independent)
        condition[:n] = np.maximum(condition[:n], _rounding_of_accelerations(equations, reference))
        condition[:n] = np.maximum(condition[:n], _PULLED * _relative(pulled, independent)[:n])
        labels = _labels(task.mechanism)
        checks = [_worst("momenta, energy, outputs, random states", labels[n:], relative[n:], condition[n:])]
        if n:
            checks.insert(0, _worst("accelerations, random states", labels[:n], relative[:n], condition[:n]))
        if 0 < n <= _SYMPY_LIMIT and not task.mechanism.constraints:
            checks.append(_sympy_check(task, fmu, reference, generator))
    return checks


def _rounding_of_accelerations(equations: Equations, reference: Reference) -> float:
    """A bound of the relative change of accelerations by rounding of the mass matrix.

    It is ten units of rounding times the condition of the scaled matrix; 0 under constraints, where M may be singular.
    Source: N. Higham, Accuracy and Stability of Numerical Algorithms, second edition, section 7.2.
    """
    if equations.energies.constraints.m or not equations.n:
        return 0.0
    coordinates = [c.name for c in equations.mechanism.coordinates]
    start = reference.trajectory.columns([*coordinates, *map(names.velocity, coordinates)])[0]
    matrix = equations.mass_matrix(0.0, start[: equations.n], start[equations.n :])
    diagonal = np.abs(np.diagonal(matrix))
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    condition = float(np.linalg.cond(scale[:, None] * matrix * scale))
    return 10 * float(np.finfo(float).eps) * condition if np.isfinite(condition) else 0.0


def _pulled_back(equations: Equations, q: Floats, qd: Floats, inputs: Mapping[str, float]) -> Floats:
    """qdd (n,) with a pull back onto the constraints as in an FMU, which makes much of rounded velocities."""
    rate = PULL_BACK / equations.mechanism.experiment.step
    return equations.rates(equations.energies.state(BEGUN, q, qd, inputs), rate)[0]


def _worst(name: str, labels: Sequence[str], relative: Floats, condition: Floats) -> Check:
    """The check of the greatest of the ``relative`` differences of ``labels``, (k,), with its bar."""
    worst = int(np.argmax(np.nan_to_num(relative, nan=np.inf)))
    bar = max(ROUNDING, float(np.nanmax(condition, initial=0.0)))
    return Check(name, float(relative[worst]), bar, f"largest difference: {labels[worst]}")


def _random_parameters(mechanism: Mechanism, generator: np.random.Generator) -> dict[str, float]:
    """The independent parameters that may change, each moved by up to a tenth within its bounds."""
    fixed = mechanism.fixed_parameters
    free = [p for p in mechanism.parameters if p.value is not None and p.name not in fixed]
    moved = {p: (p.value or 0.0) * generator.uniform(0.9, 1.1) for p in free}
    return {p.name: _clipped(value, p.minimum, p.maximum) for p, value in moved.items()}


def _clipped(value: float, low: float | None, high: float | None) -> float:
    return float(np.clip(value, *_bounds(low, high)))


def _bounds(low: float | None, high: float | None) -> tuple[float, float]:
    return -np.inf if low is None else low, np.inf if high is None else high


def _random_states(
    task: Task, reference: Reference, generator: np.random.Generator, drives: DriveForces, count: int = 8
) -> list[tuple[Floats, Floats, dict[str, float]]]:
    """(q, qd, inputs with further states) near points of the trajectory, q and qd (n,), on the constraints.

    They are within the bounds of the coordinates, because an FMU takes no state outside of them. If constraints cannot
    be met there or lead out of the bounds, or if the independent equations have no finite value, a state nearer to the
    trajectory is taken; if there is none, the state is left out. So are those where a constraint is about to be lost,
    if there are others.
    """
    n, energies = len(task.mechanism.coordinates), drives.equations.energies
    moving = {name for m in task.mechanism.motions for name in (m.name, names.velocity(m.name))}
    held = moving if energies.constraints.m else set()
    ranges = _input_ranges(task, energies.input_names)
    scales = np.array([reference.scales[name] for name in task.states])
    low, high = _ranges(task.mechanism)
    points = reference.trajectory.columns(task.states)
    points = points[((low <= points[:, :n]) & (points[:, :n] <= high)).all(axis=1)]
    points = points[generator.integers(0, len(points), count)]
    states: list[tuple[Floats, Floats, dict[str, float]]] = []
    for point, away in zip(points, 0.05 * scales * generator.uniform(-1, 1, (count, len(scales))), strict=True):
        inputs = {name: float(generator.uniform(*between)) for name, between in ranges.items() if name not in held}
        tried = (_put(task, drives, point + part * away, inputs, (low, high)) for part in NEARER)
        states += itertools.islice(filter(lambda state: _defined(drives, *state), tried), 1)
    if not states:
        raise SimulationError(
            f"mechanism '{task.mechanism.name}': the equations have no finite value at random states near the motion, "
            "nor on it; write what overflows in another way"
        )
    x, run = reference.trajectory.columns(task.states), reference.trajectory
    firm = Firmness.along(energies, energies.state(run.time, x[:, :n], x[:, n : 2 * n], task.further(run)))
    return [state for state in states if firm.at(energies.state(BEGUN, *state))] or states


def _ranges(mechanism: Mechanism) -> Floats:
    """The smallest and the greatest value of each coordinate, (2, n)."""
    found: Floats = np.reshape([_bounds(c.minimum, c.maximum) for c in mechanism.coordinates], (-1, 2)).T
    return found


def _put(
    task: Task, drives: DriveForces, x: Floats, inputs: Mapping[str, float], bounds: tuple[Floats, Floats]
) -> tuple[Floats, Floats, dict[str, float]]:
    """(q, qd, inputs with further states) of the state ``x`` (2 n + f,), see ``_consistent``."""
    n = len(task.mechanism.coordinates)
    inputs = {**inputs, **dict(zip(task.states[2 * n :], x[2 * n :].tolist(), strict=True))}
    return *_consistent(drives, x[: 2 * n], inputs, bounds), inputs


def _consistent(
    drives: DriveForces, x: Floats, inputs: Mapping[str, float], bounds: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """q and qd, (n,) each, near ``x`` (2 n,) on the constraints; NaN where they cannot be met, or not in ``bounds``."""
    energies, (q, qd) = drives.equations.energies, np.split(x, 2)
    q = np.clip(q, *bounds)
    if energies.constraints.m:
        try:
            q, qd = energies.consistent(q, qd, BEGUN, inputs)
        except SimulationError:
            return np.full_like(q, np.nan), qd
    inside = np.clip(q, *bounds)
    return np.where(np.abs(inside - q) <= _ROUNDING * np.abs(q), inside, np.nan), qd


def _defined(drives: DriveForces, q: Floats, qd: Floats, inputs: Mapping[str, float]) -> bool:
    """Whether q and qd are finite, and the independent equations have finite values there."""
    try:
        return bool(np.isfinite(q).all() and np.isfinite(_calculated(drives, q, qd, inputs)).all())
    except SimulationError:
        return False


def _input_ranges(task: Task, input_names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """{input: (low, high)}, the ranges from which random inputs are drawn.

    A range is that of the signal that drives the run, or lies around the start, within the bounds. A motion is moved by
    half of its start at most, so that the length of a rope, for one, stays positive.
    """
    declared = {u.name: u for u in task.mechanism.inputs}
    found = {}
    filtered = {names.acceleration(name) for name in task.mechanism.filtered}
    without = task.mechanism.hidden_inputs | filtered
    for name in input_names:
        if name in without:
            continue
        given = declared.get(name)
        start = given.start if given is not None else 0.0
        width = (0.5 if given is not None and given.motion else 1.0) * abs(start) or 1.0
        low, high = start - width, start + width
        if task.inputs is not None and name in task.inputs and np.ptp(task.inputs[name]) > 0:
            low, high = float(task.inputs[name].min()), float(task.inputs[name].max())
        if given is not None:
            low, high = _clipped(low, given.minimum, given.maximum), _clipped(high, given.minimum, given.maximum)
        found[name] = low, high
    return found


def _calculated_by_fmu(task: Task, fmu: Evaluation, q: Floats, qd: Floats, values: Mapping[str, float]) -> Floats:
    """The quantities of ``_labels`` from the FMU; ``values`` are those of inputs, further states and parameters."""
    x = dict(enumerate([*q, *qd]))
    states = {task.states[i]: x[i] for i in continuous_states(task.mechanism) if i in x}  # the others follow
    return fmu.evaluate({**states, **values}, _labels(task.mechanism))


def _labels(mechanism: Mechanism) -> list[str]:
    """The names of what is calculated: qdd (n,), p (n,), h, multipliers, drives, rates of z and outputs."""
    coordinates = [c.name for c in mechanism.coordinates]
    wanted = [*map(names.acceleration, coordinates), *map(names.momentum, coordinates), "generalized_energy"]
    wanted += [names.multiplier(c.name) for c in _bearing(mechanism)]
    wanted += map(names.drive, carried(mechanism))
    return [*wanted, *(names.derivative(z.name) for z in mechanism.states), *mechanism.output_names]


def _calculated(drives: DriveForces, q: Floats, qd: Floats, inputs: Mapping[str, float]) -> Floats:
    """The quantities of ``_labels`` from the independent path."""
    at, equations = (BEGUN, q, qd, inputs), drives.equations
    state, constraints = equations.energies.state(*at), equations.mechanism.constraints
    qdd, multipliers = solved = equations.solved(state)
    bearing = _bearing(equations.mechanism)
    forces = [value for c, value in zip(constraints, multipliers, strict=True) if c in bearing]
    found = (qdd, equations.momenta(*at), [equations.generalized_energy(*at)], forces, drives(*at))
    further, outputs = equations.energies.further(state, solved), equations.energies.outputs(state, solved)
    return np.concatenate([*found, further, list(outputs.values())])


def _bearing(mechanism: Mechanism) -> list[Constraint]:
    """The constraints that bear forces: all but norms of quaternions and equilibria of coordinates without mass."""
    norms = norm_constraints(mechanism)
    return [c for c in mechanism.constraints if c.name not in norms and not c.massless]


def _relative(own: Sequence[Floats], independent: Sequence[Floats]) -> Floats:
    """The largest difference of each quantity over all states, relative to its largest value, (k,).

    A quantity that stays below a ten-thousandth of the largest one may be zero up to rounding; its differences are
    relative to this ten-thousandth.
    """
    size = np.abs(independent).max(axis=0)
    size = np.maximum(size, 1e-4 * size.max())
    ratio: Floats = np.abs(np.subtract(own, independent)).max(axis=0) / np.where(size > 0, size, 1.0)
    return ratio


def _sympy_check(task: Task, fmu: Evaluation, reference: Reference, generator: np.random.Generator) -> Check:
    symbolic = sympy_accelerations(task.mechanism)
    declared = {p.name: p.value for p in task.mechanism.parameters if p.value is not None}
    states = _random_states(task, reference, generator, DriveForces(Equations(task.mechanism)))
    own = [_calculated_by_fmu(task, fmu, q, qd, inputs | declared) for q, qd, inputs in states]
    independent = [symbolic(BEGUN, q, qd, inputs) for q, qd, inputs in states]
    moved = [symbolic(BEGUN, (1 + ROUNDING / 100) * q, (1 + ROUNDING / 100) * qd, inputs) for q, qd, inputs in states]
    n = len(task.mechanism.coordinates)
    relative, condition = _relative([x[:n] for x in own], independent), _relative(moved, independent)
    condition = np.maximum(condition, _rounding_of_accelerations(Equations(task.mechanism), reference))
    return _worst("accelerations, SymPy's equations", _labels(task.mechanism)[:n], relative, condition)
