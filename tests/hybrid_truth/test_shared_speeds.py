"""A block on several belts: the loads are of least norm, and belts of one speed share the friction that holds it."""

from __future__ import annotations

import numpy as np
import pytest

import lag2fmu
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu

WEIGHT, END = 9.81, 0.5
WAYS = ["dopri5", "moreau", "judge"]


def _block(belts: list[tuple[float, float]], force: str, *, in_space: bool, start: float = 0.0) -> Mechanism:
    """A block of 1 kg on ``belts`` of given speeds (m/s) and friction, pushed by a ``force`` (N).

    ``start`` is its velocity at the start, in m/s.
    """
    slips = ["x_dot - ({})*metre/second", *(["z_dot"] if in_space else [])]
    contacts = "".join(
        f"""
        [contacts.belt{k}]
        gap = "y"
        slip = {[slip.format(speed) for slip in slips] if in_space else repr(slips[0].format(speed))}
        friction = {friction}
        """
        for k, (speed, friction) in enumerate(belts)
    )
    return read(
        f"""
        [mechanism]
        name = "belts"
        [parameters]
        metre = {{ value = 1.0, unit = "m" }}
        second = {{ value = 1.0, unit = "s" }}
        newton = {{ value = 1.0, unit = "N" }}
        [coordinates]
        x = {{ unit = "m", velocity = {start} }}
        y = {{ unit = "m" }}
        {'z = { unit = "m" }' if in_space else ""}
        [bodies]
        block = {{ mass = 1, position = ["x", "y"{', "z"' if in_space else ""}] }}
        [gravity]
        acceleration = {WEIGHT}
        {"direction = [0, -1, 0]" if in_space else ""}
        [forces]
        x = "{force}"
        {contacts}""",
        "belts",
    )


def _velocities(mechanism: Mechanism, way: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and the velocities of the block (m/s), (n,) each."""
    times = np.linspace(0.0, END, 26)
    if way == "judge":
        return times, integrate(mechanism, times, rtol=1e-9).trajectory.columns(["x_dot"])[:, 0]
    kind = {"kind": "model-exchange"} if way == "model-exchange" else {"solver": way}
    run = lag2fmu.simulate(mechanism, stop_time=END, step=0.02, tolerance=1e-8, outputs=["x_dot"], **kind)
    return run.time, run["x_dot"]


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("way", [*WAYS, "radau5", "model-exchange"])
def test_belts_of_one_speed_hold_until_both_are_at_their_limit(way: str, in_space: bool) -> None:
    """The rougher one takes on what the other cannot hold; neither takes a load from the belts that slide.

    Equal loads N: 1.53 + 4.72 t has to exceed (0.44 + 0.25 + 0.4 - 0.23) N. With other loads it is held for longer.
    Moreau's steps are 1 ms. The judge is less exact between the ends of its steps where a slip in space begins.
    """
    belts = [(0.5, 0.4), (0.0, 0.44), (-0.7, 0.23), (0.0, 0.25)]
    times, found = _velocities(_block(belts, "newton*(-1.53 - 4.72*t/second)", in_space=in_space), way)
    start = (0.86 * WEIGHT / 4 - 1.53) / 4.72
    bar = 2e-5 if way == "moreau" or (way == "judge" and in_space) else 1e-6
    assert found == pytest.approx(-4.72 / 2 * np.maximum(times - start, 0.0) ** 2, abs=bar)


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_pads_that_break_loose_at_once_share_their_load(way: str, in_space: bool) -> None:
    """The roughest alone would bear all at last. Pads that slide bear equal loads, and rub by the mean coefficient."""
    pads = [(0.0, 0.31), (0.0, 0.09), (0.0, 0.24), (0.0, 0.27)]
    times, found = _velocities(_block(pads, "-4.08*newton", in_space=in_space), way)
    assert found == pytest.approx((-4.08 + 0.2275 * WEIGHT) * times, abs=1e-6)


@pytest.mark.parametrize("in_space", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_a_block_that_comes_to_rest_stays_if_its_roughest_pad_can_hold_it(way: str, in_space: bool) -> None:
    """Equal loads hold 0.2275 of the weight, the roughest pad alone 0.31 of it: 2.6 N is in between."""
    pads = [(0.0, 0.31), (0.0, 0.09), (0.0, 0.24), (0.0, 0.27)]
    times, found = _velocities(_block(pads, "2.6*newton", in_space=in_space, start=-1.0), way)
    assert found == pytest.approx(np.minimum(-1.0 + (2.6 + 0.2275 * WEIGHT) * times, 0.0), abs=1e-6)
