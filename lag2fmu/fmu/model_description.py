"""The records of a model description for every version of FMI; the writers of ``versions`` turn them into XML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.codegen.tables import StepBound
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.mechanism.record import Mechanism

if TYPE_CHECKING:
    from lag2fmu.fmu.ports import Port


class Interface(NamedTuple):
    """The capabilities of FMUs of a backend: {kind of FMU: attributes}, beside the attributes that all FMUs have.

    ``log_categories`` {name: description}; ``event_indicators``: their number, None where the attribute is left out.
    """

    capabilities: Mapping[str, Mapping[str, str]]
    log_categories: Mapping[str, str]
    event_indicators: int | None = None


class ModelDescription(NamedTuple):
    """The content of modelDescription.xml: the mechanism, its variables in order, the identifier and the GUID.

    ``fmi`` is the version of the standard, ``version`` that of lag2fmu. ``source_files`` are the names of the files in
    sources/ that have to be compiled. ``ports`` are the variables of FMI 3.0; a value reference is an index among them.
    ``bound`` is that of a communication step in real time.
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
    bound: StepBound | None = None


def heeds_steps(description: ModelDescription) -> bool:
    """Whether an FMU in model exchange has to hear of the importer's steps.

    There are six reasons. What event functions are beside 0 at an event is forgotten after the next step. An event
    brings states back that drift off the constraints beyond the importer's tolerance. Singular positions are passed
    with the accelerations of the last step. The FMU gives notice of coordinates that leave their ranges, and of motions
    that are moved without velocities. A force of friction that becomes negative ends the run.
    """
    mechanism = description.mechanism
    bounded = any(c.minimum is not None or c.maximum is not None for c in mechanism.coordinates)
    return bool(mechanism.constraints or mechanism.motions or description.interface.event_indicators) or bounded
