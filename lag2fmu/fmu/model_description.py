"""What an FMU says of itself, for every version of FMI: the records that the writers of ``versions`` turn into XML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lag2fmu.fmu.ports import Port
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Interface:
    """What an FMU of a backend offers: ``capabilities`` {kind of FMU: attributes} beside those that all have.

    ``log_categories`` {name: description}; ``event_indicators``: their number, None where the attribute is left out.
    """

    capabilities: Mapping[str, Mapping[str, str]]
    log_categories: Mapping[str, str]
    event_indicators: int | None = None


@dataclass(frozen=True)
class ModelDescription:
    """What modelDescription.xml says: the mechanism, its variables in order, the identifier and the GUID.

    ``fmi`` is the version of the standard, ``version`` that of lag2fmu.
    ``source_files`` are the names of the files in sources/ that have to be compiled; ``ports`` are what value
    references stand for since FMI 3.0.
    """

    mechanism: Mechanism
    variables: tuple[ScalarVariable, ...]
    model_identifier: str
    guid: str
    solver: str
    version: str
    interface: Interface
    source_files: tuple[str, ...] = ()
    ports: tuple[Port, ...] = ()
    fmi: str = "2.0"


def heeds_steps(mechanism: Mechanism) -> bool:
    """Whether an FMU in model exchange has to hear of the importer's steps.

    What drifts off the constraints beyond the importer's tolerance is brought back by an event, and singular positions
    are passed with what was known at the last step. Ranges that are left and motions without velocities are noticed.
    """
    bounded = any(c.minimum is not None or c.maximum is not None for c in mechanism.coordinates)
    return bool(mechanism.constraints or mechanism.motions) or bounded
