"""What a step of an observer costs beyond one of its plant, in evaluations of the equations for each state.

The plant's FMU takes the same solver steps by the same method. An evaluation is what a further solver step of it takes,
by the four that it has. Run ``python -m benchmarks.observers [MODEL ...]``.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import lag2fmu
from lag2fmu.analysis.observing import METHODS_OF_OBSERVERS, Observing

STEP, ROUNDS, CALLS = 0.01, 30, 300
MODELS = {
    "cart_pole": ({"x": 0.005, "theta": 0.02}, {"F": 0.1}),
    "six_axis_arm": ({f"theta_{i}": 0.01 for i in range(1, 7)}, {f"Q_theta_{i}": 0.1 for i in range(1, 7)}),
}
"""{model: what is measured, and the noise}."""


def seconds(path: Path, settings: Mapping[str, float]) -> float:
    """The least time (s) of a communication step of STEP."""
    folder, description = extract(path), read_model_description(path)
    references = {v.name: v.valueReference for v in description.modelVariables}
    unit = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="it",
    )
    unit.instantiate()
    best = float("inf")
    for _ in range(ROUNDS):
        unit.setupExperiment(startTime=0.0)
        unit.setReal([references[name] for name in settings], [*settings.values()])
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        best = min(best, _taken(lambda i: unit.doStep(i * STEP, STEP)))
        unit.reset()
    unit.freeInstance()
    return best


def _taken(step: Callable[[int], object]) -> float:
    begun = time.perf_counter()
    for i in range(CALLS):
        step(i)
    return (time.perf_counter() - begun) / CALLS


def rows(model: str, folder: Path) -> list[str]:
    """The rows of ``model`` in the table."""
    measure, process = MODELS[model]
    plant = lag2fmu.export(model, folder / f"{model}.fmu", solver="rk4").path
    own, finer = (seconds(plant, {"solver_step": STEP / parts}) for parts in (1, 21))
    evaluation = (finer - own) / (20 * 4)
    states, found = 2 * len(lag2fmu.load(model).coordinates), []
    for method in METHODS_OF_OBSERVERS:
        eye = lag2fmu.export(model, folder / f"{model}_{method}.fmu", observer=Observing(method, measure, process))
        taken = seconds(eye.path, {"solver_step": STEP})
        each = (taken - own) / evaluation / states
        found.append(
            f"| `{model}` | {method} | {1e6 * evaluation:.3f} | {1e6 * own:.2f} | {1e6 * taken:.2f} | {each:.1f} |"
        )
    return found


if __name__ == "__main__":
    print(
        "| model | method | evaluation, us | plant's step, us | observer's step, us | evaluations a state beyond it |"
    )
    print("|---" * 6 + "|")
    with tempfile.TemporaryDirectory() as place:
        for model in sys.argv[1:] or MODELS:
            print(*rows(model, Path(place)), sep="\n", flush=True)
