"""What the run of a system records: outputs of the system and variables of its components."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.connections import End
from lag2fmu.systems.member import Member
from lag2fmu.systems.network import Network
from lag2fmu.systems.wires import SAME, Transformation
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.run import Floats, Run


def end_of(word: str, network: Network) -> End:
    """The component and the variable in COMPONENT.VARIABLE; names of components may have points themselves.

    Raises LoadError for a name that begins with that of no component.
    """
    fitting = [name for name in network.components if word.startswith(f"{name}.")]
    if not fitting:
        names = ", ".join(network.components)
        raise LoadError(f"'{word}' is no variable of a component; write COMPONENT.VARIABLE, components are {names}")
    name = max(fitting, key=len)
    return End(name, word[len(name) + 1 :])


class Recorder:
    """What is recorded: names, and how their values are read."""

    def __init__(self, network: Network, members: Mapping[str, Member], run: Run) -> None:
        chosen = [*(outputs_of(network) if run.outputs is None else run.outputs), *run.beside]
        self.names: list[str] = []
        self._reads: list[tuple[str, Channel, Transformation]] = []
        for word in dict.fromkeys(chosen):
            end, map_ = network.outputs.get(word) or (end_of(word, network), SAME)
            for scalar in members[end.component].elements(end.connector):
                whole = scalar.name == end.connector or word in network.outputs
                self.names.append(word if whole else f"{end.component}.{scalar.name}")
                self._reads.append((end.component, members[end.component].channel([scalar.name]), map_))
        self._together = {
            name: members[name].channel([c.scalars[0].name for owner, c, _ in self._reads if owner == name])
            for name in {owner for owner, _, _ in self._reads}
        }

    def row(self) -> Floats:
        """The present values (names,). Raises SimulationError, which names the component, for one that is no number."""
        found = {name: iter(channel.read()) for name, channel in self._together.items()}
        values = np.array([map_(float(next(found[owner]))) for owner, _, map_ in self._reads])
        if not np.isfinite(values).all():
            i = int(np.argmin(np.isfinite(values)))
            raise SimulationError(
                f"the component '{self._reads[i][0]}' gives {values[i]:g} for '{self.names[i]}'; where steps are too "
                "long for a connection, values grow beyond all bounds: try a shorter --step"
            )
        return values


class Kept:
    """What a run has recorded until now. It is in the process that asked, whatever becomes of the one that runs."""

    def __init__(self, progress: Callable[[float], None]) -> None:
        """``progress`` is told the time (s) of each row."""
        self._progress = progress
        self._names: Sequence[str] = ()
        self._times: list[float] = []
        self._rows: list[Sequence[float]] = []

    def __call__(self, names: Sequence[str], t: float, row: Sequence[float]) -> None:
        """Keep the ``row`` (names,) of the time ``t`` (s)."""
        self._names = names
        self._times.append(t)
        self._rows.append(row)
        self._progress(t)

    def add_to(self, error: SimulationError) -> None:
        """Let the ``error``, which has ended the run, bear what was recorded until then."""
        if self._times:
            error.args = (f"{error}; what was recorded until t = {self._times[-1]:g} s is kept",)
            error.reached = Trajectory(np.array(self._times), tuple(self._names), np.array(self._rows))


def outputs_of(network: Network) -> list[str]:
    """The names of the outputs of the system, and of those of its components."""
    own = [
        f"{name}.{c.name}"
        for name, component in network.components.items()
        for c in component.connectors.values()
        if c.causality == "output"
    ]
    return [*network.outputs, *own]
