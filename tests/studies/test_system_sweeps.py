"""Sweeps of systems of FMUs: a system is one model, and its variables are COMPONENT.VARIABLE."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from train import CAR, WAGON_ALONE

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError

xarray = pytest.importorskip("xarray", reason='the extra "sweeps" is not installed')
pytestmark = pytest.mark.fmu


@pytest.fixture(scope="module")
def train(exported, tmp_path_factory) -> Path:
    """Cart and wagon."""
    car = exported(CAR)
    values = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
    path = tmp_path_factory.mktemp("sweeps") / "train.ssp"
    connect = ("wagon.x:cart.y", "cart.f:wagon.F")
    return lag2fmu.ssp({"cart": car, "wagon": car}, path, connect=connect, values=values, stop_time=0.2)


def test_a_sweep_of_a_system(train: Path) -> None:
    """Each run is that of ``simulate``; one that fails has its reason; an executor gets systems as it gets FMUs."""
    masses = [1.0, 2.0, -1.0]
    vary = {"cart.m": masses, "wagon.x": [-0.1, 0.2]}
    chosen = {"times": [0.1, 0.2], "values": {"cart.k": 50.0}, "outputs": ["wagon.x", "cart.f"]}
    found = lag2fmu.sweep(train, vary, **chosen)
    assert found["wagon.x"].dims == ("cart.m", "wagon.x_start", "time")
    assert found["wagon.x"].attrs["units"] == "m"
    alone = lag2fmu.simulate(train, values={"cart.k": 50.0, "cart.m": 2.0, "wagon.x": 0.2}, stop_time=0.2)
    assert found["cart.f"].values[1, 1] == pytest.approx(alone.interpolated([0.1, 0.2])["cart.f"], abs=1e-12)
    assert found["failed"].values.tolist() == [[False, False], [False, False], [True, True]]
    assert "the component 'cart'" in str(found["reason"].values[2, 0])
    with ThreadPoolExecutor(1) as pool:
        again = lag2fmu.sweep(train, vary, **chosen, executor=pool)
    assert np.array_equal(found["wagon.x"].values, again["wagon.x"].values, equal_nan=True)


def test_names_that_a_system_does_not_have(train: Path) -> None:
    for chosen, message in (
        ({"vary": {"cart.mm": [1.0]}}, "'cart.mm' cannot be set"),
        ({"vary": {"cart.m": [1.0]}, "outputs": ["wagon.z"]}, "the component 'wagon' has no number 'z'"),
        ({"vary": {"cart.m": [1.0]}, "solver": "rk4"}, "have their solvers inside"),
    ):
        with pytest.raises(LoadError, match=re.escape(message)):
            lag2fmu.sweep(train, **chosen)


def test_the_command_line(train: Path, tmp_path, monkeypatch) -> None:
    """Ranges are in the units of the FMUs' mechanisms, or have their own."""
    monkeypatch.chdir(tmp_path)
    words = ["sweep", str(train), "--vary", "cart.m=500 g, 1 kg", "--set", "cart.k=0.05 N/mm", "--at-end"]
    done = CliRunner().invoke(main, [*words, "--output", "wagon.x", "-o", "o.nc"])
    assert done.exit_code == 0, done.output
    with xarray.open_dataset("o.nc") as found:
        assert found["cart.m"].values.tolist() == [0.5, 1.0]
        alone = lag2fmu.simulate(train, values={"cart.m": 0.5, "cart.k": 50.0}, stop_time=0.2)
        assert float(found["wagon.x"][0]) == pytest.approx(alone["wagon.x"][-1], abs=1e-12)
