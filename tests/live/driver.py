# SPDX-License-Identifier: Apache-2.0
"""A page in the browser, driven as a person does, and waited for in simulated time."""

from collections.abc import Callable
from typing import Protocol

from progress import until
from selenium import webdriver
from selenium.common.exceptions import NoSuchElementException, StaleElementReferenceException
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

TIME_OUT_S = 60.0  # of simulated time


class Served(Protocol):
    """A running server."""

    url: str

    def now_s(self) -> float: ...


class Page:
    """The page as a person sees it, and the server behind it."""

    def __init__(self, browser: webdriver.Chrome, server: Served) -> None:
        self.browser, self.server = browser, server

    def find(self, name: str) -> WebElement:
        return self.browser.find_element(By.ID, name)

    def text(self, name: str) -> str:
        return self.find(name).text

    def until(self, true: Callable[[], bool], what: str) -> None:
        """Wait for the condition in simulated time. It is not true yet while the page that loads lacks an element."""

        def so_far() -> bool:
            try:
                return true()
            except (NoSuchElementException, StaleElementReferenceException):
                return False

        until(so_far, self.server.now_s, TIME_OUT_S, what)

    def run(self, script: str, *arguments: object) -> object:
        return self.browser.execute_script(script, *arguments)

    def drawn(self, ring: str, name: str) -> list[tuple[float, float]]:
        """Times and values of a signal on the page, oldest first."""
        script = (
            "const r = fluxtrue.rings[arguments[0]]; return [r.data[0], r.data[r.names.indexOf(arguments[1]) + 1]];"
        )
        columns = self.run(script, ring, name)
        assert isinstance(columns, list)
        return list(zip(*columns, strict=True))

    def newest(self, ring: str, name: str) -> float:
        drawn = self.drawn(ring, name)
        return drawn[-1][1] if drawn else 0.0

    def newest_s(self) -> float:
        """The time of the newest drawn value."""
        drawn = self.drawn("INV_Status", "Speed")
        return drawn[-1][0] if drawn else 0.0

    def slide(self, name: str, value: float) -> None:
        script = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'));"
        self.run(script, self.find(name), value)

    def press(self, name: str) -> None:
        """Scroll a button to the middle, where the header does not cover it, and click it."""
        self.run("arguments[0].scrollIntoView({block: 'center'})", self.find(name))
        self.find(name).click()

    def drive(self, torque_Nm: float) -> None:
        """Move the slider once and wait for the torque."""
        assert self.find("torque").is_enabled()
        self.slide("torque", torque_Nm)
        for signal, within_Nm in (("TorqueCommanded", 0.1), ("TorqueEstimated", 1.0)):
            self.until(lambda signal=signal, within_Nm=within_Nm:
                       abs(self.newest("INV_Status", signal) - torque_Nm) < within_Nm, f"{torque_Nm} N·m")  # fmt: skip

    def enable(self) -> None:
        """Press Enable once and wait until the drive runs."""
        self.find("enable").click()
        self.until(lambda: self.text("state") == "run" and self.find("torque").is_enabled(), "run, the slider")

    def hide(self, hidden: bool) -> float:
        """Report the page as hidden or visible to its script; the time of the newest drawn value."""
        newest_s = self.run("Object.defineProperty(document, 'hidden', {value: arguments[0], configurable: true});"
                            "document.dispatchEvent(new Event('visibilitychange'));"
                            "return fluxtrue.rings.INV_Status.data[0].at(-1);", hidden)  # fmt: skip
        assert isinstance(newest_s, float)
        return newest_s

    def hide_only(self, hidden: bool) -> None:
        """Report the page as hidden or visible, on a page without charts."""
        self.run("Object.defineProperty(document, 'hidden', {value: arguments[0], configurable: true});"
                 "document.dispatchEvent(new Event('visibilitychange'));", hidden)  # fmt: skip

    def size(self, width: int, height: int, theme: str) -> None:
        """Another screen, in another theme of the system."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        media = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", media)

    def pass_time(self, seconds: float) -> None:
        """Let simulated time pass."""
        begin_s = self.server.now_s()
        self.until(lambda: self.server.now_s() > begin_s + seconds, f"{seconds} s")

    def enabled(self) -> set[str]:
        """The visible controls that act."""
        controls = self.browser.find_elements(By.CSS_SELECTOR, "button:enabled, input:enabled, select:enabled")
        return {control.get_attribute("id") or control.get_attribute("name") or "" for control in controls
                if control.is_displayed()}  # fmt: skip
