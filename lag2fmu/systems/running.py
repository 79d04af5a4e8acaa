"""Runs of systems: FMUs of any tool, side by side from one communication point to the next.

At each point all inputs are brought to what they hear. Within a step they go on by derivatives of the outputs, where
both sides offer that; else they are held. Source of the orders: M. Arnold, C. Clauss, T. Schierz, Error analysis and
error estimates for co-simulation in FMI for Model Exchange and Co-Simulation v2.0, Archive of Mechanical Engineering 60
(2013), section 4.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from multiprocessing.sharedctypes import RawValue
from pathlib import Path
from typing import cast, get_args

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.progress import reached
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.bonds import bonds_of
from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.coupling import Coupling, SystemRun
from lag2fmu.systems.fmu_process import Apart, patience_of
from lag2fmu.systems.joint_steps import JoinedSteps
from lag2fmu.systems.joint_system import JointSystem
from lag2fmu.systems.ledger import Ledger
from lag2fmu.systems.member import Member
from lag2fmu.systems.members import members_of
from lag2fmu.systems.network import Network
from lag2fmu.systems.recording import Kept, Recorder, end_of
from lag2fmu.systems.sampling import Sampling
from lag2fmu.systems.steps import ControlledSteps, FixedSteps, IteratedSteps
from lag2fmu.verify.apart import FORKS, run_apart
from lag2fmu.verify.inputs import Inputs, trajectory_of
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.plan import POINTS, check_times, check_tolerance
from lag2fmu.verify.run import Run

_LOGGER = logging.getLogger("lag2fmu")
_TOLERANCE = 1e-6
"""The relative tolerance of the coupling, where none is given: that of the FMUs of lag2fmu."""
_DEFAULTS = Run()


def simulate_system(
    network: Network,
    run: Run = _DEFAULTS,
    inputs: Inputs | None = None,
    share: Callable[[float], None] = reached,
    *,
    apart: Apart = False,
    coupling: Coupling = "jacobi",
) -> SystemRun:
    """Run the system ``network`` by co-simulation.

    Columns are called COMPONENT.VARIABLE, or as an output of the system; by default all outputs are recorded, in the
    units of the FMUs. The ``values`` of the ``run`` are {COMPONENT.VARIABLE: value} in these units, ``inputs`` those of
    the system. Without stop time and step the default experiments of the system and of its FMUs tell them. Raises
    LoadError for what does not fit, SimulationError with the name of the component that fails. ``share`` is told the
    part of the run that is done, 0 to 1; ``apart``: each FMU has a process of its own, a number is the longest time (s)
    of a call there, an executor gives each a worker. ``coupling``: how the components make a step.
    """
    if coupling not in get_args(Coupling):
        raise LoadError(f"'{network.name}': coupling {coupling!r} is none; write jacobi, gauss-seidel or iterated")
    patience = patience_of(apart)
    if patience is not None and not 0.0 < patience < math.inf:
        raise LoadError(f"'{network.name}': the patience of {patience!r} s with a call is none; give a positive time")
    if run.kind != "co-simulation":
        raise LoadError(f"'{network.name}': a system runs by co-simulation alone; leave the kind out")
    start, stop, step = times_of_network(network, run.stop_time, run.step)
    kept = Kept(run.progress or (lambda t: share((t - start) / (stop - start))))
    asked = replace(
        run, stop_time=stop, step=step, start_time=start, inputs=trajectory_of(inputs, stop, step), progress=None,
        warned=run.warned or _LOGGER.warning, recorded=kept,
    )  # fmt: skip
    names, controlled = [*network.components], run.step is None
    called = RawValue("i", -1)  # the number of the component that is called, which a crash leaves behind
    numbers = {name: i for i, name in enumerate(names)}

    def here(_: Path, asked: Run) -> SystemRun:
        def begin(name: str) -> None:
            called.value = numbers[name]

        return _run(network, asked, begin, controlled=controlled, apart=apart, coupling=coupling)

    def last() -> str:
        return f"the component '{names[called.value]}'" if called.value >= 0 else ""

    try:
        forks = FORKS and not isinstance(apart, Executor)  # whose threads are in this process
        return cast("SystemRun", run_apart(Path(network.name), asked, here, last)) if forks else here(Path(), asked)
    except SimulationError as error:
        kept.add_to(error)
        raise


def times_of_network(network: Network, stop: float | None, step: float | None) -> tuple[float, float, float]:
    """Start, stop and communication step (s): as given, else as the system's file tells, else as those of its FMUs do.

    Raises LoadError for times that no run has.
    """
    start = network.start_time
    if stop is None:
        stops = [component.stop_time or 0.0 for component in network.components.values()]
        stop = network.stop_time or max(stops, default=0.0) or start + 1.0
    if step is None:
        experiments = [
            description_of(c.path).defaultExperiment for c in network.components.values() if not c.controller
        ]
        steps = [float(e.stepSize) for e in experiments if e is not None and e.stepSize]
        step = min([(stop - start) / POINTS, *steps]) if network.step is None else network.step
    if not stop > start:
        raise LoadError(
            f"the stop time {stop:g} s is not after the start time {start:g} s of the system; give a later one"
        )
    check_times(stop - start, step)
    return start, stop, step


def _run(
    network: Network, run: Run, begin: Callable[[str], None], *, controlled: bool, apart: Apart, coupling: Coupling
) -> SystemRun:
    """The run of the ``network`` in this process; ``begin`` gets the name of each component before it is called.

    With ``controlled`` the error of the coupling chooses the steps, if the FMUs offer what that takes.
    """
    if run.tolerance is not None:
        check_tolerance(run.tolerance)
    values = start_values(network, run.values or {})
    outer = _Outer(network, run.inputs)
    with members_of(network, begin, hold=run.hold, apart=apart) as members:
        recorder = Recorder(network, members, run)
        sampling = Sampling(members, network.wires)
        _initialize(network, members, values, outer, sampling, run)
        steps, unjudged = _steps_of(network, members, outer, run, coupling, controlled=controlled)
        found = _steps(steps, sampling, members, recorder, run)
        return SystemRun(found.time, found.names, found.values, steps.facts(unjudged))


def _steps_of(
    network: Network,
    members: Mapping[str, Member],
    outer: _Outer,
    run: Run,
    coupling: Coupling,
    *,
    controlled: bool,
) -> tuple[FixedSteps | ControlledSteps, tuple[str, ...]]:
    """(the steps, what they do not judge): repeated for joints, or until inputs agree; else as the error allows.

    Raises LoadError where the ``coupling`` cannot be had.
    """
    circuit, step = Circuit(members, network.wires), float(run.step or 0.0)
    pairs, unjudged = bonds_of(network)
    tolerance = run.tolerance or _TOLERANCE
    if coupling != "jacobi":
        _check_coupling(network, members, circuit, coupling, hold=run.hold)
    if network.joints:
        beside = [f"the energy of {p.effort.source} to {p.effort.target}: it goes beside joints" for p in pairs]
        joined, fixed = _joined_steps_of(network, members, circuit, outer, run, controlled=controlled)
        return joined, (*beside, *fixed, *unjudged)
    hold = run.hold or circuit.sampled
    ledger = Ledger(members, circuit.inputs, pairs, hold=hold)
    if coupling == "iterated":
        beside = ["the length of the steps: inputs agree at the ends of iterated steps; halve --step and compare"]
        return IteratedSteps(members, circuit, outer.at, ledger, tolerance), (*beside, *unjudged)
    fixed = _fixed(circuit, members, hold=hold) if controlled and not circuit.sampled else []
    if controlled and not hold and not fixed:
        steps = FixedSteps(members, circuit, outer.at, ledger, hold=False, coupling=coupling)
        return ControlledSteps(steps, tolerance, step), tuple(unjudged)
    return FixedSteps(members, circuit, outer.at, ledger, hold=hold, coupling=coupling), (*fixed, *unjudged)


def _joined_steps_of(
    network: Network, members: Mapping[str, Member], circuit: Circuit, outer: _Outer, run: Run, *, controlled: bool
) -> tuple[ControlledSteps, list[str]]:
    """(the steps of a system with joints, why not their error but only joints that do not close shorten them)."""
    step = float(run.step or 0.0)
    steps = JoinedSteps(members, circuit, outer.at, JointSystem(members, network.joints), step=step, hold=run.hold)
    fixed = _fixed(circuit, members, hold=run.hold) if controlled and circuit.inputs else []
    return ControlledSteps(steps, (run.tolerance or _TOLERANCE) if controlled and not fixed else math.inf, step), fixed


def _check_coupling(
    network: Network, members: Mapping[str, Member], circuit: Circuit, coupling: Coupling, *, hold: bool
) -> None:
    """Raise LoadError where components cannot make steps by this ``coupling``."""
    once = [f"'{name}'" for name, member in members.items() if not member.repeats]
    why = ""
    if network.joints:
        why = "joints repeat steps in a way of their own"
    elif coupling == "iterated" and (hold or circuit.sampled):
        why = "no input changes within steps"
    elif coupling == "iterated" and once:
        why = f"{', '.join(once)} cannot go back to a state before"
    if why:
        raise LoadError(f"'{network.name}': coupling {coupling} is not possible: {why}; leave it out")


def _fixed(circuit: Circuit, members: Mapping[str, Member], *, hold: bool) -> list[str]:
    """Why the error of the coupling does not choose the steps, as a sentence; none if it does."""
    held = [f"'{name}'" for name in circuit.held()]
    once = [f"'{name}'" for name, member in members.items() if not member.repeats]
    why = []
    if hold:
        why.append("inputs are held within steps")
    elif held:
        why.append(f"inputs of {', '.join(held)} are held within steps")
    if once:
        why.append(f"{', '.join(once)} cannot go back to a state before")
    return [f"the length of the steps: {' and '.join(why)}; halve --step and compare"] if why else []


def start_values(network: Network, given: Mapping[str, float]) -> dict[str, dict[str, float | str]]:
    """{component: {variable: value}}: those of the description, and then those ``given`` by the user.

    Raises LoadError for a name that is none, or whose variable cannot be set.
    """
    found: dict[str, dict[str, float | str]] = {name: {} for name in network.components}
    for end, value in network.values.items():
        found[end.component][end.connector] = value
    for word, value in given.items():
        end = end_of(word, network)
        known = network.components[end.component].connectors
        if end.connector not in known or not known[end.connector].settable:
            free = [name for name, c in known.items() if c.settable]
            raise LoadError(f"'{word}' cannot be set; {suggestion(end.connector, free)}")
        if not math.isfinite(value):
            raise LoadError(f"{word} = {value!r} is not finite")
        found[end.component][end.connector] = value
    return found


class _Outer:
    """The inputs of the system over time."""

    def __init__(self, network: Network, signals: Trajectory | None) -> None:
        known = network.inputs
        for name in signals or ():
            if name not in known:
                listed = ", ".join(known) or "none"
                raise LoadError(f"the system has no input '{name}'; there are {listed}")
        self.names = tuple(name for name in known if name in (signals or ()))
        self._signals = signals

    def at(self, t: float) -> dict[str, float]:
        """The values at ``t`` (s), linear between the signals' times and constant beyond."""
        signals = self._signals
        return {} if signals is None else {n: float(np.interp(t, signals.time, signals[n])) for n in self.names}


def _initialize(
    network: Network,
    members: Mapping[str, Member],
    values: Mapping[str, Mapping[str, float | str]],
    outer: _Outer,
    sampling: Sampling,
    run: Run,
) -> None:
    """Initialize all components, their inputs in agreement with what they hear. What samples does so at the start."""
    span = run.start_time, float(run.stop_time or 0.0)
    for name, member in members.items():
        with member.telling("while it is initialized"):
            member.initialize(values[name], run.tolerance, span)
    circuit = Circuit(members, network.wires, initial=True)
    circuit.hear(outer.at(span[0]))
    circuit.settle(span[0])
    sampling.initially(span[0], circuit)
    for member in members.values():
        member.exit_initialization()


def _steps(
    steps: FixedSteps | ControlledSteps, sampling: Sampling, members: Mapping[str, Member], recorder: Recorder, run: Run
) -> Trajectory:
    """The run from one point that is recorded to the next."""
    start, stop, step = run.start_time, float(run.stop_time or 0.0), float(run.step or 0.0)
    count = math.ceil((stop - start) / step * (1 - 1e-9))
    times = start + np.minimum(step * np.arange(count + 1), stop - start)
    names, values = tuple(recorder.names), np.empty((count + 1, len(recorder.names)))
    steps.begin(start)
    sampling.at(start, steps.circuit)
    for i, t in enumerate(times.tolist()):
        values[i] = recorder.row()
        if run.recorded is not None:
            run.recorded(names, t, values[i].tolist())  # lists travel five times faster than arrays
        for begin, end, near in sampling.ends(t, float(times[i + 1])) if i < count else ():
            steps.advance(begin, end)
            sampling.at(end, steps.circuit, near)
    for member in members.values():
        for sentence in dict.fromkeys(member.warnings):
            if run.warned is not None:
                run.warned(f"the component '{member.name}': {sentence}")
    return Trajectory(times, names, values)
