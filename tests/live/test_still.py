# SPDX-License-Identifier: Apache-2.0
"""Whatever arrives, no control of the page moves: a press meets the control at which it was aimed.

The places of all controls are compared from frame to frame while a drive's values arrive and while a test replaces
what the server sends by the extremes: longest texts, all faults, largest numbers, silence. Counted in frames and
batches, in simulated time.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import Server
from driver import TIME_OUT_S, Page
from progress import polled, until
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

WATCH, ARRIVALS = (Path(__file__).with_name(name).read_text() for name in ("still.js", "arrivals.js"))
BATCHES = 90  # each extreme has come with each other one
PLANTED = 12  # each text has come and gone
WIDTHS = ((1440, 900), (1024, 768), (390, 844))
SCOPE = {"type": "scope_arm", "signals": ["i_d_A", "i_q_A"], "trigger": "above", "on": "i_q_A", "level": -390,
         "before": 0.5, "samples": 64, "divisor": 1, "repeat": True}  # fmt: skip


@pytest.fixture
def watched(browser: webdriver.Chrome) -> Iterator[None]:
    yield from watch(browser)
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def watch(browser: webdriver.Chrome) -> Iterator[None]:
    """Every page that is opened watches its controls."""
    added = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
    yield
    browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def begin(page: Page) -> None:
    """The present places are those at which the controls must stay."""
    page.run("still.begin()")


def arrive(page: Page, is_sometimes_silent: bool, further: str = "") -> None:
    """From now on, the extremes arrive."""
    page.run(f"const SILENT = {str(is_sometimes_silent).lower()};\n{ARRIVALS}{further}")


def batches(page: Page) -> int:
    found = page.run("return fluxtrue.stats.batches")
    assert isinstance(found, int)
    return found


def moved(page: Page, wait: Callable[[Callable[[], bool], str], None], count: int = BATCHES) -> list[str]:
    """The controls that have moved, after so many more batches."""
    before = batches(page)
    wait(lambda: batches(page) >= before + count, f"{count} batches")
    found: Any = page.run("return still.found()")
    assert found["samples"] >= count // 2 and found["controls"] >= 3, found
    return [str(one) for one in found["moved"]]


def capture_again_and_again(page: Page) -> None:
    """The oscilloscope repeats a capture."""
    page.run("fluxtrue.send(arguments[0])", SCOPE)
    page.until(lambda: page.find("scope-result").is_displayed(), "a capture")


def read(page: Page) -> None:
    page.press("tune-read")
    page.until(lambda: page.text("tuning") != "", "the values")


def shown(page: Page, width: int, height: int) -> None:
    """Another screen; the page has been drawn on it."""
    page.size(width, height, "light")
    before = batches(page)
    page.until(lambda: batches(page) >= before + 3, "three batches")


@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_no_control_moves_while_values_faults_and_messages_arrive(
    watched: None, page: Page, width: int, height: int
) -> None:
    shown(page, width, height)
    read(page)
    page.drive(20.0)
    capture_again_and_again(page)
    begin(page)
    assert not moved(page, page.until, 25), "a drive at 20 N·m, captured again and again"
    page.server.stand.set(board_gate_fault=1)  # type: ignore[attr-defined]
    page.until(lambda: "Check the gate driver" in page.text("faults"), "the fault")
    assert not moved(page, page.until, 10), "a fault"
    page.press("freeze")
    page.until(lambda: page.find("freeze-frame").is_displayed(), "the freeze frame")
    begin(page)
    arrive(page, False)
    assert not moved(page, page.until), "all that can arrive"
    arrive(page, True)
    assert not moved(page, page.until), "all that can arrive, and silence"
    page.run("still.tamper = null; document.getElementById('notices').style.height = 'auto'")
    begin(page)
    arrive(page, False)
    planted = moved(page, page.until, PLANTED)
    assert any(one.startswith("speed_rpm") for one in planted), "a movement that was planted is found"


def test_a_press_during_which_everything_arrives_has_its_effect_once(watched: None, page: Page) -> None:
    """The mouse is pressed, some batches of extremes arrive, the mouse is released."""
    shown(page, *WIDTHS[-1])
    read(page)
    page.run("window.saves = 0; HTMLAnchorElement.prototype.click = () => { window.saves++; };")
    button = page.find("tune-save")
    page.run("arguments[0].scrollIntoView({block: 'center'})", button)
    for press, count in enumerate((3, 4, 5, 6), 1):
        ActionChains(page.browser).move_to_element(button).click_and_hold().perform()
        arrive(page, False)
        before = batches(page)
        page.until(lambda before=before, count=count: batches(page) >= before + count, "batches")
        ActionChains(page.browser).release().perform()
        assert page.run("return window.saves") == press


def test_a_repeated_capture_leaves_charts_cursors_and_zoom(page: Page) -> None:
    capture_again_and_again(page)
    page.find("scope-b").send_keys(Keys.ARROW_LEFT)
    page.press("scope-zoom")
    page.run("window.chart = document.querySelector('#scope-charts canvas')")
    placed = "return [document.getElementById('scope-b').value, fluxtrue.ranges().slice(5)]"
    before = page.run(placed)
    for _ in range(2):
        number = page.text("scope-told")
        page.until(lambda number=number: page.text("scope-told") != number, "another capture")
    assert page.run(placed) == before
    assert page.run("return window.chart.isConnected")


def test_a_recorded_drive_moves_no_control(watched: None, page: Page, replay: Callable[[Path], Server]) -> None:
    page.find("record").click()
    page.until(lambda: page.text("record") == "Stop recording", "recording")
    page.pass_time(8.0)
    page.find("record").click()
    page.until(lambda: "Written" in page.text("file"), "the file")
    (path,) = page.server.records.glob("*.mf4")  # type: ignore[attr-defined]
    played = Page(page.browser, replay(path))

    def wait(true: Callable[[], bool], what: str) -> None:
        until(true, lambda: float(batches(played)), 40.0 * TIME_OUT_S, what)

    for width, height in WIDTHS:
        played.browser.get("about:blank")
        played.size(width, height, "light")
        played.browser.get(played.server.url)
        polled(lambda: batches(played) > 3)
        begin(played)
        arrive(played, True)
        assert not moved(played, wait), f"{width} px"
        assert len(played.browser.find_elements(By.CSS_SELECTOR, "#replay input")) == 1
