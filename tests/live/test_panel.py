# SPDX-License-Identifier: Apache-2.0
"""What makes the page a control panel that can be trusted, in a browser."""

import io
import json
import signal
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Server, end, opened
from driver import Page
from progress import HANG_S, polled, until
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from fluxtrue_tools.live.words import TO_DO, words
from fluxtrue_tools.scope.cli import FREEZE_FRAME

ALWAYS = {"theme"}  # acts without a connection
CHARTS = {"charts-pause", "charts-in", "charts-out", "charts-earlier", "charts-later"}  # change what is seen only
SCOPE = {"type": "scope_arm", "signals": ["i_q_A"], "trigger": "manual", "on": "i_q_A", "level": 0, "before": 0.5,
         "samples": 64, "divisor": 1}  # fmt: skip


def test_every_word_of_the_bus_has_advice() -> None:
    for path, advice in TO_DO.items():
        named = {name.replace("_", " ") for name in advice}
        assert {name for name, _, _ in words()[path].values()} == named, path


def test_torque_is_set_as_a_number_zeroed_and_stopped_by_escape(page: Page) -> None:
    entry = page.find("torque-entry")
    entry.send_keys("45", Keys.ENTER)
    page.until(
        lambda: page.text("torque-value") == "45.0" and page.text("torque-estimated").startswith("45."), "45 N·m"
    )
    for text, answer in (("", "holds no number"), ("133", "allowed are -132 … 132")):
        entry.clear()
        entry.send_keys(text, Keys.ENTER)
        assert answer in page.text("message")
    page.pass_time(0.3)
    assert page.text("torque-value") == "45.0"
    page.find("zero").click()
    page.until(lambda: abs(page.newest("truth", "Torque")) < 1.0 and page.text("state") == "run", "zero, still running")
    page.drive(60.0)
    entry.send_keys(Keys.ESCAPE)
    page.until(lambda: page.text("state") == "ready", "ready")
    assert page.text("stopped") == "Stop was pressed. Press Enable to go on."
    page.enable()
    assert page.text("torque-value") == "0.0"


def test_a_page_without_control_changes_nothing_but_can_stop(page: Page) -> None:
    page.drive(20.0)
    first = page.browser.current_window_handle
    page.browser.switch_to.new_window("window")
    page.browser.get(page.server.url)
    page.until(lambda: page.text("control") == "control elsewhere", "the state of control")
    assert page.text("speed-value") == "2000 rpm"
    assert page.enabled() <= {"stop", "theme", "tune-read", "freeze", *CHARTS}
    for message in ({"type": "knob", "name": "speed_rpm", "value": 0}, {"type": "record", "on": True},
                    {"type": "tune", "name": "observer_m", "value": 3}, {"type": "tune_restore"},
                    SCOPE, {"type": "scope_trigger"}, {"type": "scope_end"}):  # fmt: skip
        page.run("fluxtrue.say(''); fluxtrue.send(arguments[0])", message)
        page.until(lambda: page.text("message") == "another page has control", f"a refusal of {message}")
    page.find("stop").click()
    page.until(lambda: page.text("state") == "ready", "the stop")
    page.browser.close()
    page.browser.switch_to.window(first)
    page.until(lambda: "on another page" in page.text("stopped"), "the reason")


def test_a_disconnected_page_shows_no_value_and_no_active_control(own_page: Page) -> None:
    page = own_page
    page.drive(20.0)
    assert isinstance(page.server, Server)
    end(page.server)
    polled(lambda: page.text("connection") == "disconnected")
    assert page.enabled() <= ALWAYS
    assert page.text("torque-estimated") == page.text("torque-value") == page.text("speed-value") == "–"
    values = page.browser.find_elements(By.CSS_SELECTOR, "#numbers dd:nth-of-type(odd)")
    assert values and {value.text for value in values} == {"–"}
    assert page.text("state") == "no bus"


def saved_parameters(page: Page) -> dict[str, Any]:
    """What Save hands to the browser as a download."""
    page.run("window.saved = null;"
             "URL.createObjectURL = (blob) => { blob.text().then((text) => { window.saved = text; }); return ''; };"
             "HTMLAnchorElement.prototype.click = function () { window.savedName = this.download; };")  # fmt: skip
    page.find("tune-save").click()
    page.until(lambda: bool(page.run("return window.saved !== null")), "the file's content")
    assert page.run("return window.savedName") == "parameters.json"
    content = json.loads(str(page.run("return window.saved")))
    assert content["format"] == "fluxtrue-parameters"
    assert isinstance(content, dict)
    return content


def test_a_saved_file_keeps_its_url_until_the_next_one_is_saved(page: Page) -> None:
    """The browser may begin with a download after the page's function has returned."""
    page.find("tune-read").click()
    page.until(lambda: page.text("tuning") != "", "the values")
    page.run("window.revoked = []; window.clicked = undefined;"
             "URL.revokeObjectURL = (url) => { window.revoked.push(url); };"
             "HTMLAnchorElement.prototype.click = function () { window.clicked = this.href; };")  # fmt: skip
    page.find("tune-save").click()
    assert str(page.run("return window.clicked")).startswith("blob:")
    assert not page.run("return window.revoked.includes(window.clicked)")
    page.run("window.first = window.clicked;")
    page.find("tune-save").click()
    assert page.run("return window.clicked !== window.first")
    assert page.run("return window.revoked.includes(window.first)")


def test_save_acts_as_soon_as_the_values_are_shown(page: Page) -> None:
    """Not only from the next batch on: the press before it would be lost."""
    page.run("new MutationObserver((_, watch) => {"
             "  window.unsaved = document.getElementById('tune-save').disabled; watch.disconnect();"
             "}).observe(document.querySelector('#tuning tbody'), {childList: true});")  # fmt: skip
    page.find("tune-read").click()
    page.until(lambda: page.text("tuning") != "", "the values")
    assert page.run("return window.unsaved") is False


def test_parameters_are_written_back_saved_loaded_and_restored(page: Page, tmp_path: Path) -> None:
    page.find("tune-read").click()
    page.until(lambda: "those of the build" in page.text("tune-text") and page.text("tuning") != "", "the values")
    saved = saved_parameters(page)
    assert page.run("return document.querySelectorAll('#tuning input').length") == len(saved["values"]) > 1
    file = tmp_path / "written.json"
    file.write_text(json.dumps(saved))
    page.find("tune-file").send_keys(str(file))
    page.until(lambda: page.text("message").startswith("Nothing changed"), "all written back")

    page.run("const i = document.querySelector('#tuning input[name=observer_m]'); i.value = '';"
             "i.dispatchEvent(new Event('change'));")  # fmt: skip
    page.until(lambda: "nothing was written" in page.text("message"), "no write")
    file.write_text(json.dumps({"format": "fluxtrue-parameters", "values": {"observer_m": 3.5}}))
    page.find("tune-file").send_keys(str(file))
    page.until(lambda: page.text("message") == "Written: observer_m = 3.5", "the file")
    assert page.text("tune-text").startswith("1 of ")
    assert saved_parameters(page)["values"]["observer_m"] == 3.5
    file.write_text(json.dumps({"format": "fluxtrue-parameters", "values": {"observer_m": 2.5, "nothing": 1}}))
    page.find("tune-file").send_keys(str(file))
    page.until(lambda: "no calibration value 'nothing'" in page.text("message"), "a refusal")
    assert page.browser.find_element(By.CSS_SELECTOR, "#tuning input[name=observer_m]").get_attribute("value") == "3.5"
    page.find("tune-restore").click()
    page.until(lambda: page.text("tune-text") == "All values are those of the build.", "the defaults")


def test_a_fault_is_explained_and_its_freeze_frame_drawn(page: Page) -> None:
    page.drive(20.0)
    page.server.stand.set(board_gate_fault=1)  # type: ignore[attr-defined]
    page.until(lambda: "Check the gate driver" in page.text("faults"), "the explanation")
    page.find("freeze").click()
    page.until(lambda: page.find("freeze-frame").is_displayed(), "the frame")
    assert len(page.browser.find_elements(By.CSS_SELECTOR, "#freeze-charts canvas")) == 5
    assert "in state run" in page.text("freeze-text")
    the_freeze_frame_at_pwm_rate_is_drawn_exported_and_discarded(page)


def the_freeze_frame_at_pwm_rate_is_drawn_exported_and_discarded(page: Page) -> None:
    """Nothing was armed before the fault."""
    page.until(lambda: page.text("scope-told").startswith("Freeze frame "), "the frame at PWM rate")
    assert "A fault has left these periods" in page.text("scope-text")
    with urllib.request.urlopen(page.server.url + "capture.csv", timeout=HANG_S) as answer:
        table = np.genfromtxt(io.BytesIO(answer.read()), delimiter=",", names=True)
    assert len(table) == 64 and table.dtype.names == ("time_s", *FREEZE_FRAME)
    assert np.allclose(table["time_s"], 1e-4 * (np.arange(64) - 32)), "32 before the trigger, 32 from it on"
    # Currents for 20 N·m until the fault, none soon after it.
    assert table["i_q_A"][:32].min() > 10.0 and abs(table["i_q_A"][-8:]).max() < 5.0
    units = {row.text.split()[0]: row.text.split()[-1]
             for row in page.browser.find_elements(By.CSS_SELECTOR, "#scope-values tbody tr")}  # fmt: skip
    assert {units[name] for name in FREEZE_FRAME} == {"A", "V", "rad/s", "°"}
    assert units["omega_rad_s"] == "rad/s"
    first, last = page.run("return fluxtrue.ranges().at(-1)")  # type: ignore[misc]
    assert (first, last) == pytest.approx((-3.2, 3.1)), "the trigger is at 0"
    assert page.find("scope-csv").is_enabled() and page.find("scope-mf4").is_enabled()
    page.press("scope-arm")
    page.until(lambda: page.text("scope-text").startswith("Nothing was armed: A fault has left"), "a refusal")
    page.press("scope-end")
    page.until(lambda: page.text("scope-text") == "The inverter holds no capture any more.", "the end")
    page.press("scope-arm")
    page.until(lambda: page.text("scope-text").startswith("Armed"), "armed")


def in_sight(page: Page, *names: str) -> None:
    """Whole on a phone's screen; and the page is no wider than the screen."""
    for name in names:
        x, right, y, bottom = page.run(
            "const place = document.getElementById(arguments[0]).getBoundingClientRect();"
            "return [place.x, place.right, place.y, place.bottom];",
            name,
        )  # type: ignore[misc]
        assert x >= 0 and right <= 390 and y >= 0 and bottom <= 844, name
    assert page.run("return document.documentElement.scrollWidth") == 390


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_phone_shows_torque_state_stop_and_off_without_scrolling(
    browser: webdriver.Chrome, server: Server, theme: str, request: pytest.FixtureRequest
) -> None:
    page = opened(browser, server)
    page.size(390, 844, theme)
    page.until(lambda: page.run("return document.documentElement.dataset.theme") == theme, "the theme")
    in_sight(page, "state", "stop", "off", "torque-estimated", "torque-value", "torque", "enable")
    if page.text("state") != "ready":
        page.find("ready").click()
    page.until(lambda: page.text("state") == "ready", "ready")
    page.run("window.scrollTo(0, document.documentElement.scrollHeight)")
    assert page.run("return scrollY > innerHeight"), "the end of the page"
    in_sight(page, "state", "stop", "off")
    page.find("off").click()
    page.until(lambda: page.text("state") in ("discharge", "standby"), "Off acts from there")
    sizes = page.run("return [...document.querySelectorAll('body *')].filter((e) => e.children.length === 0 &&"
                     "e.textContent.trim()).map((e) => [parseFloat(getComputedStyle(e).fontSize), e.id])")  # fmt: skip
    assert isinstance(sizes, list) and max(sizes)[1] == "torque-estimated"
    page.find("theme").click()
    assert page.text("theme-name") == "light"
    page.run("localStorage.clear()")
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_commands_go_on_while_the_server_stands_still(request: pytest.FixtureRequest, free_running: Server) -> None:
    """The commands come from another process: the dead-man function ramps out, no command is lost."""
    server, browser = free_running, request.getfixturevalue("browser")
    page = Page(browser, server)
    browser.get(server.url)
    page.until(lambda: page.text("state") == "standby", "standby")
    page.find("ready").click()
    page.until(lambda: page.text("state") == "ready", "ready")
    page.enable()
    server.process.send_signal(signal.SIGSTOP)
    begin_s = server.now_s()
    until(lambda: server.now_s() > begin_s + 1.0, server.now_s, 60.0, "a second")
    server.process.send_signal(signal.SIGCONT)
    page.until(lambda: "closed or silent" in page.text("stopped"), "the reason")
    assert "command timed out" not in page.text("reasons")
