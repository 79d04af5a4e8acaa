"""The state of a running FMU, and its saved form: bytes that another process restores bit for bit."""

from __future__ import annotations

import hashlib
import struct
from copy import deepcopy
from dataclasses import dataclass, field
from math import inf

from .model import INPUT, PARAMETER, SETTING, STATE, Model

MODES = ("instantiated", "initialization mode", "step complete", "step failed", "terminated", "error")
INSTANTIATED, INITIALIZATION, STEP_COMPLETE, STEP_FAILED, TERMINATED, ERROR = MODES

_MAGIC = b"lag2fmu python 1"
_NUMBERS = ("time", "start_time", "stop_time", "tolerance", "next_step", "previous_error")
_VECTORS = ("states", "inputs", "parameters", "settings", "first_stage")


@dataclass
class State:
    """All that fmi2GetFMUstate saves; what else an instance holds is computed from it again.

    Times and steps are in s; ``tolerance`` is that of fmi2SetupExperiment, 0 if it gave none; ``next_step`` is the
    proposal of the solver, 0 before its first step; ``previous_error`` is the memory of its step size control;
    ``first_stage`` is dx/dt at the present point, empty while it is not known.
    """

    states: list[float]
    inputs: list[float]
    parameters: list[float]
    settings: list[float]
    mode: str = INSTANTIATED
    time: float = 0.0
    start_time: float = 0.0
    stop_time: float = inf
    tolerance: float = 0.0
    next_step: float = 0.0
    previous_error: float = 1e-4  # the value dopri5.f starts from
    first_stage: list[float] = field(default_factory=list)

    @classmethod
    def at_start(cls, model: Model) -> State:
        """The start values of ``model``."""
        return cls(model.starts(STATE), model.starts(INPUT), model.starts(PARAMETER), model.starts(SETTING))

    def copy(self) -> State:
        """A copy of the state that shares nothing with it."""
        return deepcopy(self)


def save(state: State, model: Model) -> bytes:
    """``state`` as bytes: a header, a checksum, and plain little-endian doubles."""
    values = [float(MODES.index(state.mode)), *(getattr(state, name) for name in _NUMBERS)]
    for name in _VECTORS:
        vector = getattr(state, name)
        values += [float(len(vector)), *vector]
    content = _header(model) + struct.pack(f"<{len(values)}d", *values)
    return hashlib.sha256(content).digest() + content


def restore(block: object, model: Model) -> State:
    """The state in ``block``; raises ValueError with a sentence if it is none of this FMU."""
    header = _header(model)
    if not isinstance(block, bytes) or block[32 : 32 + len(_MAGIC)] != _MAGIC:
        raise ValueError("is not a state of an FMU made by the python backend of lag2fmu")
    if block[32 : 32 + len(header)] != header:
        raise ValueError(f"belongs to an FMU with another GUID than {model.guid}")
    if hashlib.sha256(block[32:]).digest() != block[:32]:
        raise ValueError("is damaged: its checksum does not match")
    content = block[32 + len(header) :]
    values = iter(struct.unpack(f"<{len(content) // 8}d", content))
    mode, numbers = MODES[int(next(values))], {name: next(values) for name in _NUMBERS}
    vectors = {name: [next(values) for _ in range(int(next(values)))] for name in _VECTORS}
    restored = State.at_start(model)
    for name, value in {"mode": mode, **numbers, **vectors}.items():
        setattr(restored, name, value)
    return restored


def _header(model: Model) -> bytes:
    return _MAGIC + hashlib.sha256(model.guid.encode()).digest()
