"""Live pages in a real browser: they load without a word, move, react, and compute what their FMUs compute."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from browsing import Browser

import lag2fmu
from lag2fmu.fmu import Fmu
from lag2fmu.resources import bundled

pytestmark = pytest.mark.toolchain
Exported = Callable[..., Fmu]

DIFFERENCE = 1e-9
"""Between a page and its FMU, relative to the largest value of a variable: functions of two C libraries differ."""


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    started = Browser(tmp_path_factory.mktemp("chromium"))
    yield started
    started.driver.quit()


@pytest.fixture(scope="session")
def paged(tmp_path_factory: pytest.TempPathFactory, exported: Exported) -> Callable[[str], Path]:
    """The page of a bundled model, with the solver of its FMU."""
    folder = tmp_path_factory.mktemp("pages")

    def page(name: str) -> Path:
        path = folder / f"{name}.html"
        if not path.exists():
            lag2fmu.page(name, path, solver=exported(name).description.solver)
        return path

    return page


@pytest.mark.parametrize("name", bundled())
def test_a_page_computes_what_its_fmu_does(
    name: str, browser: Browser, paged: Callable[[str], Path], exported: Exported
) -> None:
    browser.open(paged(name))
    assert browser.ask("page.run.error") == ""
    fmu = exported(name)
    names = [state for q in fmu.mechanism.coordinates for state in (q.name, f"{q.name}_dot")]
    columns = browser.ask("arguments[0].map((n) => page.run.column(page.variables.find((v) => v.name === n)))", names)
    experiment = fmu.mechanism.experiment
    run = lag2fmu.simulate(fmu, stop_time=experiment.stop_time, step=experiment.step, outputs=names)
    found, expected = np.array(columns).T, run.columns(names)
    assert found.shape == expected.shape
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    assert (np.abs(found - expected) / scale).max() <= DIFFERENCE
    before = browser.ask("page.player.time")
    browser.wait(f"page.player.time !== {before}")
    assert browser.messages() == []
