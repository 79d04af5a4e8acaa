"""Runs of systems: FMUs of any tool, side by side from one communication point to the next.

At each point all inputs are brought to what they hear. Within a step they go on by derivatives of the outputs, where
both sides offer that; else they are held. Source of the orders: M. Arnold, C. Clauss, T. Schierz, Error analysis and
error estimates for co-simulation in FMI for Model Exchange and Co-Simulation v2.0, Archive of Mechanical Engineering 60
(2013), section 4.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from multiprocessing.sharedctypes import RawValue
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.progress import reached, telling
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.connections import End
from lag2fmu.systems.joint_steps import JoinedSteps
from lag2fmu.systems.joint_system import JointSystem
from lag2fmu.systems.member import Member, member_of
from lag2fmu.systems.network import Network, network_of
from lag2fmu.systems.steps import ControlledSteps, FixedSteps
from lag2fmu.systems.wires import SAME, Affine
from lag2fmu.verify.apart import FORKS, run_apart
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.inputs import trajectory_of
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.plan import POINTS, check_times, check_tolerance
from lag2fmu.verify.run import Floats, Run

_LOGGER = logging.getLogger("lag2fmu")
_TOLERANCE = 1e-6
"""The relative tolerance of the coupling, where none is given: that of the FMUs of lag2fmu."""


@telling("simulating")
def simulate_system(path: Path, **choices: Any) -> Trajectory:
    """Run the system ``path``, an .ssp or .ssd, by co-simulation; see ``lag2fmu.simulate`` for the ``choices``.

    Columns are called COMPONENT.VARIABLE, or as an output of the system; by default all outputs are recorded, in the
    units of the FMUs. ``values`` are {COMPONENT.VARIABLE: value} in these units, ``inputs`` those of the system.
    Without ``stop_time`` and ``step`` (s) the default experiments of the system and of its FMUs tell them. Raises
    LoadError for what does not fit, SimulationError with the name of the FMU that fails. ``share`` is told the part of
    the run that is done, 0 to 1, ``progress`` the time.
    """
    if choices.pop("kind", "co-simulation") != "co-simulation":
        raise LoadError(f"'{path}': a system runs by co-simulation alone; leave the kind out")
    stop, step, inputs = (choices.pop(name, None) for name in ("stop_time", "step", "inputs"))
    told, share = choices.pop("progress", None), choices.pop("share", None) or reached
    controlled = step is None
    with network_of(path) as network:
        start, stop, step = _times(network, stop, step)
        run = Run(
            stop_time=stop, step=step, inputs=trajectory_of(inputs, stop, step), start_time=start,
            progress=told or (lambda t: share((t - start) / (stop - start))), warned=_LOGGER.warning, **choices,
        )  # fmt: skip

        names = [*network.components]
        called = RawValue("i", -1)  # the number of the component that is called, which a crash leaves behind

        def here(_: Path, asked: Run) -> Trajectory:
            return _run(network, asked, lambda name: setattr(called, "value", names.index(name)), controlled=controlled)

        def last() -> str:
            return f"the component '{names[called.value]}'" if called.value >= 0 else ""

        return run_apart(path, run, here, last) if FORKS else here(path, run)


def _times(network: Network, stop: float | None, step: float | None) -> tuple[float, float, float]:
    """Start, stop and communication step (s): as given, else of the system's experiment, else of those of its FMUs."""
    start = network.start_time
    if stop is None:
        stops = [component.stop_time or 0.0 for component in network.components.values()]
        stop = network.stop_time or max(stops, default=0.0) or start + 1.0
    if step is None:
        experiments = [description_of(c.path).defaultExperiment for c in network.components.values()]
        steps = [float(e.stepSize) for e in experiments if e is not None and e.stepSize]
        step = min([(stop - start) / POINTS, *steps])
    if not stop > start:
        raise LoadError(
            f"the stop time {stop:g} s is not after the start time {start:g} s of the system; give a later one"
        )
    check_times(stop - start, step)
    return start, stop, step


def _run(network: Network, run: Run, begin: Callable[[str], None], *, controlled: bool) -> Trajectory:
    """The run of the ``network`` in this process; ``begin`` gets the name of each component before it is called.

    With ``controlled`` the error of the coupling chooses the steps, if the FMUs offer what that takes.
    """
    if run.tolerance is not None:
        check_tolerance(run.tolerance)
    values = _values(network, run.values or {})
    outer = _Outer(network, run.inputs)
    with ExitStack() as opened:
        members: dict[str, Member] = {}
        for name, component in network.components.items():
            driven = [*_driven(network, name, hold=run.hold)]
            try:
                members[name] = opened.enter_context(member_of(component, driven, partial(begin, name)))
            except SimulationError as error:
                raise SimulationError(f"the component '{name}': {error}") from error
        recorder = _Recorder(network, members, run)
        _initialize(network, members, values, outer, run)
        steps = _steps_of(network, members, outer, run, controlled=controlled)
        return _steps(steps, members, recorder, run)


def _driven(network: Network, name: str, *, hold: bool) -> Iterator[str]:
    """The inputs of a component that change within steps: connected ones, unless they are held, and those of joints."""
    if not hold:
        yield from (wire.target.connector for wire in network.wires if wire.target.component == name)
    for ends in network.joints:
        yield from ends.inputs(name)


def _steps_of(
    network: Network, members: Mapping[str, Member], outer: _Outer, run: Run, *, controlled: bool
) -> FixedSteps:
    """The steps: repeated for joints; else as long as the error allows, if that is known; else of one length."""
    circuit, step = Circuit(members, network.wires), float(run.step or 0.0)
    if network.joints:
        joints = JointSystem(members, network.joints)
        return JoinedSteps(members, circuit, outer.at, joints, step=step, hold=run.hold)
    if controlled and circuit.order > 0 and not run.hold and all(m.repeats for m in members.values()):
        tolerance = _TOLERANCE if run.tolerance is None else run.tolerance
        return ControlledSteps(members, circuit, outer.at, tolerance, step)
    return FixedSteps(members, circuit, outer.at, hold=run.hold)


def _values(network: Network, given: Mapping[str, float]) -> dict[str, dict[str, float | str]]:
    """{component: {variable: value}}: those of the description, and then those ``given`` by the user."""
    found: dict[str, dict[str, float | str]] = {name: {} for name in network.components}
    for end, value in network.values.items():
        found[end.component][end.connector] = value
    for word, value in given.items():
        end = _end_of(word, network)
        known = network.components[end.component].connectors
        if end.connector not in known or not known[end.connector].settable:
            free = [name for name, c in known.items() if c.settable]
            raise LoadError(f"'{word}' cannot be set; {suggestion(end.connector, free)}")
        if not math.isfinite(value):
            raise LoadError(f"{word} = {value!r} is not finite")
        found[end.component][end.connector] = value
    return found


def _end_of(word: str, network: Network) -> End:
    """The component and the variable in COMPONENT.VARIABLE; names of components may have points themselves."""
    fitting = [name for name in network.components if word.startswith(f"{name}.")]
    if not fitting:
        names = ", ".join(network.components)
        raise LoadError(f"'{word}' is no variable of a component; write COMPONENT.VARIABLE, components are {names}")
    name = max(fitting, key=len)
    return End(name, word[len(name) + 1 :])


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


class _Recorder:
    """What is recorded: names, and how their values are read."""

    def __init__(self, network: Network, members: Mapping[str, Member], run: Run) -> None:
        chosen = [*(_recorded(network) if run.outputs is None else run.outputs), *run.beside]
        self.names: list[str] = []
        self._reads: list[tuple[str, Channel, Affine]] = []
        for word in dict.fromkeys(chosen):
            end, map_ = network.outputs.get(word) or (_end_of(word, network), SAME)
            for scalar in members[end.component].elements(end.connector):
                whole = scalar.name == end.connector or word in network.outputs
                self.names.append(word if whole else f"{end.component}.{scalar.name}")
                self._reads.append((end.component, members[end.component].channel([scalar.name]), map_))
        self._together = {
            name: members[name].channel([c.scalars[0].name for owner, c, _ in self._reads if owner == name])
            for name in {owner for owner, _, _ in self._reads}
        }

    def row(self) -> Floats:
        """The present values."""
        found = {name: iter(channel.read()) for name, channel in self._together.items()}
        return np.array([map_(float(next(found[owner]))) for owner, _, map_ in self._reads])


def _recorded(network: Network) -> list[str]:
    """The outputs of the system, and those of its components."""
    own = [
        f"{name}.{c.name}"
        for name, component in network.components.items()
        for c in component.connectors.values()
        if c.causality == "output"
    ]
    return [*network.outputs, *own]


def _initialize(
    network: Network,
    members: Mapping[str, Member],
    values: Mapping[str, Mapping[str, float | str]],
    outer: _Outer,
    run: Run,
) -> None:
    """Initialize all FMUs, their inputs in agreement with what they hear."""
    span = run.start_time, float(run.stop_time or 0.0)
    for name, member in members.items():
        with member.telling("while it is initialized"):
            member.initialize(values[name], run.tolerance, span)
    circuit = Circuit(members, network.wires)
    circuit.hear(outer.at(span[0]))
    circuit.settle(span[0])
    for member in members.values():
        member.fmu.exitInitializationMode()


def _steps(steps: FixedSteps, members: Mapping[str, Member], recorder: _Recorder, run: Run) -> Trajectory:
    """The run from one point that is recorded to the next."""
    start, stop, step = run.start_time, float(run.stop_time or 0.0), float(run.step or 0.0)
    count = math.ceil((stop - start) / step * (1 - 1e-9))
    times = start + np.minimum(step * np.arange(count + 1), stop - start)
    values, done = np.empty((count + 1, len(recorder.names))), 0
    try:
        steps.begin(start)
        for i, t in enumerate(times.tolist()):
            values[i], done = recorder.row(), i + 1
            if run.progress is not None:
                run.progress(t)
            if i < count:
                steps.advance(t, float(times[i + 1]))
    except SimulationError as error:
        if done:
            error.reached = Trajectory(times[:done], tuple(recorder.names), values[:done])
        raise
    for member in members.values():
        for sentence in member.instance.log.warnings:
            if run.warned is not None:
                run.warned(f"the component '{member.name}': {sentence}")
    return Trajectory(times, tuple(recorder.names), values)
