# SPDX-License-Identifier: Apache-2.0
"""What a page shows and how it is read: ranges of the charts, oscilloscope, keyboard, contrast, a silent inverter.

One page serves all tests of this file, in their order; the last one leaves an inverter that has been silent.
"""

import contextlib
import io
import urllib.request
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from asammdf import MDF
from conftest import Server, connected
from driver import Page
from progress import HANG_S
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

PERIOD_MS = 0.1
CONTRAST = Path(__file__).with_name("contrast.js").read_text()
DRAWS = "return fluxtrue.stats.draws"
BLUE = """const canvas = document.querySelector('#scope-charts canvas'), { width, height } = canvas;
const colors = canvas.getContext('2d').getImageData(0, 0, width, height).data;
return colors.filter((value, k) => k % 4 === 0 && value < 60 && colors[k + 2] > 150).length;"""
FOCUSED = """const e = document.activeElement, style = getComputedStyle(e), place = e.getBoundingClientRect();
return [e.id || e.name || e.ariaLabel, e.closest('.card, header, #charts')?.id || 'header', place.top, place.bottom,
        style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2 && place.bottom <= innerHeight
        && (e.closest('header') || place.top >= document.querySelector('header').getBoundingClientRect().bottom)];"""
CAPTION_PX = 18.2  # one line
CHARTS = """return [...document.querySelectorAll('#charts figure')].map((figure) => {
    const place = (what) => figure.querySelector(what).getBoundingClientRect();
    const box = place('.plot'), canvas = place('canvas'), { bottom } = figure.getBoundingClientRect();
    return [figure.id, place('figcaption').height, bottom - box.bottom,
            [box.width - canvas.width, box.height - canvas.height], bottom];
});"""
THEME = "return document.documentElement.dataset.theme"
MARKS = """const probe = document.body.appendChild(document.createElement('i'));
const found = [...document.querySelectorAll('#charts .legend i')].map((mark, k) => {
    probe.style.color = `var(--${arguments[0][k]})`;
    return [getComputedStyle(mark).borderTopColor, getComputedStyle(probe).color];
});
probe.remove();
return found;"""
REACHED = """return [...document.querySelectorAll('button:enabled, input:enabled, select:enabled, [tabindex]')]
    .filter((e) => e.getClientRects().length && e.tabIndex >= 0).map((e) => e.id || e.name || e.ariaLabel);"""


@pytest.fixture(scope="module")
def view(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory,
         browser: webdriver.Chrome) -> Iterator[Page]:  # fmt: skip
    """A page whose inverter is in standby at first."""
    program = Path(request.config.getoption("--vecu"))
    with contextlib.contextmanager(connected)(program, tmp_path_factory.mktemp("views")) as server:
        page = Page(browser, server)
        page.size(1440, 900, "light")
        browser.get(server.url)
        page.until(lambda: page.text("state") == "standby", "standby")
        yield page
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_and_lines_have_the_contrast_of_wcag_aa(view: Page, theme: str) -> None:
    view.size(1440, 900, theme)
    view.run("fluxtrue.say('A message')")
    found = view.run(CONTRAST)
    assert isinstance(found, list) and len(found) > 80
    assert {"Enable", "Speed", "N·m"} <= {text for text, _, _ in found}
    low = [f"{text}: {ratio:.2f}, at least {least}" for text, ratio, least in found if ratio < least]
    assert not low, "\n".join(low)
    view.run("fluxtrue.say('')")


def test_every_active_control_is_reached_by_tab_in_the_order_in_which_it_is_read(view: Page) -> None:
    view.size(1440, 900, "light")
    view.browser.get(view.server.url)
    view.until(lambda: view.text("state") == "standby" and view.find("scope-arm").is_enabled(), "standby")
    expected = view.run(REACHED)
    assert isinstance(expected, list) and expected[:4] == ["record", "theme", "stop", "ready"]
    assert {"charts-pause", "scope-arm", "scope-kind", "tune-read", "speed_rpm"} <= set(expected)
    reached = []
    for _ in expected:
        ActionChains(view.browser).send_keys(Keys.TAB).perform()
        focused = view.run(FOCUSED)
        assert isinstance(focused, list)
        reached.append(focused)
    assert [name for name, *_ in reached] == expected
    assert not [name for name, _, _, _, seen in reached if not seen], "no focus that is seen"
    for (before, card, top, _, _), (after, other, _, bottom, _) in pairwise(reached):
        assert card != other or bottom > top, f"{after} stands above {before}"


def test_the_charts_fill_the_first_screen_and_their_legends_have_the_colours_of_the_lines(view: Page) -> None:
    view.size(1440, 900, "light")
    view.run("window.scrollTo(0, 0)")
    found = view.run(CHARTS)
    assert isinstance(found, list) and len(found) == 5
    for name, caption, below, missing, bottom in found:
        assert caption < 1.6 * CAPTION_PX, f"{name}: no second line for a legend that shows nothing"
        assert below < 12.0 and max(map(abs, missing)) < 1.0, f"{name}: the picture fills its figure"
        assert bottom <= 900.0, f"{name}: seen without scrolling"
    assert max(bottom for *_, bottom in found) > 880.0, "no empty band below the charts"
    for theme in ("light", "dark"):
        view.size(1440, 900, theme)
        view.until(lambda theme=theme: view.run(THEME) == theme, theme)
        marks = view.run(MARKS, ["quiet", "blue", "orange", "green", "green", "violet", "violet"])
        assert isinstance(marks, list) and len(marks) == 7
        assert not [mark for mark in marks if mark[0] != mark[1]], "as the lines of charts.js"
    view.size(1440, 900, "light")


def ranges(page: Page) -> list[list[float]]:
    """What the charts show, from … to."""
    found = page.run("return fluxtrue.ranges()")
    assert isinstance(found, list)
    return found


def newest_to(page: Page) -> float:
    return ranges(page)[0][1]


def count(page: Page, script: str) -> int:
    """A whole number of the page."""
    found = page.run(script)
    assert isinstance(found, int)
    return found


def test_a_range_that_is_dragged_over_is_shown_while_the_time_goes_on(view: Page) -> None:
    view.until(lambda: view.newest_s() > 1.5, "1.5 s")
    view.run("window.scrollTo(0, 0)")
    overlay = view.browser.find_element(By.CSS_SELECTOR, "#chart-speed .u-over")
    width = overlay.size["width"]
    mouse = ActionChains(view.browser)
    mouse.move_to_element_with_offset(overlay, -width // 4, 0).click_and_hold()
    mouse.move_by_offset(width // 4, 0).move_by_offset(width // 4, 0).release().perform()
    view.until(lambda: view.text("charts-pause") == "Continue", "the zoom")
    shown = ranges(view)
    (begin, end), draws = shown[0], count(view, DRAWS)
    assert shown == [shown[0]] * 5, "all charts show the same range"
    assert 0.3 < end - begin < view.newest_s() - 0.1
    assert view.text("charts-text").startswith(f"Paused: {begin:.2f} … {end:.2f} s")
    view.pass_time(0.5)
    assert ranges(view) == shown, "the picture stays"
    assert count(view, DRAWS) > draws, "the page still reports"
    view.press("charts-in")
    assert np.diff(ranges(view)[0]) == pytest.approx((end - begin) / 2.0)
    view.press("charts-earlier")
    assert ranges(view)[0][1] < end
    view.press("charts-pause")
    view.until(lambda: newest_to(view) > end and view.text("charts-text") == "", "the newest values")


def test_the_cursor_of_a_chart_shows_time_and_values_and_follows_the_arrow_keys(view: Page) -> None:
    view.press("charts-pause")
    box = view.browser.find_element(By.CSS_SELECTOR, "#chart-torque .plot")
    legend = "return document.querySelector('#chart-torque .legend').textContent"
    before = view.run(legend)
    assert isinstance(before, str) and "at " not in before
    view.run("arguments[0].focus()", box)
    ActionChains(view.browser).send_keys(Keys.ARROW_LEFT).perform()
    first = view.run(legend)
    ActionChains(view.browser).send_keys(Keys.ARROW_LEFT).perform()
    second = view.run(legend)
    assert isinstance(first, str) and isinstance(second, str)
    at_s = [float(text.split("at ")[1].removesuffix(" s")) for text in (first, second)]
    begin, end = ranges(view)[0]
    assert begin < at_s[1] < at_s[0] < end
    assert "estimated0" in first, "the torque in standby"
    view.run("arguments[0].blur()", box)
    assert view.run(legend) == before
    view.press("charts-pause")


def fetched(page: Page, name: str) -> bytes:
    """A file of the server."""
    with urllib.request.urlopen(page.server.url + name, timeout=HANG_S) as answer:
        return bytes(answer.read())


def cells(page: Page) -> dict[str, list[str]]:
    """The table of the cursors: name, then A, B, B − A, unit."""
    rows = page.browser.find_elements(By.CSS_SELECTOR, "#scope-values tbody tr")
    texts = [[cell.text for cell in row.find_elements(By.TAG_NAME, "td")] for row in rows]
    return {name: values for name, *values in texts}


def arm(page: Page, trigger: str, level: str) -> None:
    """Choose two signals, 64 samples with a quarter of them before the trigger, and arm."""
    for name in ("i_d_A", "i_q_A", "torque_commanded_Nm"):
        box = page.browser.find_element(By.CSS_SELECTOR, f"#scope-signals input[name={name}]")
        if box.is_selected() != (name != "i_d_A"):
            box.send_keys(Keys.SPACE)
    for name, text in (("scope-kind", trigger), ("scope-on", "torque_commanded_Nm"), ("scope-level", level),
                       ("scope-samples", "64")):  # fmt: skip
        page.run("arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input', {bubbles: true}));",
                 page.find(name), text)  # fmt: skip
    page.press("scope-arm")


def start(page: Page) -> None:
    """Into run, turning."""
    page.find("ready").click()
    page.until(lambda: page.text("state") == "ready", "ready")
    page.enable()
    page.slide("speed_rpm", 1000.0)


def test_the_oscilloscope_captures_a_torque_step_while_the_drive_goes_on(view: Page) -> None:
    start(view)
    arm(view, "rising", "20")
    view.until(lambda: view.text("scope-text").startswith("Armed"), "armed")
    assert not view.find("scope-result").is_displayed()
    view.slide("torque", 40.0)
    view.until(lambda: view.find("scope-result").is_displayed(), "the capture")
    assert view.text("state") == "run" and view.text("stopped") == "", "the commands had no gap"
    table = np.genfromtxt(io.BytesIO(fetched(view, "capture.csv")), delimiter=",", names=True)
    assert len(table) == 64 and table["time_s"][16] == 0.0
    assert np.allclose(np.diff(table["time_s"]), 1e-3 * PERIOD_MS)
    torque = table["torque_commanded_Nm"]
    assert torque[15] < 20.0 <= torque[16]
    shown = cells(view)  # A stands at the trigger, B at the last sample
    assert float(shown["torque_commanded_Nm"][0]) == pytest.approx(torque[16], rel=1e-4)
    assert float(shown["i_q_A"][1]) == pytest.approx(table["i_q_A"][-1], rel=1e-4)
    assert shown["Time from the trigger"] == ["0", "4.7", "4.7", "ms"]
    view.find("scope-b").send_keys(Keys.ARROW_LEFT)
    assert cells(view)["Time from the trigger"][2] == "4.6"
    with MDF(io.BytesIO(fetched(view, "capture.mf4"))) as log:
        assert np.allclose(log.get("i_q_A").samples, table["i_q_A"], rtol=1e-8)


def test_a_capture_is_drawn_zoomed_into_and_seen_as_a_spectrum(view: Page) -> None:
    assert count(view, BLUE) > 100
    view.press("scope-zoom")
    assert ranges(view)[5:] == [pytest.approx([0.0, 4.6])] * 2, "both charts, from A to B"
    view.press("scope-whole")
    assert ranges(view)[5:] == [pytest.approx([-1.6, 4.7])] * 2
    view.press("scope-spectrum")
    assert ranges(view)[5:] == [pytest.approx([0.0, 5000.0])] * 2
    assert cells(view)["Frequency"][3] == "Hz"
    view.press("scope-spectrum")
    view.size(390, 844, "light")
    assert count(view, "return document.documentElement.scrollWidth") == 390, "it fits a phone"
    view.size(1440, 900, "light")


def test_a_paused_capture_stays_and_a_refused_setting_is_explained(view: Page) -> None:
    view.press("scope-pause")
    before = cells(view)
    arm(view, "manual", "0")
    view.until(lambda: view.find("scope-trigger").is_enabled(), "armed")
    view.press("scope-trigger")
    view.until(lambda: "there is a newer one" in view.text("scope-told"), "the second capture")
    assert cells(view) == before and not view.find("scope-csv").is_enabled()
    view.press("scope-pause")
    view.until(lambda: view.text("scope-told") == "Capture 2", "the second capture is drawn")
    for name, text, answer in (("scope-level", "", "Level holds no number"), ("scope-samples", "4000", "1 to 3072"),
                               ("scope-level", "1e9", "torque_commanded_Nm, allowed")):  # fmt: skip
        view.run("arguments[0].value = arguments[1]", view.find(name), text)
        view.run("document.getElementById('scope-kind').value = 'rising'")
        view.press("scope-arm")
        view.until(lambda answer=answer: answer in view.text("scope-text"), answer)
        for field, value in (("scope-level", 0), ("scope-samples", 64)):
            view.run("arguments[0].value = arguments[1]", view.find(field), value)


def test_an_inverter_that_falls_silent_leaves_no_value_and_no_control_while_the_server_goes_on(view: Page) -> None:
    """The 1 kHz task of the inverter stands still; the page is connected, its time passes."""
    arm(view, "rising", "90")
    view.until(lambda: view.text("scope-text").startswith("Armed"), "armed")
    view.run("return import('/static/oscilloscope.js').then((module) => module.onScope({ text: 'refused' }))")
    drawn = count(view, DRAWS)
    view.until(lambda: count(view, DRAWS) > drawn + 2, "later states")
    assert view.text("scope-text") == "refused", "the answer to a command stays although the capture is still armed"
    assert isinstance(view.server, Server) and view.server.stand is not None
    draws = count(view, DRAWS)
    view.server.stand.set(board_task_stuck=1, board_watchdog_stuck=1)
    view.until(lambda: view.text("state") == "no bus", "silence")
    silent_s = view.server.now_s()
    assert view.enabled() <= {"theme", "record"}
    values = view.browser.find_elements(By.CSS_SELECTOR, "#numbers dd:nth-of-type(odd)")
    assert {value.text for value in values} == {"–"}
    assert view.text("torque-estimated") == view.text("torque-value") == view.text("speed-value") == "–"
    assert view.text("connection") == "no bus" and not view.find("scope-result").is_displayed()
    assert view.run("return document.body.classList.contains('stale')")
    view.until(lambda: view.server.now_s() > silent_s + 0.5, "half a second")
    assert count(view, DRAWS) > draws + 10, "the server sends, the page draws"
    assert "Nothing is received from the inverter" in view.text("stopped")
    view.server.stand.set(board_task_stuck=0, board_watchdog_stuck=0)
    view.until(lambda: view.text("connection") == "live" and view.text("torque-estimated") != "–", "values again")
