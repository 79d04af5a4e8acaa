"""A headless Chromium for the tests of live pages."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import pytest

OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--window-size=800,700",
)
OF_SOFTWARE_DRAWING = "GPU stall due to ReadPixels"
"""Chromium says so of every canvas in space where no graphics card draws it."""


def keys() -> Any:
    """The names of keys."""
    from selenium.webdriver.common.keys import Keys

    return Keys


class Browser:
    """Opens pages and asks their scripts; ``page`` is what a live page calls itself there."""

    def __init__(self, profile: Path) -> None:
        webdriver = pytest.importorskip("selenium.webdriver", reason="the browser is driven by selenium")
        chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
        if chromium is None or driver is None:
            pytest.skip("there is no chromium with chromedriver")
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for option in (*OPTIONS, f"--user-data-dir={profile}"):
            options.add_argument(option)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))

    def open(self, page: Path, state: str = "") -> None:
        """Open a live page and wait until its run is computed, with the ``state`` in its address."""
        self.driver.get("about:blank")
        self.driver.get(page.as_uri() + state)
        self.wait("page && page.run.done && page.times && page.times.length > 3")

    def ask(self, expression: str, *arguments: object) -> Any:
        """The value of an expression of JavaScript."""
        return self.driver.execute_script(f"const page = window.lag2fmu; return {expression}", *arguments)

    def do(self, statements: str, *arguments: object) -> Any:
        """Run statements of JavaScript."""
        return self.driver.execute_script(f"const page = window.lag2fmu; {statements}", *arguments)

    def press(self, key: str) -> None:
        """Press a key."""
        self.driver.find_element("tag name", "body").send_keys(key)

    def drag(self, element: str, begin: tuple[float, float], by: tuple[float, float]) -> None:
        """Drag with the mouse from a place in an element, in pixels from its upper left corner, in five moves."""
        from selenium.webdriver.common.action_chains import ActionChains

        found = self.driver.find_element("id", element)
        size = found.size
        chain = ActionChains(self.driver, duration=20)
        chain.move_to_element_with_offset(found, begin[0] - size["width"] / 2, begin[1] - size["height"] / 2)
        chain.click_and_hold()
        for _ in range(5):
            chain.move_by_offset(by[0] / 5, by[1] / 5)
        chain.release().perform()

    def wait(self, condition: str, seconds: float = 30.0) -> None:
        """Wait until an expression is true; it must become so."""
        end = time.monotonic() + seconds
        while not self.ask(condition):
            assert time.monotonic() < end, f"{condition}; the console says {self.messages()}"
            time.sleep(0.02)

    def messages(self) -> list[str]:
        """What the console has said since it was asked last."""
        said = [entry["message"] for entry in self.driver.get_log("browser")]
        return [message for message in said if OF_SOFTWARE_DRAWING not in message]
