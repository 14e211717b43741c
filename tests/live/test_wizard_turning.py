# SPDX-License-Identifier: Apache-2.0
"""The wizard with the steps that turn the shaft, in a browser, from an unknown connection to the motor's folder.

One page serves all tests of this file, in their order.
"""

import math
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from driver import Page
from progress import polled, until
from selenium import webdriver
from selenium.webdriver.common.keys import Keys
from test_still import WIDTHS, arrive, begin, moved, shown, watch
from test_wizard import (
    ARRIVALS,
    BATCHES,
    FOUND,
    NAMEPLATE,
    SPEEDS_RPM,
    STEP_S,
    TORQUE_NM,
    TORQUE_SHARE,
    Bench,
    begun,
    downloaded,
)

from fluxtrue_tools.campaign.windows import Window
from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import driven, turning
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.sim import motor as motors

SEED = 101
OFFSET_DEG, PSI_F, INERTIA, DRAG = 0.2, 0.005, 0.03, 0.1  # the bounds of tests/commission/test_bus_turning.py
HARMONICS = ("Harmonic of the angle sensor once per turn, electrical",
             "Harmonic of the angle sensor twice per turn, electrical",
             "The larger of three and four times per turn")  # fmt: skip
SPIN_S = 600.0  # of simulated time, for the longest step


@pytest.fixture(scope="module")
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory,
          browser: webdriver.Chrome) -> Iterator[Bench]:  # fmt: skip
    pictures, place = Path(request.config.getoption("--pictures")), tmp_path_factory.mktemp("turning")
    with begun(pictures, place, browser, SEED, "--turning") as made:
        yield made


def speed_rpm(bench: Bench) -> float:
    """Of the hidden machine's shaft."""
    return abs(bench.channel.get("truth.speed_rad_s")[0]) * 30.0 / math.pi


def consent(page: Page, step: str) -> None:
    """The box of a card, once."""
    page.until(lambda: page.find(f"{step}-free").is_enabled(), f"{step}: the box")
    assert not page.find(f"{step}-free").is_selected() and not page.find(f"{step}-do").is_enabled()
    page.press(f"{step}-free")
    assert page.find(f"{step}-do").is_enabled()


def measure(bench: Bench, step: str) -> dict[str, list[str]]:
    """Consent, press, wait for the result, accept; the rows."""
    consent(bench.page, step)
    bench.press(step, "do")
    bench.wait(step, "measuring")
    begun_s = bench.page.server.now_s()
    ends = (FOUND, "no result")
    until(lambda: bench.state(step) in ends, bench.page.server.now_s, SPIN_S, f"{step}: a result")
    assert bench.state(step) == FOUND, bench.page.text(f"{step}-refused")
    assert not bench.page.find(f"{step}-free").is_selected(), "the consent was for one time"
    rows = bench.rows(step)
    print(f"{step}, {bench.page.server.now_s() - begun_s:.0f} s simulated: {rows}")
    bench.shoot(step, f"step-{step}")
    bench.press(step, "accept")
    bench.wait(step, "accepted")
    return rows


def value(text: str) -> float:
    """The number of a cell."""
    return float(text.split(maxsplit=1)[0].removesuffix("°"))


def test_a_card_that_turns_the_shaft_says_what_moves_how_fast_and_how_to_stop(bench: Bench) -> None:
    page, known = bench.page, nameplate_of(NAMEPLATE, motors.load(str(NAMEPLATE)))
    page.until(lambda: page.find("offsets-do").is_enabled(), "the first step")
    assert "need not be known" in page.text("known") and not page.find("known-psi").is_displayed()
    bench.press("offsets", "do")
    bench.wait("offsets", FOUND)
    bench.press("offsets", "accept")
    bench.wait("phases", "next")
    assert "the shaft turns slowly" in page.text("step-phases").lower()
    assert f"{turning.SPEED_SHARE * known.speed_max_rpm:.0f} rpm in both directions" in page.text("step-spin")
    said = page.text("phases-consent")
    assert "press Stop or Escape" in said and "Switching is then disabled" in said
    assert f"Beyond {turning.LIMIT_SHARE * known.speed_max_rpm:.0f} rpm" in said
    bench.shoot("consent", "step-phases")


def test_without_the_consent_nothing_turns(bench: Bench) -> None:
    page = bench.page
    assert not page.find("phases-do").is_enabled()
    page.run("fluxtrue.send({type: 'commission_do', step: 'phases'})")
    page.until(lambda: "it turns the shaft" in page.text("message"), "a refusal")
    assert bench.state("phases") == "next" and page.text("state") == "standby"


@pytest.mark.parametrize(("width", "height"), WIDTHS)
def test_no_control_moves_while_a_step_turns_the_shaft(bench: Bench, width: int, height: int) -> None:
    page = bench.page
    with contextmanager(watch)(page.browser):
        page.browser.get(page.server.url)
        page.until(lambda: page.text("state") == "standby", "standby")
        shown(page, width, height)
        arrive(page, False, f"const ACTIVE = 1;\n{ARRIVALS}")
        begin(page)
        assert not moved(page, page.until, BATCHES)
    page.size(1440, 900, "light")
    page.browser.get("about:blank")
    page.browser.get_log("browser")  # the pictures of results that were none
    page.browser.get(page.server.url)
    page.until(lambda: page.text("state") == "standby", "standby")


def test_pole_pairs_and_direction_are_found(bench: Bench) -> None:
    rows = measure(bench, "phases")
    assert int(rows["Pole pairs"][0]) == bench.truth.plant["pole_pairs"]
    assert rows["The angle sensor counts"][0] == ("against the field" if bench.truth.reversed else "with the field")


def test_stop_and_a_hidden_page_end_a_movement_and_the_shaft_runs_down(bench: Bench) -> None:
    page = bench.page
    for why, act in (("Stop was pressed.", lambda: page.find("theme").send_keys(Keys.ESCAPE)),
                     ("closed or silent for 0.3 s", lambda: page.hide_only(True))):  # fmt: skip
        consent(page, "spin")
        bench.press("spin", "do")
        bench.wait("spin", "measuring")
        until(lambda: speed_rpm(bench) > 500.0, page.server.now_s, STEP_S, "500 rpm")
        act()
        page.until(lambda: bench.state("spin") == "no result", "the end of the step")
        assert why in page.text("spin-refused")
        bench.is_off()
        page.hide_only(False)
        before_rpm = speed_rpm(bench)
        page.pass_time(1.0)
        assert speed_rpm(bench) < before_rpm or before_rpm < 1.0
        assert bench.state("drag") == "later" and not bench.rows("spin"), "nothing was changed"
        until(lambda: speed_rpm(bench) < 1.0, page.server.now_s, STEP_S, "a shaft at rest")


def test_angle_offset_and_magnet_are_found(bench: Bench) -> None:
    truth, rows = bench.truth, measure(bench, "spin")
    psi_f = value(rows["Magnet ψ_f, beyond the gain of the dc voltage"][0])
    assert abs(1e-3 * psi_f / (truth.psi_f_Vs * truth.plant["vdc_gain"]) - 1.0) <= PSI_F
    offset_deg = value(rows["Electrical angle at the sensor's zero"][0])
    assert abs(math.remainder(offset_deg - math.degrees(truth.offset_rad), 360.0)) <= OFFSET_DEG
    assert value(rows["Electrical angle at the sensor's zero"][1]) > 0.0
    for name in HARMONICS:
        found, sigma, _ = rows[name]
        assert value(found) <= OFFSET_DEG and value(sigma) > 0.0


def test_inertia_and_drag_are_found(bench: Bench) -> None:
    truth, rows = bench.truth, measure(bench, "drag")
    inertia, sigma, _ = rows.pop("Inertia")
    assert abs(value(inertia) / truth.plant["inertia_kgm2"] - 1.0) <= INERTIA and value(sigma) > 0.0
    for name in HARMONICS:
        found, sigma, _ = rows.pop(name)
        assert value(found) <= OFFSET_DEG and 0.0 < value(sigma) <= OFFSET_DEG
    rows.pop("Guess for a rotor of this nameplate")
    assert len(rows) == 2, "the drag at two speeds"
    for name, (torque, sigma, _) in rows.items():
        assert value(sigma) > 0.0
        rpm = float(name.removeprefix("Drag at ").removesuffix(" rpm"))
        assert abs(value(torque) / float(truth.drag_Nm(rpm * math.pi / 30.0)) - 1.0) <= DRAG, name


@pytest.fixture(scope="module")
def folder(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The motor's folder, downloaded after the standing steps."""
    page = bench.page
    for step in ("resistance", "map"):
        bench.press(step, "do")
        bench.wait(step, "measuring")
        bench.wait(step, FOUND)
        bench.press(step, "accept")
    polled(lambda: page.text("finish-state") == "finished")
    report = page.text("finish-report")
    assert "connection:" in report and "magnet: psi_f" in report and "inertia:" in report
    return downloaded(bench, tmp_path_factory.mktemp("downloaded"))


def test_the_standing_steps_follow_and_the_folder_names_what_was_measured(bench: Bench, folder: Path) -> None:
    assert command(["motor", "check", str(folder)]) == 0
    motor = tomllib.loads((folder / "motor.toml").read_text(encoding="utf-8"))
    assert motor["machine"]["pole_pairs"] == bench.truth.plant["pole_pairs"]
    assert not [entry for entry in bench.page.browser.get_log("browser") if entry["level"] == "SEVERE"]


def test_the_built_firmware_makes_40_newton_metres_true(bench: Bench, folder: Path, tmp_path: Path) -> None:
    """With the folder's tables alone, and the sensor's connection as its cards tell it."""
    phases, spin = bench.rows("phases"), bench.rows("spin")
    wiring = Connection(int(phases["Pole pairs"][0]), phases["The angle sensor counts"][0] == "against the field",
                        math.radians(value(spin["Electrical angle at the sensor's zero"][0])))  # fmt: skip
    made = driven.built(load_motor(folder), tmp_path)
    plan = driven.plan_of(made.motor, bench.truth, 0, 60.0, (1, 1))
    windows = [Window(speed, torque, 0.2) for speed in SPEEDS_RPM for torque in (TORQUE_NM, -TORQUE_NM)]
    machine = driven.Coupled(bench.truth, bench.flux_map, wiring)
    rows = machine.rows(made, plan, windows, driven.ALONE, warm_up=False)
    print({(row["speed_rpm"], row["torque_requested_Nm"]): f"{row['error_percent']:+.2f} %" for row in rows})
    assert len(rows) == len(windows) and not any(row["fault_word"] for row in rows)
    assert all(abs(row["torque_Nm"] / row["torque_requested_Nm"] - 1.0) <= TORQUE_SHARE for row in rows)  # not by NaN
