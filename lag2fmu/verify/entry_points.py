"""``simulate``, ``start`` and ``linearize`` for a mechanism, its name or file, or an FMU."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.analysis.at_rest import equations_of, the_equilibrium
from lag2fmu.analysis.linearization import linearize as linearization_of
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.description.names import generalized_force, velocity
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError, ExportError, LoadError, SimulationError, TextError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.fmu.exported import Model, fmu_path, is_fmu
from lag2fmu.fmu.exporting import as_fmu
from lag2fmu.formats.loading import as_mechanism, with_values
from lag2fmu.mechanism.display import tell_of_lengths
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import reached, telling
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.inputs import Inputs, trajectory_of
from lag2fmu.verify.instances import description_of, instance_of
from lag2fmu.verify.plan import check_tolerance, check_values, checked_stop, times_of
from lag2fmu.verify.run import Feedback, Kind, Plan, Run
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.simulate import initialize
from lag2fmu.verify.stepping import Simulation
from lag2fmu.verify.watched_runs import watched

_TOLERANCE = 1e-9
"""The relative tolerance of the run to the state about which the equations are linearized."""
_STEPPABLE = ("2.", "3.")
"""How the versions of FMI begin whose FMUs are stepped."""


@telling("simulating")
def simulate(  # noqa: PLR0913 (the fields of Run)
    model: Model,
    *,
    stop_time: float | None = None,
    step: float | None = None,
    tolerance: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    outputs: Sequence[str] | None = None,
    beside: Sequence[str] = (),
    kind: Kind = "co-simulation",
    solver: str | None = None,
    sample_time: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Run ``model``, a mechanism or an FMU; see ``lag2fmu.simulate``, which takes systems too, for all else.

    Raises Lag2FmuError if the model cannot be loaded, exported or run.
    """
    source = model if is_fmu(model) else as_mechanism(model)
    if isinstance(source, Mechanism):
        checked_stop(source.experiment, stop_time, step)  # before the export, which takes time
    with as_fmu(source, solver) as path:
        times = times_of(path, stop_time, step)
        loop = _feedback(inputs, sample_time, kind)
        signals = trajectory_of(inputs, *times) if loop is None else None
        told = progress or (lambda t: reached(t / times[0]))
        asked = Run(stop_time, step, tolerance, values, signals, hold, outputs, beside, kind, told, feedback=loop)
        found = watched(path, asked, source if isinstance(source, Mechanism) else None)
    if isinstance(source, Mechanism):  # the run has found that values are numbers
        tell_of_lengths(source, values or {})
    return found


def _feedback(inputs: Any, sample_time: float | None, kind: str) -> Feedback | None:
    """The controller in ``inputs``, if there is a ``sample_time`` (s)."""
    if sample_time is None:
        return None
    if not (math.isfinite(sample_time) and sample_time > 0):
        raise LoadError(f"the sample time {sample_time!r} s is not positive and finite; give it in s, such as 1e-3")
    if isinstance(inputs, Mapping) or not callable(inputs):
        raise LoadError(f"with sample_time the inputs are a function of t and y, not a {type(inputs).__name__}")
    if kind != "co-simulation":
        raise LoadError(f"inputs by a function of t and y need co-simulation, not {kind}; leave the kind out")
    return Feedback(inputs, sample_time)


@telling("starting the FMU")
def start(
    model: Model,
    *,
    values: Mapping[str, float] | None = None,
    tolerance: float | None = None,
    start_time: float = 0.0,
    solver: str | None = None,
) -> Simulation:
    """Start ``model``, a mechanism, its name or file, or an FMU of any tool, to be stepped by ``Simulation.step``.

    ``values`` are start values and parameters in SI units, ``tolerance`` the relative one of the FMU's solver,
    ``start_time`` in s. ``solver`` is for a model that is no FMU yet. The simulation is a context that closes itself:
    ``with lag2fmu.start("cart_pole") as sim: sim.step(1e-3, {"F": 2.0}); print(sim.time, sim["theta"])``. FMUs of FMI
    2.0 and 3.0 with co-simulation can be stepped. An FMU of another tool runs in this process: if it crashes, so does
    Python; ``lag2fmu check`` finds such FMUs. Raises Lag2FmuError if the model cannot be loaded, exported or started.
    """
    if not math.isfinite(start_time):
        raise LoadError(f"the start time {start_time!r} s is not finite")
    if tolerance is not None:
        check_tolerance(tolerance)
    with ExitStack() as opened:
        path = opened.enter_context(as_fmu(model, solver))
        description = description_of(path)
        _check_steppable(description, path)
        scalars = scalars_of(description, path)
        check_values(values or {}, scalars)
        instance = opened.enter_context(instance_of(path, "CoSimulation"))
        plan = Plan(np.array([start_time, math.inf]), (), scalars, None, None)
        try:
            initialize(instance, Run(values=values, tolerance=tolerance), plan)
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"'{path}': cannot be initialized: {error}; {instance.log.tail()}") from error
        return Simulation(instance, scalars, start_time).owning(opened.pop_all())
    raise AssertionError  # an ExitStack of these contexts swallows no exception


def _check_steppable(description: Any, path: Path) -> None:
    """Raise LoadError for an FMU that cannot be stepped."""
    if not description.fmiVersion.startswith(_STEPPABLE):
        raise LoadError(f"'{path}': is of FMI {description.fmiVersion}; only FMUs of FMI 2.0 and 3.0 can be stepped")
    if description.coSimulation is None:
        raise LoadError(f"'{path}': offers no co-simulation, which alone can be stepped; export it with co-simulation")


def linearize(
    model: EquationsOfMotion | Mechanism | str | Path,
    at: str | float = "start",
    *,
    values: Mapping[str, float] | None = None,
    **about: Any,
) -> Linearization:
    """The linearization of ``model`` ``at`` its "start", the "equilibrium" found from there, or a time (s) of its run.

    ``values`` are other parameters, starts and generalized forces in SI units. ``about`` are the other arguments of
    ``lag2fmu.analysis.linearize``: q=, qd= (n,) and further= (f,) in SI units and t= (s) instead of ``at``; inputs=
    {name: SI value}; outputs= names of y, by default the outputs of the FMU. The method ``state_space`` of the result
    gives A (k, k), B (k, r), C (o, k), D (o, r) for files and other packages. Contacts, stops, dry frictions and
    latches keep the modes that they have at the state. Raises DerivationError if there is no such state, or if M is
    singular there. Source: J. G. de Jalon, E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems, 1994,
    section 5.3.
    """
    source = model if isinstance(model, EquationsOfMotion) else as_mechanism(model)
    mechanism = source.mechanism if isinstance(source, EquationsOfMotion) else source
    known = {generalized_force(q.name) for q in mechanism.coordinates}
    forces = {name: x for name, x in (values or {}).items() if name in known}
    equations = equations_of(source, {name: x for name, x in (values or {}).items() if name not in known})
    about["inputs"] = forces | (about.get("inputs") or {})
    if about.get("outputs") is None:
        about["outputs"] = _outputs(equations)
    return linearization_of(equations, **{**state_at(equations, at, about.get("inputs")), "within": True, **about})


def _outputs(equations: EquationsOfMotion) -> list[str]:
    """The names of the outputs of the FMU: coordinates, velocities, further states and the user's."""
    m = equations.mechanism
    coordinates = [q.name for q in m.coordinates]
    return [*coordinates, *map(velocity, coordinates), *(z.name for z in m.states), *equations.outputs]


def state_at(equations: EquationsOfMotion, at: str | float, inputs: Any = None) -> dict[str, Any]:
    """The state called ``at``, see ``linearize``, as the arguments of ``lag2fmu.analysis.linearize``.

    These are q, qd (n,) and further (f,) in SI units, and t (s). Raises DerivationError for a word that names no state,
    and if there is no equilibrium.
    """
    if at == "start":
        return {}
    if at == "equilibrium":
        found = the_equilibrium(equations, inputs)
        return {"q": found.q, "qd": np.zeros_like(found.q), "further": found.further}
    try:
        time = float(at)
    except ValueError:
        time = np.nan
    if not 0 <= time < np.inf:
        raise DerivationError(f"cannot linearize at '{at}'; give 'start', 'equilibrium' or a time in s, not negative")
    return _reached(equations, time, inputs) if time > 0 else {}


def _reached(equations: EquationsOfMotion, time: float, inputs: Any) -> dict[str, Any]:
    """The state that the FMU reaches at ``time``, with constant inputs."""
    mechanism = equations.mechanism
    coordinates = [q.name for q in mechanism.coordinates]
    further = [z.name for z in mechanism.states]
    rates = [velocity(x) for x in coordinates]
    run = simulate(
        mechanism,
        stop_time=time,
        step=time,
        tolerance=_TOLERANCE,
        values=inputs,
        outputs=[*coordinates, *rates, *further],
    )
    q, qd, z = (np.array([run[x][-1] for x in group]) for group in (coordinates, rates, further))
    return {"q": q, "qd": qd, "further": z, "t": time}


def mechanism_of(model: Model, values: Mapping[str, float] | None = None) -> Mechanism | None:
    """The mechanism of ``model`` with ``values`` (SI) of its parameters and starts; None for an FMU of another tool.

    Raises LoadError for an unknown model or value.
    """
    if not is_fmu(model):
        return as_mechanism(model, values)
    try:
        mechanism = read_mechanism(fmu_path(model))
    except (ExportError, TextError):  # an FMU of another tool, or a text that this version cannot read
        return None
    known = {s for q in mechanism.coordinates for s in (q.name, velocity(q.name))}
    known |= {p.name for p in mechanism.parameters} | {u.name for u in mechanism.inputs}
    known |= {z.name for z in mechanism.states}
    return with_values(mechanism, {name: value for name, value in (values or {}).items() if name in known})
