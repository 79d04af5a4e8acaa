"""Random machines with laws of contact: mechanisms in families/*.toml, their parameters and starts by seed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from lag2fmu.formats.text import read_file
from lag2fmu.mechanism import Mechanism

Rng = np.random.Generator


@dataclass(frozen=True)
class Slip:
    """A row of friction: the names of its relative velocities and forces, one or two, of its limit and its mode.

    ``normal`` is the force that the limit is a coefficient of; without it the limit is a force.
    """

    slips: tuple[str, ...]
    forces: tuple[str, ...]
    limit: str
    mode: str
    normal: str = ""


@dataclass(frozen=True)
class Family:
    """A mechanism of families/, the ``draw`` of its values by a random generator, and the names that checks read.

    ``contacts`` have a gap and a force; ``work`` is done by external forces, "" where there are none. ``compared`` are
    the coordinates that all ways of running it are compared by; ``flies``: its impacts turn small errors into large
    ones, so that hosts that locate no events are judged by the laws alone.
    """

    draw: Callable[[Rng], dict[str, float]]
    slips: tuple[Slip, ...]
    compared: tuple[str, ...]
    contacts: tuple[str, ...] = ()
    work: str = "work"
    flies: bool = False


def _dry(name: str, slip: str, limit: str) -> Slip:
    return Slip((slip,), (f"{name}_force",), limit, f"{name}_mode")


def _of_contact(name: str, slips: tuple[str, ...], limit: str) -> Slip:
    several = len(slips) > 1
    forces = tuple(f"{name}_friction_{i}" for i in (1, 2)) if several else (f"{name}_friction",)
    return Slip(slips, forces, limit, f"{name}_mode", f"{name}_force")


def _chain(rng: Rng) -> dict[str, float]:
    values = {name: float(rng.uniform(0.0, 6.0)) for name in ("F1", "F2", "F3", "F12")}
    values |= {name: float(rng.uniform(0.3, 3.0)) for name in ("m1", "m2", "m3")}
    values |= {"A": float(rng.uniform(5.0, 40.0)), "w": float(rng.uniform(1.0, 15.0)), "k": float(rng.uniform(5, 500))}
    values |= {"S": float(rng.uniform(1.0, 1.5)), "e": float(rng.uniform(0.0, 0.9)), "top": float(rng.uniform(0.02, 1))}
    if rng.uniform() < 0.7:  # else it starts at rest
        values |= {f"x{i}_dot": float(rng.normal(0.0, 2.0)) for i in (1, 2, 3)}
    return values


def _row(rng: Rng) -> dict[str, float]:
    """Blocks in a row with several frictions along one slip, in units of mass that are a power of two."""
    values = {name: float(rng.uniform(0.2, 6.0)) for name in ("F1", "F2", "F12", "F23", "G3")}
    values |= {name: float(rng.uniform(0.3, 3.0)) for name in ("m1", "m2", "m3")}
    values |= {"A": float(rng.uniform(5.0, 40.0)), "w": float(rng.uniform(1.0, 15.0)), "k": float(rng.uniform(5, 500))}
    values |= {"S": float(rng.choice([1.0, 1.3])), "mu": float(rng.uniform(0.05, 0.5))}
    values |= {"e": float(rng.uniform(0.0, 0.9)), "top": float(rng.uniform(0.02, 1))}
    values |= {"kg": 2.0 ** int(rng.integers(0, 21))}
    if rng.uniform() < 0.7:  # else it starts at rest
        values |= {f"x{i}_dot": float(rng.normal(0.0, 2.0)) for i in (1, 2, 3)}
    return values


def _yoke(rng: Rng) -> dict[str, float]:
    """A slide that is driven by the cosine of its crank."""
    start = float(rng.choice([0.0, np.pi, rng.uniform(0.0, 6.0)]))
    return {
        "F": float(rng.uniform(1.0, 40.0)),
        "S": float(rng.choice([1.0, 1.3])),
        "J": float(rng.uniform(0.1, 0.5)),
        "T": float(rng.uniform(-4.0, 4.0)),
        "a": start,
        "a_dot": float(rng.choice([0.0, rng.normal(0.0, 10.0)])),
    }


def _loop(rng: Rng) -> dict[str, float]:
    """A crank-slider whose rod and slide are closed by constraints; more than half of them begin in a dead centre."""
    dead = rng.uniform() < 0.6
    return {
        "F": float(rng.uniform(5.0, 80.0)),
        "F_b": float(rng.choice([0.0, rng.uniform(0.0, 0.5)])),
        "S": float(rng.choice([1.0, 1.3])),
        "J": float(rng.uniform(0.1, 0.5)),
        "m": float(rng.uniform(0.2, 3.0)),
        "T": float(rng.uniform(1.0, 8.0) * rng.choice([-1, 1])),
        "a": float(rng.choice([0.0, np.pi]) if dead else rng.uniform(0.0, 6.0)),
        "a_dot": float(rng.choice([0.0, rng.normal(0.0, 10.0)])),
    }


def _engaged(rng: Rng) -> dict[str, float]:
    """A motor that a clutch joins to the crank at a time, often in the dead centre."""
    values = _loop(rng) | {"I": float(rng.uniform(0.1, 1.0)), "C": float(rng.uniform(2.0, 30.0))}
    resting = bool(rng.uniform() < 0.6)
    values |= {"T": 0.0, "a_dot": 0.0} if resting else {}
    return values | {"p_dot": float(rng.normal(0.0, 15.0)), "on_time": float(rng.uniform(0.0, 0.5))}


def _clutch(rng: Rng) -> dict[str, float]:
    values = {name: float(rng.uniform(0.2, 3.0)) for name in ("J1", "J2", "J3")}
    values |= {"C": float(rng.uniform(1, 60)), "B": float(rng.uniform(0, 10)), "T": float(rng.uniform(0, 40))}
    values |= {"on_time": float(rng.uniform(0.0, 0.8)), "w": float(rng.uniform(1, 20)), "k": float(rng.uniform(5, 500))}
    return values | {f"phi{i}_dot": float(rng.choice([0.0, rng.normal(0.0, 10.0)])) for i in (1, 2, 3)}


def _disc(rng: Rng) -> dict[str, float]:
    values = {"mu": float(rng.uniform(0, 1)), "nu": float(rng.uniform(0, 1)), "e": float(rng.uniform(0, 0.9))}
    values |= {"d": float(rng.uniform(0, 0.9)), "J": float(rng.uniform(0.005, 0.04)), "m": float(rng.uniform(0.3, 3))}
    values |= {
        "x_dot": float(rng.uniform(-2, 4)),
        "phi_dot": float(rng.normal(0, 20)),
        "y_dot": float(rng.normal(0, 1)),
    }
    return values | {"y": float(rng.choice([0.2, rng.uniform(0.2, 1.0)]))}


def _box(rng: Rng) -> dict[str, float]:
    values = {"mu": float(rng.uniform(0.1, 1)), "e": float(rng.uniform(0, 0.7)), "c": float(rng.uniform(0.1, 0.6))}
    values |= {"S": float(rng.choice([1.0, 1.3])), "A": float(rng.uniform(0, 8)), "w": float(rng.uniform(1, 15))}
    lifted = bool(rng.uniform() < 0.5)
    values |= {"y": values["c"] + (float(rng.uniform(0.2, 0.5)) if lifted else 0.0)}
    if lifted:
        values |= {"phi": float(rng.uniform(-0.4, 0.4)), "phi_dot": float(rng.normal(0, 1))}
    return values | {"x_dot": float(rng.choice([0.0, rng.normal(0, 2)]))}


def _puck(rng: Rng) -> dict[str, float]:
    values = {"mu": float(rng.uniform(0.05, 0.8)), "S": float(rng.choice([1.0, 1.3])), "A": float(rng.uniform(0, 15))}
    values |= {"w": float(rng.uniform(0.5, 10)), "e": float(rng.uniform(0, 0.8))}
    if rng.uniform() < 0.7:
        values |= {"x_dot": float(rng.normal(0, 2)), "y_dot": float(rng.normal(0, 2))}
    return values | {"z": float(rng.choice([0.0, rng.uniform(0.0, 0.5)]))}


def _ball(rng: Rng) -> dict[str, float]:
    values = {"mu": float(rng.uniform(0.05, 0.8)), "e": float(rng.uniform(0, 0.8)), "A": float(rng.uniform(0, 6))}
    values |= {name: float(rng.normal(0, 2)) for name in ("x_dot", "y_dot")}
    values |= {name: float(rng.choice([0.0, rng.normal(0, 30)])) for name in ("alpha_dot", "beta_dot")}
    return values | {"z": float(rng.choice([0.1, rng.uniform(0.1, 0.5)]))}


def _bang(rng: Rng) -> dict[str, float]:
    values = {"m": float(rng.uniform(0.3, 3)), "F": float(rng.uniform(0.1, 8)), "A": float(rng.uniform(0, 4))}
    values |= {"P": float(rng.uniform(4, 15)), "level": float(rng.uniform(-0.8, 0.8)), "n": float(rng.uniform(3, 30))}
    return values | {"x_dot": float(rng.choice([0.0, rng.normal(0, 2)]))}


FAMILIES: Mapping[str, Family] = {
    "chain": Family(
        _chain,
        (
            _dry("floor1", "x1_dot", "limit1"),
            _dry("floor2", "x2_dot", "limit2"),
            _dry("floor3", "x3_dot", "limit3"),
            _dry("plate", "slip_plate", "limit12"),
        ),
        ("x1", "x2", "x3"),
        contacts=("wall_lower", "wall_upper"),
    ),
    "yoke": Family(_yoke, (_dry("slide", "slip", "limit"),), ("a", "a_dot")),
    "loop": Family(_loop, (_dry("slide", "x_dot", "limit"), _dry("bearing", "a_dot", "limit_b")), ("a", "a_dot")),
    "engaged": Family(
        _engaged,
        (
            _dry("slide", "x_dot", "limit"),
            _dry("bearing", "a_dot", "limit_b"),
            _dry("clutch", "slip_clutch", "limit_clutch"),
        ),
        ("a", "a_dot", "p_dot"),
    ),
    "clutch": Family(
        _clutch, (_dry("clutch", "slip", "limit"), _dry("brake", "phi3_dot", "limit_b")), ("phi1", "phi2", "phi3")
    ),
    "disc": Family(
        _disc,
        (_of_contact("floor", ("slip_floor",), "limit_floor"), _of_contact("wall", ("slip_wall",), "limit_wall")),
        ("x", "y", "phi"),
        contacts=("floor", "wall"),
        work="",
        flies=True,
    ),
    "box": Family(
        _box,
        (_of_contact("left", ("slip_left",), "limit"), _of_contact("right", ("slip_right",), "limit")),
        ("x", "y", "phi"),
        contacts=("left", "right"),
        flies=True,
    ),
    "puck": Family(
        _puck, (_of_contact("table", ("x_dot", "y_dot"), "limit_table"),), ("x", "y"), contacts=("table",), flies=True
    ),
    "ball": Family(
        _ball, (_of_contact("table", ("slip_1", "slip_2"), "limit_table"),), ("x", "y"), contacts=("table",), flies=True
    ),
    "bang": Family(_bang, (_dry("guide", "x_dot", "limit"),), ("x", "x_dot")),
    "row": Family(
        _row,
        (
            _dry("floor1", "x1_dot", "limit1"),
            _dry("guide1", "x1_dot", "limit_guide1"),
            _dry("floor2", "x2_dot", "limit2"),
            _dry("plate12", "slip12", "limit12"),
            _dry("plate23", "slip23", "limit23"),
            _dry("guide3", "x3_dot", "limit_guide3"),
            _of_contact("floor3", ("x3_dot",), "limit3"),
        ),
        ("x1", "x2", "x3"),
        contacts=("wall_lower", "wall_upper", "floor3"),
    ),
}


@cache
def mechanism(family: str) -> Mechanism:
    """The mechanism of a family."""
    return read_file(Path(__file__).with_name("families") / f"{family}.toml")
