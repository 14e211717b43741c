# SPDX-License-Identifier: Apache-2.0
"""What a person sees and does on the page, done by a browser."""

import json
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest
from asammdf import MDF
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.ui import WebDriverWait

from conftest import Server

PATIENCE_S = 60.0


def _find(browser: webdriver.Chrome, name: str) -> WebElement:
    return browser.find_element(By.ID, name)


def _until(browser: webdriver.Chrome, true: Callable[[], bool], what: str) -> None:
    WebDriverWait(browser, PATIENCE_S, poll_frequency=0.05).until(lambda _: true(), f"waited for: {what}")


def _newest(browser: webdriver.Chrome, ring: str, name: str) -> float:
    script = "const r = rings[arguments[0]]; return r.data[r.names.indexOf(arguments[1]) + 1].at(-1);"
    return float(browser.execute_script(script, ring, name) or 0.0)


def _slide(browser: webdriver.Chrome, name: str, value: float) -> None:
    script = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'));"
    browser.execute_script(script, _find(browser, name), value)


def _state(browser: webdriver.Chrome) -> str:
    return _find(browser, "state").text


def _drive(browser: webdriver.Chrome, torque_Nm: float, true: Callable[[], bool], what: str) -> None:
    """Ask for torque until something holds; like a person, press Enable again when the drive has let go.

    A browser that stalls for 0.3 s on a busy computer is a dead man, a server that stalls for 30 ms a lost command.
    """

    def step() -> bool:
        if _state(browser) == "ready" and _find(browser, "enable").is_enabled():
            _find(browser, "enable").click()
        elif _find(browser, "torque").is_enabled():
            _slide(browser, "torque", torque_Nm)
        return true()

    _until(browser, step, what)


def _enable(browser: webdriver.Chrome, url: str) -> None:
    browser.get(url)
    _until(browser, lambda: _state(browser) == "standby", "standby")
    _find(browser, "ready").click()
    _until(browser, lambda: _state(browser) == "ready", "ready")
    _drive(browser, 0.0, lambda: _state(browser) == "run" and _find(browser, "torque").is_enabled(), "run, the slider")
    _slide(browser, "speed_rpm", 2000.0)
    _until(browser, lambda: _newest(browser, "INV_Status", "Speed") > 1990.0, "2000 rpm")


@pytest.fixture
def page(browser: webdriver.Chrome, serve: Callable[..., Server]) -> Server:
    """A page whose drive runs."""
    server = serve()
    _enable(browser, server.url)
    return server


def test_the_slider_moves_the_torque_and_the_magnet_does_not(
    browser: webdriver.Chrome, page: Server, request: pytest.FixtureRequest
) -> None:
    _drive(browser, 60.0, lambda: abs(_newest(browser, "INV_Status", "TorqueEstimate") - 60.0) < 1.0, "60 N·m")
    _slide(browser, "magnet_percent", 88.0)
    time.sleep(8.0)  # for the picture: the flux has been found, the torque is back
    _drive(browser, 60.0, lambda: abs(_newest(browser, "truth", "Torque") - 60.0) < 1.5, "60 N·m at the shaft")
    pictures = Path(request.config.getoption("--pictures"))
    pictures.mkdir(parents=True, exist_ok=True)
    assert browser.save_screenshot(str(pictures / "live.png"))
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def test_every_batch_that_arrives_is_drawn(browser: webdriver.Chrome, page: Server) -> None:
    """25 batches a second; two that arrive within one refresh of the screen share a drawing.

    On a busy computer they come in heaps; some stretch of 50 within a minute must be drawn as it comes.
    """
    read = "return {...fluxtrueStats}"
    first = browser.execute_script(read)

    def drawn() -> bool:
        nonlocal first
        last = browser.execute_script(read)
        batches, draws = last["batches"] - first["batches"], last["draws"] - first["draws"]
        if batches < 50:
            return False
        assert last["rows"] - first["rows"] >= 4 * batches
        first = last
        return bool(draws >= 0.8 * batches)

    _until(browser, drawn, "50 batches, 40 drawings")


def test_closing_the_page_ramps_the_torque_to_zero_and_opens_the_gates(
    browser: webdriver.Chrome, page: Server
) -> None:
    _drive(browser, 40.0, lambda: _newest(browser, "INV_Status", "TorqueEstimate") > 38.0, "40 N·m")
    browser.get("about:blank")
    browser.get(page.url)
    _until(browser, lambda: _state(browser) == "ready", "ready again")
    assert abs(_newest(browser, "INV_Status", "TorqueCommand")) < 0.1
    assert not _find(browser, "torque").is_enabled()


def test_a_second_page_looks_but_does_not_touch(browser: webdriver.Chrome, page: Server) -> None:
    first = browser.current_window_handle
    _slide(browser, "torque", 20.0)
    browser.switch_to.new_window("tab")
    browser.get(page.url)
    # The first page may be asleep in the background: the second says so before that matters.
    _until(browser, lambda: _state(browser) in ("run", "ready"), "a state")
    browser.execute_script("send({type: 'torque', torque_Nm: 90})")
    _until(browser, lambda: "hand on the slider" in _find(browser, "message").text, "a refusal")
    browser.close()
    browser.switch_to.window(first)


def test_calibration_values_are_read_written_and_refused(browser: webdriver.Chrome, page: Server) -> None:
    _find(browser, "tune-read").click()
    _until(browser, lambda: len(browser.find_elements(By.CSS_SELECTOR, "#tuning tr")) >= 6, "the values")
    script = "const i = document.querySelector('#tuning input[name=observer_m]'); i.value = arguments[0];" \
             "i.dispatchEvent(new Event('change'));"  # fmt: skip
    browser.execute_script(script, 3.5)
    _until(browser, lambda: _find(browser, "message").text == "observer_m = 3.5000", "the new value")
    browser.execute_script(script, 9)
    _until(browser, lambda: "refused by the ECU" in _find(browser, "message").text, "a refusal")
    assert "allowed: 2 … 4" in _find(browser, "message").text


def test_a_recording_is_an_mdf4_file_and_can_be_played_back(
    browser: webdriver.Chrome, page: Server, serve: Callable[..., Server]
) -> None:
    _find(browser, "record").click()
    _until(browser, lambda: _find(browser, "record").text == "Stop", "recording")
    _drive(browser, 30.0, lambda: _newest(browser, "INV_Status", "TorqueEstimate") > 28.0, "30 N·m")
    time.sleep(2.0)
    _find(browser, "record").click()
    _until(browser, lambda: "written" in _find(browser, "file").text, "the file")
    (path,) = page.records.glob("*.mf4")
    with MDF(path) as log:
        assert log.get("CAN_DataFrame").samples.size > 500
    replay = serve("--replay", str(path))
    browser.get(replay.url)
    _until(browser, lambda: _newest(browser, "INV_Status", "TorqueEstimate") > 20.0, "the drive")
    assert not _find(browser, "enable").is_enabled()
    browser.execute_script("send({type: 'drive'})")
    _until(browser, lambda: "obeys nobody" in _find(browser, "message").text, "a refusal")


def _status(url: str, **headers: str) -> int:
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def test_other_hosts_and_other_pages_are_refused(serve: Callable[..., Server]) -> None:
    url = serve().url
    assert _status(url) == 200
    assert _status(url, Host="drive.example") == 403
    assert _status(url, Origin="http://drive.example") == 403
    assert _status(url + "ws", Origin="http://localhost:1") == 403
    assert _status(url + "ws") == 403
    assert _status(url + "static/../cli.py") == 404


def test_garbage_from_a_page_is_answered_and_moves_nothing(browser: webdriver.Chrome, page: Server) -> None:
    for message in ([], {"type": "torque"}, {"type": "torque", "torque_Nm": "40"}, {"type": "launch"},
                    {"type": "knob", "name": "speed_rpm", "value": None}):  # fmt: skip
        browser.execute_script("say('')")
        browser.execute_script("socket.send(arguments[0])", json.dumps(message))
        _until(browser, lambda: _find(browser, "message").text != "", f"an answer to {message}")
    browser.execute_script("say(''); socket.send('{')")
    _until(browser, lambda: _find(browser, "message").text != "", "an answer to half an object")
    assert _state(browser) in ("run", "ready")  # the latter after a stall of this computer
    assert abs(_newest(browser, "INV_Status", "TorqueCommand")) < 0.1
    _drive(browser, 10.0, lambda: _newest(browser, "INV_Status", "TorqueEstimate") > 9.0, "10 N·m: it still obeys")
