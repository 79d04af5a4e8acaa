"""Live pages in a real browser: they load without a word, move, react, and compute what their FMUs compute."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from browsing import Browser, keys
from chosen import KINDS
from numpy.typing import NDArray

import lag2fmu
from lag2fmu.archives import read_text
from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.description.places import Body, Frame
from lag2fmu.description.symbols import coordinate
from lag2fmu.description.visuals import Visual
from lag2fmu.fmu import Fmu, compilers
from lag2fmu.fmu.documentation import PAGE
from lag2fmu.fmu.live.document import script
from lag2fmu.mechanism import Mechanism
from lag2fmu.resources import resource_folder
from lag2fmu.verify.page_samples import page_samples
from lag2fmu.verify.reference_files import reference_of

pytestmark = pytest.mark.toolchain
AS_USERS_GET_THEM = {"bouncing_ball", "double_pendulum", "four_bar_linkage", "woodpecker"}
"""Models whose pages have optimised modules; others are compiled in half of the time, and compute the same."""
BIOME = "@biomejs/biome@2.6.8"
DIFFERENCE = 1e-9
"""Between a page and its FMU, relative to the largest value of a variable: functions of two C libraries differ."""
DISTURBANCE = 1e-14
PAUSED = "#-paused=1"
UNBALANCED = 1e-4
"""Of the largest energy, what may be left in the balance: solvers of a tolerance of 1e-6 drift."""
BALANCE = """(() => {
    const named = (name) => page.variables.find((v) => v.name === name);
    const greatest = (column) => Math.max(...column.map(Math.abs));
    const energy = greatest(page.run.column(named("kinetic_energy") ?? named("generalized_energy")));
    const plot = page.panel.columns().find(([id]) => id === "balance-plot");
    return greatest(plot[1][0].column(page.run)) / (energy || 1);
})()"""


@pytest.fixture(scope="session")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    started = Browser(tmp_path_factory.mktemp("chromium"))
    yield started
    started.driver.quit()


@pytest.fixture
def browser(chromium: Browser) -> Iterator[Browser]:
    """A browser that rests behind the test: a page that is left alone goes on moving and takes a processor."""
    yield chromium
    chromium.driver.get("about:blank")


@pytest.fixture(scope="session")
def live(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Fmu]:
    """``live(name)``: the FMU of a bundled model with a live page, built once a session; see ``_page``."""
    folder = tmp_path_factory.mktemp("pages")
    built: dict[str, Fmu] = {}

    def build(name: str) -> Fmu:
        if name not in built:
            with pytest.MonkeyPatch.context() as patch:
                if name not in AS_USERS_GET_THEM:
                    patch.setattr(compilers, "MODULE_FLAGS", (*compilers.MODULE_FLAGS, "-Xclang", "-O0"))
                built[name] = lag2fmu.export(name, folder / f"{name}.fmu", solver=DEFAULT_SOLVER, page="live")
            _page(built[name]).write_text(read_text(built[name].path, PAGE), "utf-8")
        return built[name]

    return build


def _page(fmu: Fmu) -> Path:
    """Its page, unpacked."""
    return fmu.path.with_suffix(".html")


def _run(fmu: Fmu, names: Sequence[str], values: Mapping[str, float] | None = None) -> NDArray[np.float64]:
    """The default experiment of an FMU: the values of the variables ``names``."""
    experiment = fmu.mechanism.experiment
    arguments = {"stop_time": experiment.stop_time, "step": experiment.step, "values": values, "outputs": names}
    return lag2fmu.simulate(fmu, **arguments).columns(list(names))


@pytest.mark.parametrize("name", sorted(KINDS | {"bricard"}))
def test_a_page_computes_what_its_fmu_does(name: str, browser: Browser, live: Callable[[str], Fmu]) -> None:
    """One of each kind of code, and of each kind of part of a picture: bricard has the joints."""
    fmu = live(name)
    browser.open(_page(fmu), PAUSED)
    assert browser.ask("page.run.error") == ""
    names = [state for q in fmu.mechanism.coordinates for state in (q.name, f"{q.name}_dot")]
    columns = browser.ask("arguments[0].map((n) => page.run.column(page.variables.find((v) => v.name === n)))", names)
    found, expected = np.array(columns).T, _run(fmu, names)
    assert found.shape == expected.shape
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    difference = (np.abs(found - expected) / scale).max()
    if difference > DIFFERENCE:  # where rounding grows, it is no more than what a disturbed start makes of it
        first = fmu.mechanism.coordinates[0]
        disturbed = _run(fmu, names, {first.name: first.start + DISTURBANCE * max(1.0, abs(first.start))})
        assert difference <= 10 * (np.abs(disturbed - expected) / scale).max()
    assert browser.ask(BALANCE) < UNBALANCED
    browser.do("page.player.play()")
    browser.wait("page.player.time > 0")
    assert browser.messages() == []


def test_a_page_shows_surfaces_where_their_frames_are(browser: Browser, tmp_path: Path) -> None:
    """A box on a rotor that turns by 2 rad/s about an inclined axis, with another box that stands beside it."""
    q = coordinate("q", "rad", velocity=2.0)
    turning = Mechanism(
        "turning",
        coordinates=[q],
        frames=[Frame("mount", rotations=[("x", 0.4)]), Frame("rotor", "mount", rotations=[("z", q)])],
        bodies=[Body("rotor", 1, frame="rotor", inertia=(1, 2, 3, 0, 0, 0))],
        visuals=[
            Visual("stand", "sphere", size=(0.1,), color="#445566"),
            Visual("cover", "box", "rotor", (0.2, 0.4, 0.6), origin=(1, 0, 0), color="#112233"),
        ],
    )
    lag2fmu.page(turning, tmp_path / "turning.html")
    browser.open(tmp_path / "turning.html", PAUSED)
    browser.do("page.player.seek(1.5)")
    meshes = "page.view.parts.group.children.filter((x) => x.material.color?.getHexString() === '112233')"
    browser.wait(f"page.view.parts && Math.abs({meshes}[0].matrixWorld.elements[1]) > 1e-3")
    assert browser.ask(f"{meshes}.map((x) => x.geometry.index.count)") == [36]
    axes = np.array(browser.ask(f"{meshes}[0].matrixWorld.elements")).reshape(4, 4)[:3, :3]
    along = [np.cos(3.0), np.cos(0.4) * np.sin(3.0), np.sin(0.4) * np.sin(3.0)]
    assert axes[0] / np.linalg.norm(axes[0]) == pytest.approx(along, abs=1e-5)
    assert axes[2] / np.linalg.norm(axes[2]) == pytest.approx([0, -np.sin(0.4), np.cos(0.4)], abs=1e-5)
    assert browser.messages() == []


@pytest.fixture
def pendulum(browser: Browser, live: Callable[[str], Fmu]) -> Browser:
    """The page of a double pendulum at rest at its start."""
    browser.open(_page(live("double_pendulum")), PAUSED)
    assert browser.ask("[page.player.playing, page.player.time]") == [False, 0]
    return browser


def _column(browser: Browser, name: str) -> list[float]:
    return browser.ask("page.run.column(page.variables.find((v) => v.name === arguments[0]))", name)


def _slide(browser: Browser, name: str, value: float) -> None:
    browser.do(
        "const slider = document.querySelector(`#settings input[data-name=${arguments[0]}]`);"
        "slider.value = arguments[1]; slider.dispatchEvent(new Event('input', {bubbles: true}))",
        name,
        value,
    )
    browser.wait("page.run.done")


def test_a_slider_at_the_start_begins_another_run(pendulum: Browser) -> None:
    _slide(pendulum, "l1", 1.5)
    changed = lag2fmu.simulate("double_pendulum", values={"l1": 1.5}, outputs=["theta1"])["theta1"]
    assert np.abs(_column(pendulum, "theta1") - changed).max() < DIFFERENCE
    pendulum.wait("window.location.hash.includes('l1=1.5')")


def test_a_slider_acts_from_the_present_moment_on(pendulum: Browser) -> None:
    before = _column(pendulum, "theta1")
    pendulum.do("page.player.seek(4)")
    _slide(pendulum, "g", 15.0)
    after = _column(pendulum, "theta1")
    assert after[:401] == before[:401]
    assert abs(after[500] - before[500]) > 1e-3


def test_a_body_is_dragged_to_another_start(pendulum: Browser) -> None:
    x, y = pendulum.ask(
        "page.view.toPixels(page.view.places(page.run.pose(0), [page.drawing.handles[1][1]])[0])"
        ".map((x) => x / page.view.ratio)"
    )
    pendulum.drag("view", (x, y), (60, -40))
    pendulum.wait("page.player.playing")
    start = [_column(pendulum, name)[0] for name in ("theta1", "theta2")]
    end = np.array([np.sin(start).sum(), -np.cos(start).sum()])
    unit, scale = pendulum.ask("[page.drawing.unit, page.view.scale / page.view.ratio]")
    given = [c.start for c in lag2fmu.load("double_pendulum").coordinates]
    moved = np.array([np.sin(given).sum(), -np.cos(given).sum()]) + np.array([60, 40]) / scale * unit
    assert np.abs(end - moved).max() < 2 / scale * unit  # two pixels


def test_keys_move_the_time(pendulum: Browser) -> None:
    step = pendulum.ask("page.run.timeOf(1)")
    pendulum.press(keys().ARROW_RIGHT)
    assert pendulum.ask("page.player.time") == pytest.approx(step)
    pendulum.press(keys().END)
    assert pendulum.ask("page.player.time") == 10.0
    pendulum.press(keys().HOME)
    pendulum.press(keys().SPACE)
    assert pendulum.ask("page.player.playing") is True


def test_a_run_stays_in_grey_and_in_the_address(pendulum: Browser, live: Callable[[str], Fmu]) -> None:
    pendulum.press("g")
    pendulum.do("page.player.pause(); page.player.seek(0)")
    _slide(pendulum, "l2", 0.7)
    pendulum.wait("window.location.hash.includes('grey=1') && window.location.hash.includes('l2=0.7')")
    address = pendulum.ask("window.location.hash")
    pendulum.open(_page(live("double_pendulum")), address)
    assert pendulum.ask("page.grey.settings.size") == 0
    assert pendulum.ask("page.variables.find((v) => v.name === 'l2').index") in dict(
        pendulum.ask("[...page.run.settings]")
    )
    assert pendulum.messages() == []


def test_the_badge_compares_with_a_direct_integration(browser: Browser, tmp_path: Path) -> None:
    mechanism = lag2fmu.load("pendulum")
    lag2fmu.page(mechanism, tmp_path / "page.html", samples=page_samples(mechanism, reference_of(mechanism)))
    browser.open(tmp_path / "page.html")
    browser.wait("page.judged")
    assert "Agrees with direct integration" in browser.ask("document.getElementById('badge').textContent")


def test_a_page_is_dark_narrow_and_calm_if_asked(browser: Browser, live: Callable[[str], Fmu]) -> None:
    features = [("prefers-color-scheme", "dark"), ("prefers-reduced-motion", "reduce")]
    media = [{"name": name, "value": value} for name, value in features]
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": media})
    narrow = {"width": 380, "height": 800, "deviceScaleFactor": 2, "mobile": True}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", narrow)
    try:
        browser.open(_page(live("double_pendulum")))
        assert browser.ask("page.player.playing") is False
        assert browser.ask("getComputedStyle(document.body).backgroundColor") == "rgb(19, 26, 33)"
        assert browser.ask("document.documentElement.scrollWidth") <= 380
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_pages_are_small_and_ask_for_nothing(live: Callable[[str], Fmu]) -> None:
    text = _page(live("double_pendulum")).read_text("utf-8")
    assert len(text.encode()) < 250_000
    assert "default-src 'none'" in text
    assert not re.search(r"""(src|href)=["']https?:""", text)


def test_frames_are_drawn_in_time(browser: Browser, live: Callable[[str], Fmu]) -> None:
    """The script of a frame of a planar and of a spatial page takes less than a sixtieth of a second."""
    for name in ("double_pendulum", "heavy_top"):
        browser.open(_page(live(name)))
        browser.wait("page.times.length > 60")
        assert browser.ask("[...page.times].sort((a, b) => a - b)[page.times.length >> 1]") < 1000 / 60


def test_the_scripts_are_linted_and_formatted(tmp_path: Path) -> None:
    """As the one script that they are: what no other defines is an error, and what none uses."""
    npx = shutil.which("npx")
    if npx is None:
        pytest.skip("there is no npx")
    folder = resource_folder("templates") / "page"
    for name in ("biome.json", "page.css"):
        shutil.copy(folder / name, tmp_path)
    (tmp_path / "page.js").write_text(f"{script()}\n", "utf-8")
    done = subprocess.run([npx, "--yes", BIOME, "ci", "."], cwd=tmp_path, capture_output=True, text=True, check=False)
    if "npm error" in done.stderr and "biome" not in done.stdout:
        pytest.skip("npm has no biome to give")
    assert done.returncode == 0, done.stdout + done.stderr
