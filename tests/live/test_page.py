# SPDX-License-Identifier: Apache-2.0
"""The page in a browser: its contents and the effect of its controls."""

import json
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

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
BATCH_S = 0.04


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


def test_the_slider_moves_the_torque_and_the_magnet_does_not(page: Page, request: pytest.FixtureRequest) -> None:
    page.drive(60.0)
    page.slide("magnet_percent", 88.0)
    weakened_s = page.server.now_s()
    # The screenshot shows the identified flux and the restored torque.
    page.size(1440, 900, "light")
    page.until(lambda: page.server.now_s() > weakened_s + 8.0, "8 s")
    page.until(lambda: abs(page.newest("truth", "Torque") - 60.0) < 1.5, "60 N·m at the shaft")
    pictures = Path(request.config.getoption("--pictures"))
    pictures.mkdir(parents=True, exist_ok=True)
    page.run("window.scrollTo(0, 0)")
    assert page.browser.save_screenshot(str(pictures / "live.png"))
    page.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
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


def test_closing_the_page_ramps_the_torque_to_zero_and_ends_the_switching(page: Page) -> None:
    page.drive(40.0)
    page.browser.get("about:blank")
    page.browser.get(page.server.url)
    page.until(lambda: page.text("state") == "ready", "ready again")
    assert abs(page.newest("INV_Status", "TorqueCommanded")) < 0.1
    assert not page.find("torque").is_enabled()
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
    assert page.server.stand is not None
    page.server.stand.run(60.0)  # time passes without a command
    page.until(lambda: page.text("stopped") != "", "the reason")
    assert "command timed out" in page.text("stopped") and "No command for 70 ms" in page.text("stopped")
    page.until(lambda: page.text("state") == "ready", "ready")
    assert not page.find("torque").is_enabled() and page.text("torque-value") == "0.0"
    page.enable()
    assert page.text("stopped") == ""
    page.drive(20.0)


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


def test_off_discharges_the_dc_link_also_in_a_fault(page: Page) -> None:
    assert page.server.stand is not None  # type: ignore[attr-defined]
    page.server.stand.set(board_gate_fault=1)  # type: ignore[attr-defined]
    page.slide("speed_rpm", 0.0)
    page.until(lambda: page.text("state") == "fault" and page.find("off").is_enabled(), "a fault, and Off")
    page.find("off").click()
    page.until(lambda: page.text("state") == "discharge", "discharge")


def test_at_the_end_of_the_virtual_ecu_the_page_gives_the_reason_and_the_recording_can_be_written(page: Page) -> None:
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


def test_a_recording_is_an_mdf4_file_and_can_be_played_back(page: Page, replay: Callable[[Path], Server]) -> None:
    page.find("record").click()
    page.until(lambda: page.text("record") == "Stop recording", "recording")
    page.drive(30.0)
    driven_s = page.server.now_s()
    page.until(lambda: page.server.now_s() > driven_s + 2.0, "2 s")
    page.find("record").click()
    page.until(lambda: "Written" in page.text("file"), "the file")
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
