"""Coefficients of friction that change with place, speed and time, or differ between contacts that share a load.

The motions are in closed form, whoever integrates.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import spence

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.direct_integration import integrate

pytestmark = pytest.mark.fmu

G = 9.81
WAYS = pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "judge"])


def _block(friction: str, speed: float = 0.0, slope: float = 0.0, static: str = "") -> Mechanism:
    """A block of 1 kg with this ``speed`` (m/s) down a ``slope`` (rad)."""
    return read(
        f"""
        [mechanism]
        name = "block"
        [parameters]
        metre = {{ value = 1.0, unit = "m" }}
        second = {{ value = 1.0, unit = "s" }}
        g = {{ value = {G}, unit = "m/s2" }}
        [coordinates]
        x = {{ unit = "m", velocity = {speed} }}
        y = {{ unit = "m" }}
        [gravity]
        acceleration = "g"
        direction = ["sin({slope})", "-cos({slope})"]
        [bodies]
        block = {{ mass = 1, position = ["x", "y"] }}
        [contacts.floor]
        gap = "y"
        slip = "x_dot"
        friction = "{friction}"
        {static and f'static_friction = "{static}"'}
        """,
        "block",
    )


def _motion(mechanism: Mechanism, way: str, stop: float, tolerance: float = 1e-10) -> np.ndarray:
    """Times (s), places (m) and speeds (m/s), (3, 51)."""
    names, times = ["x", "x_dot"], np.linspace(0.0, stop, 51)
    if way == "judge":
        return np.vstack([times, integrate(mechanism, times, rtol=tolerance).trajectory.columns(names).T])
    run = lag2fmu.simulate(mechanism, stop_time=stop, step=stop / 50, tolerance=tolerance, outputs=names, kind=way)
    return np.vstack([run.time, run.columns(names).T])


@WAYS
def test_friction_that_grows_with_the_way_is_a_spring(way: str) -> None:
    """x'' = -g (0.1 + 0.2 x) up to rest, where static friction holds the spring."""
    w, t0, v = np.sqrt(0.2 * G), 0.1 / 0.2, 3.0
    amplitude, end = np.hypot(t0, v / w), np.arctan2(v / w, t0) / w
    t, x, speed = _motion(_block("0.1 + 0.2*x/metre", v), way, 2.0)
    moved = np.minimum(t, end)
    phase = np.arctan2(t0, v / w)
    assert x == pytest.approx(amplitude * np.sin(w * moved + phase) - t0, abs=3e-8)
    assert speed == pytest.approx(np.where(t < end, amplitude * w * np.cos(w * t + phase), 0.0), abs=3e-8)


@WAYS
def test_friction_that_grows_with_the_speed_is_drag(way: str) -> None:
    """v' = -g (0.05 + 0.3 |v|) has an exponential for its motion, which ends."""
    rate, rest, v = 0.3 * G, 0.05 / 0.3, 3.0
    end = np.log((v + rest) / rest) / rate
    t, _, speed = _motion(_block("0.05 + 0.3*abs(x_dot)*second/metre", v), way, 2.0)
    assert speed == pytest.approx(np.where(t < end, (v + rest) * np.exp(-rate * t) - rest, 0.0), abs=3e-8)


@WAYS
def test_friction_overflows_far_behind_the_stop(way: str) -> None:
    """exp(-abs(v)/w) of a side that a solver's trial step has left: w is 3000 times less than the speed at the start.

    The way is the integral of v/(g (0.2 + 0.15 exp(-v/w))) over v, with a dilogarithm.
    """
    v, w = 3.0, 0.001
    block = _block(f"0.2 + 0.15*exp(-abs(x_dot)*second/metre/{w})", v)
    _, x, speed = _motion(block, way, 2.0, tolerance=1e-6)
    assert x[-1] == pytest.approx((v**2 / 2 + w**2 * spence(1.75)) / (0.2 * G), abs=3e-6)
    assert speed[-1] == pytest.approx(0.0, abs=1e-12)


@WAYS
def test_a_patch_of_ice_takes_what_it_takes(way: str) -> None:
    """Energies at the ends of the patch: 12.5 J less 0.4 g 1.5 m, less 0.02 g 1 m, and 0.6 g holds at last."""
    left = 12.5 - G * (0.4 * 1.5 + 0.02 * 1.0)
    _, x, speed = _motion(_block("if(x > 1.5*metre, if(x < 2.5*metre, 0.02, 0.6), 0.4)", 5.0), way, 3.0)
    assert x[-1] == pytest.approx(2.5 + left / (0.6 * G), abs=3e-8)
    before = x < 1.5
    assert speed[before] ** 2 / 2 == pytest.approx(12.5 - 0.4 * G * x[before], abs=3e-7)


@WAYS
def test_a_block_slides_off_as_its_friction_fades(way: str) -> None:
    """It holds up to tan(0.3) = 0.6 - 0.1 t, and then goes g cos(0.3) 0.1 (t - t0)^3/6."""
    begin = (0.6 - np.tan(0.3)) / 0.1
    t, x, _ = _motion(_block("0.6 - 0.1*t/second", slope=0.3), way, 4.0)
    assert x == pytest.approx(G * np.cos(0.3) * 0.1 * np.maximum(t - begin, 0.0) ** 3 / 6, abs=3e-8)


@WAYS
def test_static_friction_fades_alone(way: str) -> None:
    """Held up to tan(0.3) = 0.5 - 0.2 t, the block starts with the acceleration that 0.2 leaves."""
    begin = (0.5 - np.tan(0.3)) / 0.2
    mechanism = _block("0.2", slope=0.3, static="0.5 - 0.2*t/second")
    t, x, _ = _motion(mechanism, way, 2.0)
    assert x == pytest.approx(G * (np.sin(0.3) - 0.2 * np.cos(0.3)) * np.maximum(t - begin, 0) ** 2 / 2, abs=3e-8)


@pytest.mark.parametrize("solver", ["dopri5", "moreau"])
def test_a_coefficient_below_0_ends_the_run(solver: str) -> None:
    with pytest.raises(SimulationError, match=r"the coefficient of friction of floor is -.*max\(0, \.\.\.\)"):
        lag2fmu.simulate(_block("0.5 - x/metre", 4.0), stop_time=1.0, solver=solver)


PADS = """
[mechanism]
name = "pads"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
[gravity]
acceleration = 9.81
[bodies]
block = { mass = 1, position = ["x", "y"] }
[forces]
x = "2*t"
[contacts]
smooth = { gap = "y", slip = "x_dot", friction = 0.06 }
rough = { gap = "y", slip = "x_dot", friction = 0.6 }
"""


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
@pytest.mark.parametrize(("kind", "step"), [("co-simulation", 0.1), ("co-simulation", 0.02), ("model-exchange", 0.1)])
def test_two_pads_share_the_load_as_soon_as_they_slide(solver: str, kind: str, step: float) -> None:
    """The rough pad holds all that it can; the smooth one, which bore nothing at last, has its half of the slip."""
    begin = 0.6 * G / 2
    run = lag2fmu.simulate(
        read(PADS, "pads"), stop_time=4.0, step=step, tolerance=1e-9, outputs=["x_dot"], kind=kind, solver=solver
    )
    slides = run.time > begin
    speed = run.time**2 - begin**2 - 0.33 * G * (run.time - begin)
    assert run["x_dot"][slides] == pytest.approx(speed[slides], abs=1e-7)
    assert np.abs(run["x_dot"][~slides]).max() < 1e-10


def test_two_pads_share_the_load_in_the_judge() -> None:
    times = np.linspace(0.0, 4.0, 5)
    speeds = integrate(read(PADS, "pads"), times, rtol=1e-10).trajectory["x_dot"]
    assert speeds[3:] == pytest.approx(
        [9 - (0.3 * G) ** 2 - 0.33 * G * (3 - 0.3 * G), 16 - (0.3 * G) ** 2 - 0.33 * G * (4 - 0.3 * G)], abs=1e-7
    )


FEET = """
[mechanism]
name = "feet"
[coordinates]
x = { unit = "m", velocity = 2.0 }
y = { unit = "m", velocity = 1.0 }
z = { unit = "m" }
[gravity]
acceleration = 9.81
direction = [0, 0, -1]
[bodies]
sled = { mass = 1, position = ["x", "y", "z"] }
[contacts]
ice = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.1 }
wood = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.3 }
rubber = { gap = "z", slip = ["x_dot", "y_dot"], friction = 0.5 }
"""


@pytest.mark.parametrize("way", ["co-simulation", "model-exchange", "moreau", "judge"])
def test_feet_that_slide_share_the_load_in_equal_parts(way: str) -> None:
    """Their mean coefficient, 0.3, slows the sled down along its way."""
    mechanism, names, times = read(FEET, "feet"), ["x_dot", "y_dot"], np.linspace(0.0, 0.5, 6)
    if way == "judge":
        speeds = integrate(mechanism, times, rtol=1e-10).trajectory.columns(names)
    else:
        options = {"solver": "moreau"} if way == "moreau" else {"kind": way, "tolerance": 1e-9}
        speeds = lag2fmu.simulate(mechanism, stop_time=0.5, step=0.1, outputs=names, **options).columns(names)
    left = (np.sqrt(5.0) - 0.3 * G * times) / np.sqrt(5.0)
    assert speeds == pytest.approx(left[:, None] * [2.0, 1.0], abs=1e-8)
