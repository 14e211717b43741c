# SPDX-License-Identifier: Apache-2.0
"""The wizard in a browser, from an unknown motor on the virtual ECU to a torque that is true.

One page serves all tests of this file, in their order. Simulated time waits for the page, so that neither is late.
"""

import io
import os
import re
import socket
import tomllib
import urllib.request
import zipfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from built import simulation_like
from conftest import ROOT, Server, end, launch
from driver import Page
from progress import HANG_S, polled, until
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from test_still import WIDTHS, arrive, begin, moved, shown, watch
from test_views import CONTRAST, FOCUSED, REACHED

from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.on_the_bus import Bench as Terminals
from fluxtrue_tools.commission.score import score
from fluxtrue_tools.commission.steps import Found, announcement, chosen
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.wizard.link import Measuring
from fluxtrue_tools.live.wizard.process import Job, Setup
from fluxtrue_tools.motor.flux_map import load_flux_map
from fluxtrue_tools.motor.flux_model import SplineModel
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.library import FluxMap, Loop
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu

NAMEPLATE = ROOT / "tests" / "motors" / "unknown"
NAME, SEED = "saturated", 12
R_SHARE, MAP_RMS = 0.01, 0.01
STEP_S = 300.0  # of simulated time, for a step and its repetitions
TORQUE_NM, TORQUE_SHARE = 40.0, 0.03  # the bound of 95 % of the points after a commissioning without a dynamometer
SPEEDS_RPM = (300.0, 1000.0, 2000.0)
FOUND = "accept or repeat"
BATCHES = 36  # six times all that can arrive during a step
ARRIVALS = Path(__file__).with_name("arrivals_wizard.js").read_text()
OFF_S = 0.2
CAPTION = ROOT / "docs" / "howto" / "commission.md"  # of docs/images/wizard.png
BURSTS_DIFFER, MOVED_DIFFER_DEG = 2, 0.5


@dataclass
class Bench:
    """The page, and what only the test knows of the machine."""

    page: Page
    truth: Truth
    flux_map: FluxMap | None
    pictures: Path

    @property
    def channel(self) -> Channel:
        assert isinstance(self.page.server, Server) and self.page.server.stand is not None
        return self.page.server.stand

    def state(self, step: str) -> str:
        return self.page.text(f"{step}-state")

    def press(self, step: str, what: str) -> None:
        """A button of a card."""
        self.page.until(lambda: self.page.find(f"{step}-{what}").is_enabled(), f"{step}: {what}")
        self.page.press(f"{step}-{what}")

    def wait(self, step: str, state: str) -> None:
        """Until a card is in this state; another end of the step is an error."""
        ends = {state, "no result"} if state == FOUND else {state}
        until(lambda: self.state(step) in ends, self.page.server.now_s, STEP_S, f"{step}: {state}")
        assert self.state(step) == state, self.page.text(f"{step}-refused")

    def progress_s(self, step: str) -> float:
        """How far its bar is."""
        value = self.page.run("return document.getElementById(arguments[0]).value", f"{step}-bar")
        assert isinstance(value, int | float)
        return float(value)

    def begin(self, step: str) -> None:
        """Press the button, and wait until currents flow."""
        self.press(step, "do")
        until(lambda: self.page.text("state") == "run", self.page.server.now_s, STEP_S, "run")

    def is_off(self) -> None:
        """Switching is disabled, and no current flows."""
        self.page.until(lambda: self.page.text("state") not in ("run", "derate"), "switching disabled")
        begun_s = self.page.server.now_s()
        self.page.until(lambda: self.page.server.now_s() > begun_s + OFF_S, "0.2 s")
        assert float(np.hypot(*self.channel.get("truth.i_d_A", "truth.i_q_A"))) < 1.0

    def rows(self, step: str) -> dict[str, list[str]]:
        """The table of a card."""
        script = ("return [...document.querySelectorAll(arguments[0])].map((row) => "
                  "[...row.cells].map((cell) => cell.textContent));")  # fmt: skip
        found = self.page.run(script, f"#{step}-results tbody tr")
        assert isinstance(found, list)
        return {name: values for name, *values in found}

    def shoot(self, name: str, top: str) -> None:
        """Screenshots of both sizes and themes, scrolled to an element."""
        self.pictures.mkdir(parents=True, exist_ok=True)
        for width, height, theme in ((1440, 900, "light"), (1440, 900, "dark"), (390, 844, "light"),
                                     (390, 844, "dark")):  # fmt: skip
            self.page.size(width, height, theme)
            self.page.run("document.getElementById(arguments[0]).scrollIntoView()", top)
            self.drawn(theme)
            assert self.page.browser.save_screenshot(str(self.pictures / f"wizard-{name}-{width}-{theme}.png"))
            root = "document.documentElement"
            assert self.page.run(f"return {root}.scrollWidth <= {root}.clientWidth"), "it fits the screen"
        self.page.size(1440, 900, "light")

    def drawn(self, theme: str) -> None:
        """All pictures have arrived in this theme."""
        script = "return [...document.images].every((one) => one.complete && one.naturalWidth && " \
                 "one.src.includes(arguments[0]))"  # fmt: skip
        polled(lambda: bool(self.page.run(script, theme)))


@contextmanager
def begun(pictures: Path, place: Path, browser: webdriver.Chrome, seed: int, *further: str) -> Iterator[Bench]:
    """The wizard before a hidden machine; further: options of the command."""
    unknown = motors.load(str(NAMEPLATE))
    truth, flux_map, plant = hidden.draw(NAME, seed, unknown, nameplate_of(NAMEPLATE, unknown).i_max_A,
                                         "--turning" not in further)  # fmt: skip
    machine = place / "machine.txt"
    machine.write_text(hidden.machine_text(plant, flux_map), encoding="utf-8")
    with VirtualEcu(unknown.folder.vecu, machine=machine) as ecu:
        options = (f"host={HOST}", f"port={ecu.can_port}", "tcp_tune=1")
        server = launch(place, "--motor", str(NAMEPLATE), "--commission", "--can-interface", "socketcand",
                        *(f"--can-option={one}" for one in options), "--bench", f"{HOST}:{ecu.bench_port}",
                        *further)  # fmt: skip
        server.stand, server.ecu = Channel(HOST, ecu.bench_port), ecu
        page = Page(browser, server)
        browser.get("about:blank")
        browser.get_log("browser")
        page.size(1440, 900, "light")
        browser.get(server.url)
        page.until(lambda: page.text("state") == "standby", "standby")
        yield Bench(page, truth, flux_map, pictures)
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        end(server)
        server.stand.close()


@pytest.fixture(scope="module")
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory,
          browser: webdriver.Chrome) -> Iterator[Bench]:  # fmt: skip
    pictures, place = Path(request.config.getoption("--pictures")), tmp_path_factory.mktemp("wizard")
    with begun(pictures, place, browser, SEED) as made:
        yield made


def test_without_an_interface_a_hidden_machine_is_started(tmp_path: Path) -> None:
    """The address is printed when the process that measures has been answered by the virtual ECU."""
    end(launch(tmp_path, "--motor", str(NAMEPLATE), "--commission", "--machine", NAME, "--seed", str(SEED)))


def test_the_cards_say_what_happens_and_only_the_first_step_can_be_done(bench: Bench) -> None:
    page, known = bench.page, nameplate_of(NAMEPLATE, motors.load(str(NAMEPLATE)))
    for step in chosen(("map",)):
        said = page.find(f"step-{step.name}").text
        assert announcement(step, known)[1:] in said and "s on the bus" in said
    assert [bench.state(step) for step in ("offsets", "resistance", "map", "finish")] == ["next", *["later"] * 3]
    page.until(lambda: page.find("offsets-do").is_enabled(), "the first step")
    assert page.enabled() == {"theme", "stop", "known-name", "known-psi", "known-source", "known-use", "offsets-do"}
    assert not page.find("charts").is_displayed() and not page.find("drive").find_elements(
        By.CSS_SELECTOR, "button:enabled:not([hidden])")[0].is_displayed()  # fmt: skip
    page.run("fluxtrue.send({type: 'commission_do', step: 'map'})")
    page.until(lambda: "step map: not now" in page.text("message"), "a refusal")
    bench.shoot("begin", "wizard")


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_and_lines_have_the_contrast_of_wcag_aa(bench: Bench, theme: str) -> None:
    bench.page.size(1440, 900, theme)
    found = bench.page.run(CONTRAST)
    assert isinstance(found, list) and {"Do this step", "Before the first step", "next"} <= {row[0] for row in found}
    low = [f"{text}: {ratio:.2f}, at least {least}" for text, ratio, least in found if ratio < least]
    assert not low, "\n".join(low)
    bench.page.size(1440, 900, "light")


def test_every_active_control_is_reached_by_tab(bench: Bench) -> None:
    page = bench.page
    page.browser.get(page.server.url)
    page.until(lambda: page.text("state") == "standby" and page.find("offsets-do").is_enabled(), "standby")
    expected, reached = page.run(REACHED), []
    assert expected == ["theme", "stop", "known-name", "known-psi", "known-source", "known-use", "offsets-do"]
    for _ in expected:
        ActionChains(page.browser).send_keys(Keys.TAB).perform()
        reached.append(page.run(FOCUSED))
    assert [focused[0] for focused in reached] == expected  # type: ignore[index]
    assert all(focused[4] for focused in reached), "each focus is seen"  # type: ignore[index]


@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_no_control_moves_while_a_step_reports_and_its_result_arrives(bench: Bench, width: int, height: int) -> None:
    """Of the first step, of the last one, and of the folder."""
    page, count = bench.page, len(chosen(("map",)))
    with contextmanager(watch)(page.browser):
        for active in (0, count - 1, count):
            page.browser.get("about:blank")
            page.browser.get(page.server.url)
            page.until(lambda: page.text("state") == "standby", "standby")
            shown(page, width, height)
            arrive(page, False, f"const ACTIVE = {active};\n{ARRIVALS}")
            begin(page)
            assert not moved(page, page.until, BATCHES), f"step {active}"
            if active == 0:
                page.run("for (const bar of document.querySelectorAll('.step .bar')) bar.closest('.step').append(bar);")
                begin(page)
                assert any(one.startswith("offsets-do") for one in moved(page, page.until, 12)), (
                    "planted: below results"
                )
    page.size(1440, 900, "light")
    page.browser.get("about:blank")
    page.browser.get_log("browser")  # the pictures of results that were none
    page.browser.get(page.server.url)
    page.until(lambda: page.find("offsets-do").is_enabled(), "the first step")


def test_the_magnet_is_given_with_its_source_and_a_wrong_value_is_refused(bench: Bench) -> None:
    page, magnet = bench.page, f"{1e3 * bench.truth.psi_f_Vs:.5g}"
    for name, text in (("known-psi", "-1"), ("known-source", "data sheet")):
        page.find(name).send_keys(text)
    page.find("known-source").send_keys(Keys.ENTER)
    page.until(lambda: "allowed: more than 0" in page.text("message"), "a refusal")
    page.find("known-psi").send_keys(Keys.CONTROL + "a")
    page.find("known-psi").send_keys(magnet, Keys.ENTER)
    page.until(lambda: "Used for my-motor: magnet" in page.text("known-text"), "the magnet")
    assert "(data sheet)" in page.text("known-text") and page.text("control") == "control here"


def test_a_second_page_shows_the_cards_but_cannot_start_a_step(bench: Bench) -> None:
    page, first = bench.page, bench.page.browser.current_window_handle
    page.browser.switch_to.new_window("tab")
    page.browser.get(page.server.url)
    page.until(lambda: page.text("control") == "control elsewhere", "control elsewhere")
    assert bench.state("offsets") == "next" and page.enabled() == {"theme", "stop"}
    for kind in ("commission_do", "commission_accept"):
        page.run("fluxtrue.say(''); fluxtrue.send({type: arguments[0], step: 'offsets'})", kind)
        page.until(lambda: page.text("message") == "another page has control", "a refusal")
    assert bench.state("offsets") == "next"
    page.browser.close()
    page.browser.switch_to.window(first)


def test_a_step_is_done_repeated_and_accepted_by_the_keyboard(bench: Bench) -> None:
    page = bench.page
    picture = "return document.querySelector('#offsets-pictures img')?.src"
    before = None
    for _ in range(2):
        page.until(lambda: page.find("offsets-do").is_enabled(), "the button")
        page.find("offsets-do").send_keys(Keys.ENTER)
        page.until(lambda before=before: page.run(picture) not in (None, before), "a result with its own picture")
        assert bench.state("offsets") == FOUND and page.text("offsets-do") == "Repeat"
        assert bench.state("resistance") == "later"
        before = page.run(picture)
    offsets = [bench.truth.plant[f"current_offset_A_{phase}"] for phase in "abc"]
    alpha_A = (2.0 * offsets[0] - offsets[1] - offsets[2]) / 3.0
    found, sigma, bound = bench.rows("offsets")["Offset along alpha"]
    assert abs(float(found.removesuffix(" A")) - alpha_A) < float(bound.removeprefix("± at most ").removesuffix(" A"))
    assert 0.0 < float(sigma.removesuffix(" A")) < 0.1
    page.find("offsets-accept").send_keys(Keys.SPACE)
    page.until(lambda: bench.state("offsets") == "accepted" and bench.state("resistance") == "next", "accepted")


def test_stop_in_the_middle_of_a_step_ends_it_with_switching_disabled(bench: Bench) -> None:
    page = bench.page
    bench.begin("resistance")
    until(lambda: bench.progress_s("resistance") > 3.0, page.server.now_s, STEP_S, "progress")
    page.find("stop").click()
    page.until(lambda: bench.state("resistance") == "no result", "the end of the step")
    assert page.text("resistance-refused") == "Stop was pressed."
    bench.is_off()
    assert bench.state("map") == "later" and not bench.rows("resistance"), "nothing was changed"


def test_a_hidden_page_loses_the_step(bench: Bench) -> None:
    """After 300 ms, which test_wizard_rules.py checks to the microsecond; here simulated time goes on afterwards."""
    page = bench.page
    bench.begin("resistance")
    page.hide_only(True)
    page.until(lambda: bench.state("resistance") == "no result", "the end of the step")
    assert "closed or silent for 0.3 s" in page.text("resistance-refused")
    bench.is_off()
    page.hide_only(False)


def test_closing_the_page_ends_the_step_although_no_page_is_there_for_which_time_waits(bench: Bench) -> None:
    page = bench.page
    bench.begin("resistance")
    page.browser.get("about:blank")
    polled(lambda: float(np.hypot(*bench.channel.get("truth.i_d_A", "truth.i_q_A"))) < 1.0)
    page.browser.get(page.server.url)
    page.until(lambda: bench.state("resistance") == "no result", "the end of the step")
    assert "page with control was closed" in page.text("resistance-refused")
    bench.is_off()


def test_a_refusal_is_one_message_and_the_step_can_be_done_again(bench: Bench) -> None:
    """The shaft is turned from outside."""
    page = bench.page
    bench.channel.set(imposed_speed=1.0, speed_rad_s=20.0)
    bench.press("resistance", "do")
    bench.wait("resistance", "measuring")
    bench.wait("resistance", "no result")
    assert page.text("resistance-refused") == "commission: voltage pulses refused"
    bench.is_off()
    bench.channel.set(imposed_speed=1.0, speed_rad_s=0.0)
    page.pass_time(0.1)
    bench.channel.set(imposed_speed=0.0)


def test_a_fault_ends_the_step_by_its_name_and_can_be_reset(bench: Bench) -> None:
    page = bench.page
    bench.begin("resistance")
    bench.channel.set(board_gate_fault=1)
    bench.wait("resistance", "no result")
    said = page.text("resistance-refused")
    assert "gate" in said and ("the inverter has stopped" in said or "a fault ended the voltage pulses" in said)
    bench.is_off()
    bench.channel.set(board_gate_fault=0)
    page.until(lambda: page.find("reset").is_enabled(), "the reset")
    page.press("reset")
    page.until(lambda: page.text("state") == "standby" and page.text("faults") == "none", "no fault")


def test_the_resistance_is_found_with_its_bound(bench: Bench) -> None:
    bench.press("resistance", "do")
    bench.wait("resistance", "measuring")
    assert not {"known-use", "resistance-do", "map-do"} & bench.page.enabled()
    bench.wait("resistance", FOUND)
    found, sigma, _ = bench.rows("resistance")["Resistance, beyond the sensors' gains"]
    error = float(found.removesuffix(" mΩ")) / (1e3 * bench.truth.plant["r_ohm_20"]) - 1.0
    print(f"R {100 * error:+.2f} %, {sigma}, at {bench.page.server.now_s():.0f} s simulated")
    assert abs(error) <= R_SHARE and sigma.endswith(" mΩ")
    bench.shoot("resistance", "step-resistance")
    bench.press("resistance", "accept")
    bench.wait("map", "next")


def the_picture_in_the_documentation_is_of_this_code(rows: dict[str, list[str]]) -> None:
    """Its caption has the numbers that it shows. Those of two measurements differ by their noise."""
    told = re.search(r"saturated 12.*; (\d+) bursts, .* by up to ([\d.]+)°", CAPTION.read_text(encoding="utf-8"))
    assert told is not None
    bursts = int(rows["Bursts that ended early"][0].split(" of ")[1])
    moved_deg = float(rows["Movement of the rotor, electrical"][0].removesuffix("°"))
    is_of_this_code = (
        abs(bursts - int(told[1])) <= BURSTS_DIFFER and abs(moved_deg - float(told[2])) <= MOVED_DIFFER_DEG
    )
    assert is_of_this_code, f"{bursts} bursts, {moved_deg}°: copy the new picture to docs/images, and correct {CAPTION}"


def test_the_map_is_found_and_the_folder_is_written(bench: Bench) -> None:
    page = bench.page
    bench.press("map", "do")
    bench.wait("map", "measuring")
    until(lambda: bench.progress_s("map") > 10.0, page.server.now_s, STEP_S, "progress")
    bench.wait("map", FOUND)
    print(f"map at {page.server.now_s():.0f} s simulated: {bench.rows('map')}")
    bench.shoot("map", "step-map")
    the_picture_in_the_documentation_is_of_this_code(bench.rows("map"))
    assert page.text("finish-state") == "later"
    bench.press("map", "accept")
    polled(lambda: page.text("finish-state") == "finished")
    assert "-DFLUXTRUE_MOTOR=$PWD/my-motor" in page.text("finish-command")
    assert "(data sheet)" in page.text("finish-report")
    bench.shoot("finish", "finish")
    assert not [entry for entry in page.browser.get_log("browser") if entry["level"] == "SEVERE"]


def downloaded(bench: Bench, place: Path) -> Path:
    """The downloaded folder."""
    link = bench.page.find("finish-download").get_attribute("href")
    assert link is not None
    with urllib.request.urlopen(link, timeout=HANG_S) as answer:
        assert 'filename="my-motor.zip"' in answer.headers["Content-Disposition"]
        archive = zipfile.ZipFile(io.BytesIO(answer.read()))
    assert set(archive.namelist()) == {
        f"my-motor/{name}" for name in ("motor.toml", "flux_map.csv", "commission.txt", "commission.png")}  # fmt: skip
    archive.extractall(place)
    return place / "my-motor"


@pytest.fixture(scope="module")
def folder(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return downloaded(bench, tmp_path_factory.mktemp("downloaded"))


def test_the_downloaded_folder_names_its_sources(folder: Path, bench: Bench) -> None:
    assert command(["motor", "check", str(folder)]) == 0
    text = (folder / "motor.toml").read_text(encoding="utf-8")
    assert tomllib.loads(text)["machine"]["name"] == "my-motor"
    for key in ("r_ohm", "flux_map"):
        assert "measured by fluxtrue commission" in next(line for line in text.splitlines() if line.startswith(key))
    assert "given (data sheet)" in text
    known = nameplate_of(NAMEPLATE, motors.load(str(NAMEPLATE)))
    grid = load_flux_map(folder / "flux_map.csv", known.i_max_A)
    model = SplineModel(grid.id_A, grid.iq_A, grid.psi_d_Vs, grid.psi_q_Vs)
    reached = score(model, bench.truth, known.i_max_A, float(model.psi_d(0.0, 0.0)))
    print(f"map against the machine: {reached}")
    assert reached.map_rms <= MAP_RMS


def test_with_the_magnet_that_was_entered_the_built_firmware_makes_40_newton_metres_true(
    folder: Path, bench: Bench, tmp_path: Path
) -> None:
    """The entered flux linkage is the true one: at standstill nothing shows it. So this tests resistance, map, folder;
    test_wizard_turning.py drives with the flux linkage that the wizard has measured itself."""
    built = simulation_like(Path(os.environ["FLUXTRUE_BUILD_DIR"]), "unknown", folder, tmp_path / "built")
    motor = motors.read(MotorFolder("my-motor", built))
    errors = {}
    for speed in SPEEDS_RPM:
        for torque in (TORQUE_NM, -TORQUE_NM):
            plant = bench.truth.plant | {"imposed_speed": 1.0, "speed_rad_s": speed * np.pi / 30.0}
            with Loop(motor.library, plant, bench.flux_map) as loop:
                loop.set("enable", 1.0)
                loop.run_s(0.2)
                loop.set("torque_requested_Nm", torque)
                loop.run_s(1.0)
                loop.record(["truth.torque_Nm"])
                errors[speed, torque] = float(loop.run_s(0.2).mean()) / torque - 1.0
                assert loop.get("fault_word") == 0.0
    print({key: f"{100 * error:+.2f} %" for key, error in errors.items()})
    assert all(abs(error) <= TORQUE_SHARE for error in errors.values())  # not met by NaN


class Deaf:
    """In place of the wizard that is told how a step goes."""

    def progressed(self, step_s: float) -> None: ...
    def found(self, step: str, found: Found) -> None: ...
    def refused(self, step: str, why: str) -> None: ...


def test_when_the_server_crashes_the_process_that_measures_disables_switching_and_ends() -> None:
    """No page is there for which simulated time could wait; the server ends while currents flow."""
    unknown = motors.load(str(NAMEPLATE))
    known = nameplate_of(NAMEPLATE, unknown)
    (step,) = (step for step in chosen(("resistance",)) if step.name == "resistance")
    with VirtualEcu(unknown.folder.vecu) as ecu, closing(Channel(HOST, ecu.bench_port)) as channel:
        address = BusAddress("socketcand", "can0", {"host": HOST, "port": ecu.can_port, "tcp_tune": True})
        setup = Setup(Terminals(address, unknown.folder.vecu, (HOST, ecu.bench_port)), unknown.folder, known, True)
        in_step = InStep()
        measuring = Measuring(setup, [], in_step, Deaf())
        measuring.do(Job(step, ("offsets",), Found(), known))
        while measuring.status().state != "run":
            in_step.due()
            measuring.act("hand")
            in_step.done()
        assert channel.get("run_state") == [1.0]
        with socket.socket(fileno=os.dup(measuring._connection.fileno())) as pipe:
            pipe.shutdown(socket.SHUT_RDWR)
        measuring._process.join()
        assert channel.get("run_state") == [0.0]
        assert float(np.hypot(*channel.get("truth.i_d_A", "truth.i_q_A"))) < 1.0
        in_step.release()
