# SPDX-License-Identifier: Apache-2.0
"""The page in a browser: its contents and the effect of its controls."""

import json
import urllib.error
import urllib.request
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from asammdf import MDF
from conftest import Server
from driver import TIME_OUT_S, Page
from progress import HANG_S, polled, until
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from fluxtrue_tools.log.decode import signals_of

HAND_TIMEOUT_S = 0.3  # docs/howto/live.md
STOP_S = 0.08
OFF_S = 0.15  # after Stop, Off, or the end of the page with control
BATCH_S = 0.04
INVERTER_C = 92.5  # half the torque is left


def test_the_page_names_the_check_that_the_motor_data_failed(browser: webdriver.Chrome, refused: Server) -> None:
    page = Page(browser, refused)
    browser.get(refused.url)
    page.until(lambda: page.text("state") == "fault" and "config" in page.text("faults"), "the fault")
    page.until(lambda: "flux table value" in page.text("faults"), "the check that failed")
    lines = page.text("faults").splitlines()
    assert lines[0] == "config" and lines[1].startswith("The motor data or the port's settings failed a check")
    assert lines[3] == "flux table value"
    assert lines[4] == "A flux table contains an inductance or observer gain that is not positive."
    assert lines[5].startswith("Correct the motor data")


SOLID = """return ['torque', 'currents'].flatMap((name) => {
    const figure = document.getElementById(`chart-${name}`), canvas = figure.querySelector('canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return [...figure.querySelectorAll('.legend .solid i')].map((mark) => {
        const color = getComputedStyle(mark).borderTopColor.match(/[0-9]+/g).map(Number);
        let count = 0;
        for (let k = 0; k < data.length; k += 4) count += color.every((one, j) => data[k + j] === one);
        return count;
    });
});"""  # pixels of a chart in the colour of each solid line's legend


def drawn_again(page: Page) -> None:
    """Every chart has been drawn since."""
    before = page.run("return fluxtrue.stats.draws")
    assert isinstance(before, int)
    page.until(lambda: page.run("return fluxtrue.stats.draws") > before + 2, "charts")  # type: ignore[operator]


def shoot(page: Page, pictures: Path, name: str) -> None:
    """Screenshots of both sizes and themes; on each of them the page is no wider than the screen."""
    pictures.mkdir(parents=True, exist_ok=True)
    for width, height in ((1440, 900), (390, 844)):
        for theme in ("light", "dark"):
            page.size(width, height, theme)
            drawn_again(page)
            root = "document.documentElement"
            assert page.run(f"return {root}.scrollWidth <= {root}.clientWidth"), f"it fits {width} px"
            pixels = page.run(SOLID)
            assert isinstance(pixels, list) and len(pixels) == 3, "estimated torque, i_d, i_q"
            assert min(pixels) > 50, f"lines in the colours of their legends, {width} px, {theme}: {pixels}"
            assert page.browser.save_screenshot(str(pictures / f"{name}-{width}-{theme}.png"))
    page.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_the_slider_moves_the_torque_and_the_magnet_does_not(page: Page, request: pytest.FixtureRequest) -> None:
    page.drive(60.0)
    page.slide("magnet_percent", 88.0)
    weakened_s = page.server.now_s()
    # The screenshots show the identified flux and the restored torque.
    page.until(lambda: page.server.now_s() > weakened_s + 8.0, "8 s")
    page.until(lambda: abs(page.newest("truth", "Torque") - 60.0) < 1.5, "60 N·m at the shaft")
    page.run("window.scrollTo(0, 0)")
    shoot(page, Path(request.config.getoption("--pictures")), "live")
    assert not [entry for entry in page.browser.get_log("browser") if entry["level"] == "SEVERE"]


def test_every_batch_that_arrives_is_drawn(page: Page) -> None:
    """25 batches per second of simulated time; each is sent when the one before has been drawn."""
    read = "return {...fluxtrue.stats}"
    begin_s = page.server.now_s()  # before the first reading: simulated time goes on between the two
    first = last = page.run(read)
    assert isinstance(first, dict) and isinstance(last, dict)

    def seen() -> bool:
        nonlocal last
        last = page.run(read)
        return bool(last["batches"] - first["batches"] >= 50)

    page.until(seen, "50 batches")
    batches = last["batches"] - first["batches"]
    assert last["draws"] - first["draws"] >= batches - 1  # one may be under way
    assert last["rows"] - first["rows"] >= 4 * (batches - 1)
    # The first may have been sent before the beginning; the second was sent when the first had been drawn.
    assert page.server.now_s() - begin_s >= (batches - 2) * BATCH_S - 1e-6


def noted(page: Page, element: str, event: str) -> None:
    """When the event comes, the page keeps the time of the newest value that it has received."""
    page.run(f"{element}.addEventListener('{event}', () => "
             "localStorage.setItem('ended_s', fluxtrue.rings.INV_Status.data[0].at(-1)), {capture: true, once: true});"
             "localStorage.removeItem('ended_s')")  # fmt: skip


def is_without_torque_in_time(page: Page, how: str) -> None:
    """From OFF_S after the event that was noted there is no torque, neither estimated nor at the shaft.

    The event acts up to one batch, 0.04 s, after the newest value that the page had: the measured time is longer.
    """
    ended_s = page.run("return Number(localStorage.getItem('ended_s'))")
    assert isinstance(ended_s, int | float) and ended_s > 0.0, how
    page.until(lambda: page.newest_s() > ended_s + 2.0 * OFF_S, f"{how}: time passes")
    for ring, name in (("INV_Status", "TorqueEstimated"), ("truth", "Torque")):
        drawn = page.drawn(ring, name)
        assert max(torque for t, torque in drawn if t > ended_s) > 20.0, f"{how}: there was torque, {name}"
        late = [(t - ended_s, torque) for t, torque in drawn if t > ended_s + OFF_S and abs(torque) > 0.5]
        assert not late, f"{how}, {name}: {late}"


def again(page: Page) -> None:
    """Drive at most of the machine's torque, after any end."""
    page.until(lambda: page.find("ready").is_enabled() or page.find("enable").is_enabled(), "a state to go on from")
    if page.find("ready").is_enabled():
        page.find("ready").click()
        page.until(lambda: page.text("state") == "ready", "ready")
    page.enable()
    page.drive(125.0)


def test_off_a_page_that_goes_elsewhere_and_a_closed_tab_end_the_torque_within_150_ms(page: Page) -> None:
    page.drive(125.0)
    noted(page, "document.getElementById('off')", "click")
    page.find("off").click()
    is_without_torque_in_time(page, "Off")
    again(page)
    noted(page, "window", "pagehide")
    page.browser.get("about:blank")  # no page is left: simulated time stands until the next one comes
    page.browser.get(page.server.url)
    page.until(lambda: page.text("state") == "ready", "ready again")
    is_without_torque_in_time(page, "another address")
    assert not page.find("torque").is_enabled() and "closed or silent" in page.text("stopped")
    again(page)
    first = page.browser.current_window_handle
    page.browser.switch_to.new_window("window")
    page.browser.get(page.server.url)
    page.until(lambda: page.text("control") == "control elsewhere", "a second page")
    second = page.browser.current_window_handle
    page.browser.switch_to.window(first)
    page.until(lambda: page.newest("truth", "Torque") > 120.0, "torque")
    noted(page, "window", "pagehide")
    page.browser.close()
    page.browser.switch_to.window(second)
    is_without_torque_in_time(page, "a closed tab")
    page.until(lambda: page.text("state") == "ready" and page.text("control") == "control free", "ready")
    assert "closed or silent" in page.text("stopped")


def test_a_page_that_is_being_closed_reports_nothing_any_more(page: Page) -> None:
    """A browser first tells a page that it is left, then that it is hidden, and its script may run for some batches
    more: with each report of them simulated time, and the torque, went on."""
    page.drive(125.0)
    noted(page, "window", "pagehide")
    page.run("window.dispatchEvent(new PageTransitionEvent('pagehide'));"
             "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
             "document.dispatchEvent(new Event('visibilitychange'));")  # fmt: skip
    page.until(lambda: page.run("return fluxtrue.stats.batches") > 0 and page.text("state") == "ready", "ready again")
    page.hide_only(False)
    is_without_torque_in_time(page, "a page that is left")
    assert "closed or silent" in page.text("stopped")


def test_a_silent_page_loses_its_torque_after_300_ms_and_one_press_on_enable_continues(page: Page) -> None:
    page.drive(60.0)
    silent_s = page.hide(True)
    latest_s = HAND_TIMEOUT_S + STOP_S + 3 * BATCH_S
    page.until(lambda: page.text("state") == "ready" and page.newest_s() > silent_s + latest_s, "ready")
    after = [(t - silent_s, torque) for t, torque in page.drawn("INV_Status", "TorqueCommanded") if t > silent_s]
    # The last report of the page came with this batch or the one before.
    assert all(abs(torque - 60.0) < 0.1 for t, torque in after if t < HAND_TIMEOUT_S - 2 * BATCH_S)
    assert all(abs(torque) < 0.2 for t, torque in after if t > latest_s)
    assert "closed or silent for 0.3 s" in page.text("stopped")
    assert not page.find("torque").is_enabled() and page.text("torque-value") == "0.0"
    page.hide(False)
    page.enable()
    assert page.text("stopped") == ""
    page.drive(20.0)


def test_after_a_gap_in_the_commands_the_page_gives_the_reason_and_one_press_on_enable_continues(page: Page) -> None:
    page.drive(60.0)
    assert page.text("reasons") == "" and page.server.stand is not None
    page.server.stand.run(60.0)  # time passes without a command
    page.until(lambda: page.text("stopped") != "", "the reason")
    assert "command timed out" in page.text("stopped") and "No command for 70 ms" in page.text("stopped")
    page.until(lambda: page.text("state") == "ready", "ready")
    assert not page.find("torque").is_enabled() and page.text("torque-value") == "0.0"
    page.until(lambda: page.text("reasons") != "", "why it was refused")
    assert page.text("reasons").splitlines() == [
        "Refused: command timed out", "The command was lost while the drive was enabled.",
        "Check the bus and the load of this computer, then press Enable.",
    ]  # fmt: skip
    page.enable()
    assert page.text("stopped") == ""
    page.until(lambda: page.text("reasons") == "", "nothing is refused any more")
    page.drive(20.0)


def test_a_derated_torque_is_explained_with_what_to_do_until_its_cause_is_gone(page: Page) -> None:
    page.drive(125.0)
    assert page.text("reasons") == "" and page.server.stand is not None
    page.server.stand.set(board_inverter_C=INVERTER_C)
    page.until(lambda: page.text("reasons").startswith("Derated: inverter temperature"), "why it is derated")
    page.until(lambda: page.text("state") == "derate", "state derate")
    assert page.text("reasons").splitlines()[1:3] == [
        "The inverter is too warm.", "Let the inverter cool down, or improve its cooling.",
    ]  # fmt: skip
    page.server.stand.set(board_inverter_C=40.0)
    page.until(lambda: page.text("state") == "run" and page.text("reasons") == "", "nothing is derated any more")


def test_a_second_page_shows_values_but_cannot_command(page: Page) -> None:
    first = page.browser.current_window_handle
    page.slide("torque", 20.0)
    page.browser.switch_to.new_window("tab")
    page.browser.get(page.server.url)
    page.until(lambda: page.text("state") in ("run", "ready"), "a state")
    page.run("fluxtrue.send({type: 'torque', torque_requested_Nm: 90})")
    page.until(lambda: "another page has control" in page.text("message"), "a refusal")
    page.browser.close()
    page.browser.switch_to.window(first)


def restore(page: Page) -> None:
    """The parameters of the build, for the next test."""
    page.press("tune-restore")
    page.until(lambda: page.text("tune-text") == "All values are those of the build.", "the defaults")


def test_calibration_values_are_read_written_and_refused(page: Page) -> None:
    page.find("tune-read").click()
    page.until(lambda: len(page.browser.find_elements(By.CSS_SELECTOR, "#tuning tbody tr")) >= 6, "the values")
    script = "const i = document.querySelector('#tuning input[name=observer_m]'); i.value = arguments[0];" \
             "i.dispatchEvent(new Event('change'));"  # fmt: skip
    page.run(script, 3.5)
    page.until(lambda: page.text("message") == "Written: observer_m = 3.5", "the new value")
    page.run(script, 9)
    page.until(lambda: "refused by the ECU" in page.text("message"), "a refusal")
    assert "allowed: 2 … 4" in page.text("message")
    restore(page)


def test_an_answer_leaves_the_field_in_which_the_next_value_is_entered(page: Page) -> None:
    page.find("tune-read").click()
    page.until(lambda: len(page.browser.find_elements(By.CSS_SELECTOR, "#tuning tbody tr")) >= 6, "the values")
    field = page.browser.find_element(By.CSS_SELECTOR, "#tuning input[name=observer_m]")
    field.send_keys(Keys.CONTROL + "a")
    field.send_keys("3.5", Keys.TAB)
    page.run("document.activeElement.value = ''")
    ActionChains(page.browser).send_keys("12").perform()
    page.until(lambda: page.text("message") == "Written: observer_m = 3.5", "the answer")
    name, text = page.run("return [document.activeElement.name, document.activeElement.value]")  # type: ignore[misc]
    assert name not in (None, "", "observer_m") and text == "12"
    restore(page)


def test_off_discharges_the_dc_link_also_in_a_fault(page: Page) -> None:
    assert page.server.stand is not None  # type: ignore[attr-defined]
    page.server.stand.set(board_gate_fault=1)  # type: ignore[attr-defined]
    page.slide("speed_rpm", 0.0)
    page.until(lambda: page.text("state") == "fault" and page.find("off").is_enabled(), "a fault, and Off")
    page.find("off").click()
    page.until(lambda: page.text("state") == "discharge", "discharge")


def test_at_the_end_of_the_virtual_ecu_the_page_gives_the_reason_and_the_recording_can_be_written(
    own_page: Page,
) -> None:
    page = own_page
    assert isinstance(page.server, Server) and page.server.ecu is not None
    page.find("record").click()
    page.until(lambda: page.text("record") == "Stop recording", "recording")
    page.drive(20.0)
    page.server.ecu.stop()
    polled(lambda: "bench" in page.text("stopped"))
    assert page.text("torque-estimated") == "–" and page.text("state") == "no bus"
    assert page.enabled() == {"theme", "record"}
    page.find("record").click()
    polled(lambda: "Written" in page.text("file"))
    polled(lambda: page.enabled() == {"theme"})


def fits_a_phone(page: Page) -> None:
    """Nothing is wider than the screen, and the header's buttons lie in one line, whole."""
    assert page.run("return document.documentElement.scrollWidth") == 390
    places: Any = page.run("return [...document.querySelectorAll('h1, .actions button')].map((one) => "
                           "[one.getBoundingClientRect().x, one.getBoundingClientRect().right,"
                           " one.scrollWidth <= one.clientWidth, one.textContent]);")  # fmt: skip
    assert len(places) == 5 and all(is_whole for _, _, is_whole, _ in places), places
    assert all(right <= after for (_, right, _, _), (after, _, _, _) in pairwise([*places, (390, 0, 0, "")])), places


def test_a_recording_is_an_mdf4_file_and_can_be_played_back(page: Page, replay: Callable[[Path], Server]) -> None:
    page.find("record").click()
    page.until(lambda: page.text("record") == "Stop recording", "recording")
    page.drive(30.0)
    driven_s = page.server.now_s()
    page.until(lambda: page.server.now_s() > driven_s + 2.0, "2 s")
    page.size(390, 844, "light")
    fits_a_phone(page)
    page.find("record").click()
    page.until(lambda: "Written" in page.text("file"), "the file")
    fits_a_phone(page)
    page.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    (path,) = page.server.records.glob("*.mf4")
    with MDF(path) as log:
        assert log.get("CAN_DataFrame").samples.size > 500
    signals = signals_of(path)
    for name in ("truth.torque_mean_Nm", "XCP.torque_limited_Nm", "XCP.i_q_A"):
        assert len(signals[name]) >= 150, name
    assert abs(signals["truth.torque_mean_Nm"].iloc[-1] - 30.0) < 1.5
    assert abs(signals["XCP.torque_limited_Nm"].iloc[-1] - 30.0) < 0.2
    played = Page(page.browser, replay(path))
    played.browser.get(played.server.url)

    def wait(true: Callable[[], bool], what: str) -> None:
        """Wait in the time of the recording, which is 0 before the first sample has been drawn."""
        polled(lambda: played.newest_s() > 0.0)
        until(true, played.newest_s, TIME_OUT_S, what)

    wait(lambda: played.newest("INV_Status", "TorqueEstimated") > 20.0, "the drive")
    assert not played.find("enable").is_enabled()
    played.run("fluxtrue.send({type: 'drive'})")
    wait(lambda: "takes no commands" in played.text("message"), "a refusal")
    played.run("fluxtrue.send({type: 'pause', on: true}); fluxtrue.send({type: 'seek', position_s: 1.0})")
    polled(lambda: played.text("pause") == "Play" and abs(played.newest_s() - 1.0) < 0.05)
    assert played.drawn("truth", "Torque")


def _status(url: str, **headers: str) -> int:
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=HANG_S) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_other_hosts_and_other_pages_are_refused(server: Server) -> None:
    url = server.url
    assert _status(url) == 200
    assert _status(url, Host="drive.example") == 403
    assert _status(url, Origin="http://drive.example") == 403
    assert _status(url + "ws", Origin="http://localhost:1") == 403
    assert _status(url + "ws") == 403
    assert _status(url + "static/../cli.py") == 404


def test_an_invalid_message_from_a_page_is_answered_and_changes_nothing(page: Page) -> None:
    for message in ([], {"type": "torque"}, {"type": "torque", "torque_requested_Nm": "40"}, {"type": "launch"},
                    {"type": "knob", "name": "speed_rpm", "value": None}, {"type": "drawn", "batch": "9"}):  # fmt: skip
        page.run("fluxtrue.say('')")
        page.run("fluxtrue.sendText(arguments[0])", json.dumps(message))
        page.until(lambda: page.text("message") != "", f"an answer to {message}")
    page.run("fluxtrue.say(''); fluxtrue.sendText('{')")
    page.until(lambda: page.text("message") != "", "an answer to half an object")
    assert page.text("state") == "run"
    assert abs(page.newest("INV_Status", "TorqueCommanded")) < 0.1
    page.drive(10.0)
