"""Options that several commands share, and checks of the files that options name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import click
from click.shell_completion import CompletionItem

from lag2fmu.deadline import LIMIT
from lag2fmu.errors import ExportError
from lag2fmu.resources import bundled, summary
from lag2fmu.solvers.methods import METHODS

Command = TypeVar("Command", bound=Callable[..., object])
STRUCTURAL = "lag2fmu.structural"
"""The key under which the context keeps structural arguments, NAME=VALUE, that have options of their own."""


PATH = click.Path(path_type=Path)


def _keep(context: click.Context, option: click.Parameter, value: object) -> None:
    """Keep a structural argument until the model is loaded."""
    if value is not None and value is not False:
        text = "true" if value is True else str(value)
        context.meta.setdefault(STRUCTURAL, []).append(f"{option.name}={text}")


def completions(context: click.Context, argument: click.Parameter, begun: str) -> list[CompletionItem]:
    """The completions of a MODEL that has ``begun``: bundled names, and files."""
    names = [CompletionItem(name, help=summary(path)) for name, path in bundled().items() if name.startswith(begun)]
    return [*names, CompletionItem(begun, type="file")]


def _solvers(context: click.Context, option: click.Parameter, begun: str) -> list[CompletionItem]:
    return [CompletionItem(name, help=method.title) for name, method in METHODS.items() if name.startswith(begun)]


MODEL = click.argument("model", shell_complete=completions)
MODEL_OR_FMU = click.argument("model", metavar="MODEL|FMU", shell_complete=completions)
MODELS = click.argument(
    "models", metavar="MODEL|FMU|NAME=COMPONENT...", nargs=-1, required=True, shell_complete=completions
)
SOLVER = click.option(
    "--solver",
    metavar="NAME",
    help="Integrator of co-simulation; by default one that suits the start.",
    shell_complete=_solvers,
)
SET = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter, start value (in its declared unit, or '30 deg') or structural argument; repeatable.",
)
_loaded = partial(click.option, expose_value=False, callback=_keep)
"""An option on how a model is loaded, which ``loading`` hands on."""
BASE = _loaded(
    "--base",
    type=click.Choice(["fixed", "floating", "planar"]),
    help="How the base of a robot stands; by default fixed.",
)
STOPS = _loaded("--stops", is_flag=True, help="Limits of a robot's joints are hard stops.")
POSE = _loaded(
    "--pose",
    metavar="JOINT=VALUE,...",
    help="Where joints of a robot start, in rad or m. A base that floats then stands on the ground, with --ground.",
)
GROUND = _loaded(
    "--ground",
    metavar="all|LINKS",
    help="What of a robot touches the ground by its collision geometry: all, or names of links with commas between.",
)
FRICTION = _loaded(
    "--friction",
    type=float,
    metavar="MU",
    help="Coefficient of friction of a robot's contacts; by default that of the file, 1 for URDF.",
)
RESTITUTION = _loaded(
    "--restitution",
    type=float,
    metavar="E",
    help="Coefficient of restitution of a robot's contacts; by default 0.",
)
LAW = _loaded(
    "--law",
    type=click.Choice(["ideal", "compliant"]),
    help="What a robot's contacts are: ideal (the default), or compliant.",
)
PAIRS = _loaded(
    "--pairs",
    is_flag=True,
    help="Spheres and capsules of a robot in MJCF touch each other, too.",
)


def loading(command: Command) -> Command:
    """``command`` with the options that say how its model is loaded."""
    return SET(BASE(STOPS(POSE(GROUND(FRICTION(RESTITUTION(LAW(PAIRS(command)))))))))


_OBSERVER = click.option(
    "--observer",
    type=click.Choice(["ekf", "ukf", "ukf-simplex"]),
    help="Estimate all states from what is measured, by a Kalman filter: extended, or unscented.",
)
_MEASURE = click.option(
    "--measure",
    multiple=True,
    metavar="NAME[=STD],...",
    help="With --observer: what is measured, and its noise, by default 1 % of the nominal value; repeatable.",
)
_PROCESS = click.option(
    "--process",
    multiple=True,
    metavar="NAME=DENSITY,...",
    help="With --observer: white noise of inputs, states, parameters, in their units by the root of Hz; repeatable.",
)
_ESTIMATE = click.option(
    "--estimate", metavar="NAME,...", default="", help="With --observer: parameters that are estimated too."
)
_SAMPLE_TIME = click.option(
    "--sample-time",
    "sample_times",
    multiple=True,
    metavar="NAME=S,...",
    help="With --observer: time between samples; by default each communication step brings one; repeatable.",
)

_DELAY = click.option(
    "--delay",
    "delays",
    multiple=True,
    metavar="NAME=S,...",
    help="With --observer: time by which samples of it are late; repeatable.",
)


def observing(command: Command) -> Command:
    """``command`` with the options of an FMU that observes."""
    return _OBSERVER(_MEASURE(_PROCESS(_ESTIMATE(_SAMPLE_TIME(_DELAY(command))))))


STOP_TIME = click.option("--stop-time", type=float, metavar="S", help="Stop time in seconds.")
INPUT = click.option(
    "--input",
    "inputs",
    type=PATH,
    metavar="CSV",
    help="Signals: time,name [unit],...; linear between; a column without a unit is in SI.",
)
CONNECT = click.option(
    "--connect",
    multiple=True,
    metavar="A.X:B.Y",
    help="An output of the component A and an input of B, or two terminals; repeatable.",
)
JOIN = click.option(
    "--join",
    multiple=True,
    metavar="A.P:B.P=KIND[:AXIS]",
    help="Two places that are ports, and the ideal joint between them; repeatable.",
)
PATIENCE = click.option(
    "--patience",
    type=float,
    metavar="SECONDS",
    help="The longest time of a call of a component; each FMU then has a process of its own that is ended.",
)
APART = click.option("--apart", is_flag=True, help="Run each FMU of a system in a process of its own.")
COUPLING = click.option(
    "--coupling",
    type=click.Choice(["jacobi", "gauss-seidel", "iterated"]),
    default="jacobi",
    help="How the components of a system make a step: side by side (the default), one after the other, or again until "
    "no input misses what it hears.",
)
HOLD = click.option("--hold", is_flag=True, help="Hold the signals during each communication step.")
FMI = click.option(
    "--fmi", type=click.Choice(["2.0", "3.0"]), help="Version of FMI of the FMU that is exported; default 2.0."
)
TIME_LIMIT = click.option(
    "--time-limit",
    type=float,
    default=30.0,
    show_default=True,
    metavar="S",
    help="What each trial of the run may take; after a longer one the rest of its kind is left out.",
)
PLATFORMS = (
    *("host", "linux64", "win64", "darwin", "aarch64-linux"),
    *("linux64-musl", "linux32", "aarch32-linux", "riscv64-linux", "win32", "aarch64-windows"),
    "wasm",
    *("all", "every"),
)
"""The choices of ``--platform``, as ``fmu.platforms`` knows them; written here so that the command line starts fast."""


class Several(click.Choice[str]):
    """One or several of some choices, with commas between them."""

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The words of ``value`` joined by commas; fails with click's message for one that is no choice."""
        one = super().convert
        return ",".join(one(word.strip(), param, ctx) for word in value.split(","))


PLATFORM = click.option(
    "--platform",
    type=Several(PLATFORMS),
    metavar="NAMES",
    default="host",
    show_default=True,
    help=f"Platforms of the libraries, with commas: {', '.join(PLATFORMS)}. "
    "all: of desktops; every: all but musl and wasm; wasm: a component for WebAssembly, by --fmi 3.0.",
)
WITHIN = click.option(
    "--limit",
    type=float,
    default=LIMIT,
    show_default=True,
    metavar="S",
    help="CPU time in seconds for direct integration or analysis; what is not reached in it is said.",
)
PICTURES = (".png", ".svg", ".pdf")
ANIMATIONS = (".gif", ".mp4", ".html")
CSV = (".csv", ".txt", "")


def check_picture(plot: Path | None) -> None:
    """Raise ExportError if the picture ``plot`` could not be written."""
    if plot is not None:
        check_ending(plot, PICTURES)


def check_ending(path: Path, endings: tuple[str, ...]) -> None:
    """Raise ExportError, before the work begins, if the file ``path`` could not be written."""
    if path.suffix not in endings:
        raise ExportError(f"'{path}': its ending must be one of {', '.join(filter(None, endings))}")
    try:
        is_folder = path.is_dir()
    except OSError as error:
        raise ExportError(f"'{str(path)[:60]}...' cannot be written: {error.strerror}; give a shorter name") from error
    if is_folder:
        raise ExportError(f"'{path}': is a folder; name a file")
    if not path.parent.is_dir():
        raise ExportError(f"'{path}': the folder '{path.parent}' does not exist")


def refuse_to_overwrite(path: Path, *, force: bool) -> None:
    """Raise ExportError if ``path`` exists, unless ``force``; a device or pipe holds nothing that could be lost."""
    if (path.is_file() or path.is_dir()) and not force:
        raise ExportError(f"'{path}' exists; overwrite it with --force, or choose another name with -o")
