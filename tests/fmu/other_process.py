"""A process of its own for tests that must not share memory, or that may crash: one JSON request in, one answer out.

``continue``: restore a serialized state and take steps. ``attack``: hand damaged blocks to an FMU and say what it did.
"""

from __future__ import annotations

import ctypes
import json
import random
import sys
from pathlib import Path

from fmpy.fmi1 import FMICallException
from stepping import ERROR, Stepping, bits


def go_on(path: str, state: str, time: float, count: int, length: float, inputs: dict[str, float]) -> list[str]:
    """The bits of the states after each of ``count`` steps from the serialized ``state`` (hexadecimal)."""
    with Stepping(Path(path)) as host:
        host.start()
        host.unit.setFMUstate(host.unit.deSerializeFMUstate(bytes.fromhex(state)))
        host.time = time
        host.set(inputs)
        return [bits(states) for states in host.steps(count, length)]


def attack(path: str, foreign: dict[str, str]) -> dict[str, list[str]]:
    """What the FMU says to blocks that are not its own: 'accepted', or 'status: sentence'; by kind of block."""
    with Stepping(Path(path)) as host:
        host.start()
        host.step(0.1)
        good = host.unit.getFMUstate()
        block = host.unit.serializeFMUstate(good)
        expected = bits(host.step(0.1))
        blocks = {name: [bytes.fromhex(text)] for name, text in foreign.items()}
        blocks["cut"] = [block[:size] for size in (0, 1, 7, 8, 40, len(block) // 2, len(block) - 8, len(block) - 1)]
        blocks["longer"] = [block + b"\0", block + block]
        blocks["zero"] = [bytes(len(block))]
        blocks["bit flipped"] = [flipped(block, bit) for bit in range(0, 8 * len(block), 13)]
        generator = random.Random(4)
        blocks["random"] = [generator.randbytes(len(block)) for _ in range(20)]
        found: dict[str, list[str]] = {}
        for kind, variants in blocks.items():
            found[kind] = [refusal(host, host.unit.deSerializeFMUstate, variant) for variant in variants]
        raw = [ctypes.create_string_buffer(variant) for variant in (bytes(4096), generator.randbytes(4096))]
        pointers = [ctypes.cast(buffer, ctypes.c_void_p) for buffer in raw]
        for function in ("setFMUstate", "serializeFMUstate", "freeFMUstate"):
            found[function] = [refusal(host, getattr(host.unit, function), pointer) for pointer in pointers]
        found["setFMUstate"].append(refusal(host, host.unit.setFMUstate, ctypes.c_void_p()))
        host.unit.setFMUstate(good)
        host.time = 0.1
        found["afterwards"] = ["the same" if bits(host.step(0.1)) == expected else "changed"]
        return found


def flipped(block: bytes, bit: int) -> bytes:
    """``block`` with one bit changed."""
    changed = bytearray(block)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def refusal(host: Stepping, function: object, argument: object) -> str:
    """What happens to ``argument``: 'accepted', 'silent', or the sentence of the refusal."""
    host.log.clear()
    try:
        function(argument)  # type: ignore[operator]
    except FMICallException as error:
        if error.status != ERROR:
            return f"status {error.status}"
        return host.sentences[-1] if host.sentences else "silent"
    return "accepted"


if __name__ == "__main__":
    request = json.load(sys.stdin)
    action = {"continue": go_on, "attack": attack}[request.pop("action")]
    json.dump(action(**request), sys.stdout)
