"""``simulate`` for a mechanism, an FMU, or a system of FMUs."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import ParamSpec

from lag2fmu.errors import LoadError
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.running import simulate_system
from lag2fmu.systems.source import is_system
from lag2fmu.verify import entry_points

P = ParamSpec("P")


def or_a_system(one: Callable[P, Trajectory]) -> Callable[P, Trajectory]:
    """``one``, which simulates a mechanism or an FMU, for systems of FMUs too: paths that end in .ssp or .ssd.

    The function raises what ``one`` and ``simulate_system`` raise.
    """

    @wraps(one)
    def simulated(*args: P.args, **kwargs: P.kwargs) -> Trajectory:
        model = args[0] if args else kwargs.get("model")
        if not is_system(model):
            return one(*args, **kwargs)
        choices = dict(kwargs)
        choices.pop("model", None)
        if choices.pop("sample_time", None) is not None:
            raise LoadError(f"'{model}': a system has no sample_time; its controllers are components of their own")
        return simulate_system(Path(str(model)), **choices)

    return simulated


simulate = or_a_system(entry_points.simulate)
