"""Faults that are planted in the C code of an exported FMU, each by one replacement of text, and how to build with one.

Every fault breaks a law of mechanics; ``validate`` has to find all of them.
"""

from __future__ import annotations

import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path

from support.compiling import QUICK, UNOPTIMISED
from support.delivered import file_with

from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.sources import ALL

OPTIONS = ("-std=c99", *UNOPTIMISED["zig"], "-ffp-contract=off", "-fPIC", "-w", "-DFMI2_OVERRIDE_FUNCTION_PREFIX")


@dataclass(frozen=True)
class Fault:
    """In the engine's ``file`` of the FMU of ``model`` the text ``right`` becomes ``wrong``."""

    name: str
    model: str
    file: str
    right: str
    wrong: str


_SLIDING = ("sliding.c", "rest[k] = z - s[")
_CLOSED = ("contact_events.c", "values[0] = force_told(state, point, contact);")
_OPEN = ("contact_events.c", "values[0] = point->gaps[contact];")
_CAPACITY = ("contact_events.c", "point->capacity[i] = fmax(point->force[i], point->capacity[i]);")
_RESTITUTION = ("settle_impacts.c", ".restitution = settling->restitution[i],")
_LATCH = ("contact_settle.c", "row_activate(state, row, holds);")
_IMPULSE = ("settle_impacts.c", "state->impulses[which[i]] = impulse;")
_LOST = ("settle_impacts.c", "states[DISSIPATED] += result->lost;")
_MOVE = ("settle_impacts.c", "change += settling->response[k * N + i] * impulses[k];")
_DUST = ("sliding.c", "unknowns[i] = fabs(unknowns[i]) <= NOISE * greatest[i] ? 0.0 : unknowns[i];")

FAULTS = (
    Fault("friction has the wrong sign", "braked_wheel", *_SLIDING, "rest[k] = z + s["),
    Fault("friction is 10 % too great", "braked_wheel", *_SLIDING, "rest[k] = z - 1.1 * s["),
    Fault("friction of a contact is 10 % too small", "box", *_SLIDING, "rest[k] = z - 0.9 * s["),
    Fault(
        "restitution is applied twice",
        "bouncing_ball",
        *_RESTITUTION,
        ".restitution = settling->restitution[i] * settling->restitution[i],",
    ),
    Fault("restitution is ignored", "impact_oscillator", *_RESTITUTION, ".restitution = 0.0,"),
    Fault(
        "an impact's impulse is not shown rightly",
        "bouncing_ball",
        *_IMPULSE,
        "state->impulses[which[i]] = 2.0 * impulse;",
    ),
    Fault(
        "energy of impacts is not dissipated", "pendulum_with_stop", *_LOST, "states[DISSIPATED] += 0.0 * result->lost;"
    ),
    Fault(
        "an impact changes velocities by less than its impulse",
        "newtons_cradle",
        *_MOVE,
        "change += 0.9 * settling->response[k * N + i] * impulses[k];",
    ),
    Fault(
        "an impact is lost",
        "bouncing_ball",
        "settle_impacts.c",
        "    if (!something_approaches(settling)) {",
        "    if (settling->instance->state.impacts[0] == 3 || !something_approaches(settling)) {",
    ),
    Fault("a gap closes late", "bouncing_ball", *_OPEN, "values[0] = point->gaps[contact] + 1e-3;"),
    Fault(
        "a gap closes early: the indicator has a bias",
        "pendulum_with_stop",
        *_OPEN,
        "values[0] = point->gaps[contact] - 1e-3;",
    ),
    Fault(
        "a contact adheres",
        "hopper_leg",
        *_CLOSED,
        "values[0] = force_told(state, point, contact) + 5.0;",
    ),
    Fault(
        "the static coefficient is ignored",
        "block_on_belt",
        "mechanism.c",
        "H[0] = p[5];",
        "H[0] = p[6];",
    ),
    Fault(
        "the capacity is ignored: what sticks holds any load",
        "block_on_belt",
        *_CAPACITY,
        "point->capacity[i] = 1e9;",
    ),
    Fault(
        "a stick creeps",
        "block_on_belt",
        *_DUST,
        "unknowns[i] = fabs(unknowns[i]) <= NOISE * greatest[i] ? 1e-3 : unknowns[i];",
    ),
    Fault("a latch does not hold", "gripper", *_LATCH, "row_activate(state, row, false);"),
    Fault("a latch does not let go", "gripper", *_LATCH, "row_activate(state, row, holds || row_active(state, row));"),
    Fault(
        "a slip stops early: its indicator has a bias",
        "coulomb_oscillator",
        "contact_events.c",
        "return row_direction(state, row) * point->slips[row - FIRST_SLIP];",
        "return row_direction(state, row) * point->slips[row - FIRST_SLIP] - 1e-2;",
    ),
    Fault(
        "a slip's direction is frozen in space",
        "puck",
        "contact_modes.c",
        "outlook.tau > 0.0 ? LEAST_BIAS : fmax(LEAST_BIAS, outlook.steady)",
        "1e-3",
    ),
    Fault(
        "impacts charge friction twice",
        "disc",
        "settle_impacts.c",
        ".friction = impact->friction[i],",
        ".friction = 2.0 * impact->friction[i],",
    ),
    Fault(
        "an impact acts twice",
        "impact_oscillator",
        "settle_impacts.c",
        "    move(settling, impact->start, impact->result.impulses);",
        "    move(settling, impact->start, impact->result.impulses);\n"
        "    move(settling, settling->instance->state.states + N, impact->result.impulses);",
    ),
    Fault(
        "shared loads are shown beyond their limits",
        "row",
        "shared_loads.c",
        "const bool shared = least_margin(p, margin, find_margins(p, margin)) < 0.0 && may_share(p);",
        "const bool shared = least_margin(p, margin, find_margins(p, margin)) < -HUGE_VAL && may_share(p);",
    ),
)

_SETTLE, _COEFFICIENTS = "step_modes.c", "step_impulses.c"

STEPPED = (
    Fault(
        "steps apply restitution twice",
        "bouncing_ball",
        _COEFFICIENTS,
        "return left * approach > pressed * length ? left : 0.0;",
        "return left * approach > pressed * length ? left * left : 0.0;",
    ),
    Fault(
        "steps close a gap late",
        "bouncing_ball",
        _COEFFICIENTS,
        "end <= AT_REST * scratch->at.sizes[row]",
        "end <= -1e-3",
    ),
    Fault(
        "steps rub 10 % too much",
        "disc",
        _COEFFICIENTS,
        "scratch->friction[c] = fmax(contact_sticks(state, c)",
        "scratch->friction[c] = 1.1 * fmax(contact_sticks(state, c)",
    ),
    Fault(
        "steps do not dissipate the energy of impacts",
        "pendulum_with_stop",
        "moreau.c",
        "states[DISSIPATED] -= 0.5 * scratch->impulses[row]",
        "states[DISSIPATED] -= 0.0 * scratch->impulses[row]",
    ),
    Fault(
        "steps show twice the impulse",
        "bouncing_ball",
        _SETTLE,
        "state->impulses[contact] = scratch->impulses[row];",
        "state->impulses[contact] = 2.0 * scratch->impulses[row];",
    ),
    Fault(
        "steps let contacts adhere",
        "hopper_leg",
        _COEFFICIENTS,
        "chosen->row[normal].law = ROW_UNILATERAL;",
        "chosen->row[normal].law = ROW_BILATERAL;",
    ),
)
"""Faults in time stepping, in FMUs with the solver moreau."""


def planted(fault: Fault, fmu: Path, path: Path) -> Path:
    """The FMU ``path``: that in ``fmu`` with the ``fault``, compiled anew from all of its sources in one unit."""
    folder = path.with_suffix("")
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    source, begin, end = file_with(folder / "sources", fault.file)
    text = source.read_text("utf-8")
    assert text.count(fault.right, begin, end) == 1, f"{fault.file} has changed: plant the fault '{fault.name}' anew"
    source.write_text(text[:begin] + text[begin:end].replace(fault.right, fault.wrong) + text[end:], "utf-8")
    (library,) = (folder / "binaries").rglob("*.so")
    command = [*QUICK, *OPTIONS, f"-I{fmi_headers()}", "-shared", str(source.with_name(ALL)), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    with zipfile.ZipFile(path, "w") as archive:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                archive.write(file, file.relative_to(folder).as_posix())
    return path
