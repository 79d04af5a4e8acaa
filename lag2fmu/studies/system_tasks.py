"""The task of a sweep of a system of FMUs, checked before any run is made."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import Unit
from lag2fmu.studies.design import Design, SweepTask
from lag2fmu.studies.tasks import Wanted, declared_unit, times_of_runs
from lag2fmu.systems.network import Network, network_of_file
from lag2fmu.systems.recording import end_of, outputs_of
from lag2fmu.systems.running import start_values, times_of_network


def task_of_system(path: Path, design: Design, wanted: Wanted) -> tuple[SweepTask, dict[str, Unit | None], str]:
    """The task for the system ``path``, the units that its FMUs declare, and a title.

    Raises LoadError for a solver, because the FMUs have their own, and for names that the system does not have.
    """
    if wanted.solver is not None:
        raise LoadError(f"the FMUs of '{path.name}' have their solvers inside; leave the solver out")
    whole = path.resolve()
    with network_of_file(whole) as network:
        start, stop, step = times_of_network(network, wanted.run.stop_time, None)
        if start:
            raise LoadError(f"'{path.name}' starts at {start:g} s; a sweep starts at 0 s")
        times = times_of_runs(wanted, stop)
        start_values(network, {**(wanted.run.values or {}), **dict.fromkeys(design.names, 0.0)})
        for name in wanted.run.outputs or ():
            _check_output(network, name)
        inside = [str(c.path) for c in network.components.values()] if whole.suffix == ".ssd" else []
        task = SweepTask(
            model=str(whole),
            kind="system",
            names=design.names,
            times=times,
            run=wanted.common(times, step, tuple(outputs_of(network))),
            files=(str(whole), *inside),
        )
        return task, _units(network), network.name


def _check_output(network: Network, name: str) -> None:
    """Raise LoadError for the name of no output of the system and no number of a component."""
    if name in network.outputs:
        return
    end = end_of(name, network)
    component = network.components[end.component]
    known = component.connectors
    if component.controller is None and end.connector not in known and end.connector.partition("[")[0] not in known:
        raise LoadError(
            f"the component '{end.component}' has no number '{end.connector}'; {suggestion(end.connector, known)}"
        )


def _units(network: Network) -> dict[str, Unit | None]:
    """{COMPONENT.VARIABLE: the unit that the FMU declares}."""
    return {
        f"{name}.{c.name}": declared_unit(c.unit.name if c.unit else None)
        for name, component in network.components.items()
        for c in component.connectors.values()
    }
