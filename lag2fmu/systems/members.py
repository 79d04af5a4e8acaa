"""The components of a network, ready for a run: FMUs instantiated, Python functions at hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial

from lag2fmu.errors import SimulationError
from lag2fmu.systems.clocked import ClockedFmu
from lag2fmu.systems.fmu_member import FmuMember, fmu_member_of
from lag2fmu.systems.fmu_process import Apart, patience_of
from lag2fmu.systems.member import Member
from lag2fmu.systems.network import Network
from lag2fmu.systems.sampled_function import SampledFunction


@contextmanager
def members_of(
    network: Network, begin: Callable[[str], None], *, hold: bool, apart: Apart
) -> Iterator[dict[str, Member]]:
    """{name: member} of all components; ``begin`` gets the name of each before it is called.

    With ``hold`` no input changes within a step; ``apart``: see there. Raises LoadError for clocks that do not run,
    SimulationError for an FMU that cannot be instantiated.
    """
    with ExitStack() as opened:
        members: dict[str, Member] = {}
        for name, component in network.components.items():
            if component.controller is not None:
                called = partial(begin, name)
                members[name] = SampledFunction(component, component.controller, called, patience_of(apart))
                continue
            driven = [*_driven(network, name, hold=hold)]
            kind = ClockedFmu if component.clocks else FmuMember
            try:
                member = fmu_member_of(component, driven, partial(begin, name), kind, apart=apart)
                members[name] = opened.enter_context(member)
            except SimulationError as error:
                raise SimulationError(f"the component '{name}': {error}") from error
        yield members


def _driven(network: Network, name: str, *, hold: bool) -> Iterator[str]:
    """The inputs of a component that change within steps: connected ones, unless they are held, and those of joints."""
    if not hold:
        yield from (wire.target.connector for wire in network.wires if wire.target.component == name)
    for ends in network.joints:
        yield from ends.inputs(name)
