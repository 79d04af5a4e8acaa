"""Remarks on a run that succeeded: guesses that were moved, inputs that begin late or end early."""

from __future__ import annotations

from collections.abc import Mapping, Set

from lag2fmu.verify.run import Plan, Run

MOVED = 1e-6
"""Relative to a guess, or to 1 in SI units: where constraints move the guess by less, it is where it was set."""
ENDED = 1e-9
"""Relative to the length of the run: inputs may miss the start or the stop time by it, which is rounding."""


def short_inputs(run: Run, plan: Plan) -> list[str]:
    """Sentences on inputs whose times do not cover the run; one time alone is a constant."""
    if run.inputs is None or len(run.inputs.time) < 2:
        return []
    first, last = (float(run.inputs.time[i]) for i in (0, -1))
    start, stop = (float(plan.grid[i]) for i in (0, -1))
    names, rounding = f"the inputs {', '.join(run.inputs.names)}", ENDED * (stop - start)
    found = []
    if first > start + rounding:
        found.append(f"{names} begin at {first:g} s and have their first values before; give them from {start:g} s on")
    if last < stop - rounding:
        found.append(
            f"{names} end at {last:g} s and keep their last values until {stop:g} s; give them to the end, or an "
            "earlier stop time"
        )
    return found


def moved_guesses(guesses: Set[str], values: Mapping[str, float], start: Mapping[str, float]) -> list[str]:
    """A sentence on the ``values`` {name: SI} of ``guesses`` that were set and are not those of the ``start``."""
    found = []
    for name in guesses & values.keys() & start.keys():
        wanted, reached = float(values[name]), float(start[name])
        if abs(reached - wanted) > MOVED * max(1.0, abs(wanted)):
            found.append(f"{name} from {wanted:.6g} to {reached:.6g}")
    if not found:
        return []
    return [
        f"constraints move what was set as a guess: {', '.join(sorted(found))}; what the mechanism gives as 'start' or "
        "'velocity' is kept as it is set"
    ]
