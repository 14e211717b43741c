# SPDX-License-Identifier: Apache-2.0
"""Commissioning of hidden machines, scored with what only the test knows of them."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from watched import Watched

from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.bursts import MOVED
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.proof import STEPS
from fluxtrue_tools.commission.score import (
    balance_error,
    inductance_error,
    leg_errors,
    offset_error,
    resistance_error,
    score,
)
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_map import load_flux_map
from fluxtrue_tools.motor.flux_model import SplineModel
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

# Machine, seed, change of the plant. With its offset saturated 12 takes 252.5 A in a burst. The noise decides it: of
# twelve draws, half of them without an offset, one of each half is beyond the largest current.
MACHINES = [("saturated", 12, {"vdc_offset_V": 0.0}), ("pmasynrm", 13, {}), ("hsm1", 16, {})]
MAP_RMS, R_SHARE, BALANCE = 0.01, 0.01, 0.002
# Machine, seed, number of the position of the rotor and noise: the worst of 300; two with a phase near zero current.
DRAWS = [("saturated", 12, 72), ("saturated", 12, 240), ("saturated", 12, 294), ("hsm1", 135, 0), ("hsm1", 135, 6)]
DRAW_RMS = 0.005
# The winding drops 1.2 V at the largest current; a phase current is near zero at every level; large swings.
LITTLE_VOLTAGE = [("saturated", 126), ("linear", 138), ("hsm1", 105)]
# Machine, seed, electrical degrees: the last three are among the five of 40 machines that move most.
SWINGS = [("pmasynrm", 107, 0.8), ("hsm1", 110, 1.2), ("hsm1", 120, 1.1), ("leaf", 114, 1.2), ("saturated", 116, 1.0)]
R_LEFT, LEG_V = 0.004, 0.05  # beyond the sensors' gains; 5 mV of 1.2 V; a half per cent of what a leg loses


@pytest.mark.parametrize(("name", "seed", "changed"), MACHINES)
def test_map_and_resistance_of_a_hidden_machine(name: str, seed: int, changed: dict[str, float], unknown: Motor,
                                                known: Nameplate) -> None:  # fmt: skip
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A, changed=changed)
    found = run(drive, chosen(("map",)), known, lambda _: None)
    assert found.surface is not None and found.resistance is not None and found.balance is not None
    reached = score(found.surface.model, truth, known.i_max_A, truth.psi_f_Vs)
    error, left = resistance_error(found.resistance.r_ohm, truth)
    print(f"{name} {seed}: map {reached}, R {100 * error:+.2f} %, largest current {found.largest_A:.1f} A")
    assert found.first is not None
    leg_V, leg_left = leg_errors(found.resistance.total_V, truth, known.level_V)
    l_error = inductance_error(found.first, truth, known.i_max_A)
    print(f"leg {leg_V:+.3f} V, {100 * leg_left:.2f} % of the nameplate's error, L {100 * l_error:.1f} %")
    assert 0.0 < offset_error(found.offset_A, truth) <= STEPS["sensor_offset"]
    assert abs(leg_left) <= STEPS["leg_left"]
    assert l_error <= STEPS["l_error"]  # with the legs' voltage as planning takes it, two of them are wrong by 22 %
    assert reached.map_rms <= MAP_RMS
    assert abs(error) <= R_SHARE
    assert abs(left) <= R_LEFT
    assert balance_error(found.balance, truth) <= BALANCE
    assert found.largest_A <= known.i_max_A
    assert drive.get("run_state") != 1.0
    assert drive.get("fault_word") == 0.0


def test_a_rotor_that_moves_at_a_level_is_measured_until_it_does(unknown: Motor, known: Nameplate) -> None:
    """Where the shaft rests the harmonics of the angle sensor give the direct current a part along q: all tries at a
    level end before their time. Without (CM-42) the resistance is wrong by 12 %. The rotor is braked as over CAN, where
    it does not stand as well before a current."""
    drive, truth = hidden.make("hsm1", 135, unknown, known.i_max_A, connected=False, other_errors=True)
    drive.strikes = False
    found = run(drive, chosen(("phases", "resistance")), known, lambda _: None)
    assert found.resistance is not None and any(raw.failure == MOVED for raw in found.levels)
    error, _ = resistance_error(found.resistance.r_ohm, truth)
    print(f"R {100 * error:+.2f} %")
    assert abs(error) <= 2.0 * R_SHARE  # as the campaign with other errors


@pytest.mark.parametrize(("name", "seed", "number"), DRAWS)
def test_noise_does_not_choose_the_map(name: str, seed: int, number: int, unknown: Motor, known: Nameplate) -> None:
    """With weights that grow towards small currents, where a sample's error is largest, the score of the smoothing is
    flat, the noise chooses among its candidates, and the first three maps are wrong by 0.76 to 0.78 %. Without the
    common errors of the samples after an uncertain sign the last two are wrong by 0.76 and 0.78 %."""
    rng = np.random.default_rng([number, 77])
    drawn = {"seed": float(rng.integers(1, 1 << 40)), "theta_m_rad": float(rng.uniform(0.0, 2.0 * np.pi))}
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A, changed=drawn)
    known = replace(known, psi_f_Vs=truth.psi_f_Vs, psi_f_source="data sheet")
    surface = run(drive, chosen(("map",)), known, lambda _: None).surface
    assert surface is not None
    reached = score(surface.model, truth, known.i_max_A, truth.psi_f_Vs)
    print(f"{number}: {reached}, {surface.unknowns:.0f} unknowns")
    assert reached.map_rms <= DRAW_RMS


@pytest.mark.parametrize(("name", "seed"), LITTLE_VOLTAGE)
def test_resistance_where_little_voltage_shows_it(name: str, seed: int, unknown: Motor, known: Nameplate) -> None:
    """With the legs' signs at the samples, one inductance for a level or the drive's compensation as it should be in
    place of as it is, these machines are missed by up to 3 %."""
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A)
    found = run(drive, chosen(("resistance",)), known, lambda _: None).resistance
    assert found is not None
    error, left = resistance_error(found.r_ohm, truth)
    plant = truth.plant
    leg_V = plant["dead_time_s"] * plant["pwm_hz"] * plant["vdc_V"] + plant["device_drop_V"]
    print(f"{name} {seed}: R {100 * error:+.2f} % ({100 * left:+.2f} %), leg {found.total_V - leg_V:+.3f} V")
    assert abs(error) <= R_SHARE
    assert abs(left) <= R_LEFT
    assert abs(found.total_V - leg_V * plant["vdc_gain"]) <= LEG_V


@pytest.mark.parametrize(("name", "seed", "most_deg"), SWINGS)
def test_the_rotor_swings_little(name: str, seed: int, most_deg: float, unknown: Motor, known: Nameplate) -> None:
    """With 1/sqrt(2) for the first half wave and one voltage for all bursts at a bias these machines move by 1.5, 11.2
    and 16.6 degrees."""
    _, flux_map, plant = hidden.draw(name, seed, unknown, known.i_max_A)
    drive = Watched(Loop(unknown.library, plant, flux_map))
    found = run(drive, chosen(("map",)), known, lambda _: None)
    swings_deg = np.degrees(known.pole_pairs * np.array(drive.swings_rad[-len(found.bursts) :]))
    print(name, seed, np.round(swings_deg, 1))
    assert 0.0 < swings_deg.max() <= most_deg


def test_the_truth_cannot_be_read(unknown: Motor, known: Nameplate) -> None:
    drive, _ = hidden.make("hsm1", 1, unknown, known.i_max_A)
    for name in ("plant.r_ohm_20", "truth.torque_Nm"):
        with pytest.raises(FluxtrueError, match="cannot read"):
            drive.get(name)
        with pytest.raises(FluxtrueError, match="cannot read"):
            drive.capture((name,), 1)
        with pytest.raises(FluxtrueError, match="cannot read"):
            drive.set(name, 0.0)


def test_settings_are_restored_after_a_refusal(unknown: Motor, known: Nameplate) -> None:
    """A machine with a thousandth of the guessed inductance: its current trips at once."""
    drive, _ = hidden.make("spm_12V", 1, unknown, known.i_max_A)
    before = {name: drive.get(name) for name in ("dead_time_compensation", "trim")}
    with pytest.raises(FluxtrueError, match="fault|exceeded"):
        run(drive, chosen(("map",)), known, lambda _: None)
    assert before == {name: drive.get(name) for name in before}
    assert drive.get("enable") == 0.0


def test_a_dry_run_announces_movement_and_current(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["commission", "--motor", str(folder), "--step", "map", "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "beyond 15 electrical degrees a burst ends" in said
    assert "up to 250 A" in said and "up to 212 A" in said


@pytest.mark.parametrize("options", [["--step", "gains"], []])
def test_a_wrong_call_is_refused(options: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["commission", "--motor", str(folder), *options]) == 2
    assert "wanted" in (said := capsys.readouterr().err) or "allowed" in said


def test_the_folder_says_where_each_value_comes_from(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], known: Nameplate
) -> None:
    out = tmp_path / "found"
    options = ["--motor", str(folder), "--machine", "saturated", "--seed", "12", "--out", str(out)]
    assert command(["commission", *options]) == 0
    text = (out / "motor.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    assert {path.name for path in out.iterdir()} == {"motor.toml", "flux_map.csv", "commission.txt", "commission.png"}
    for key in ("r_ohm", "flux_map", "dead_time_s"):
        line = next(line for line in text.splitlines() if line.startswith(f"{key} = "))
        assert "measured by fluxtrue commission" in line
    grid = load_flux_map(out / data["machine"]["flux_map"], known.i_max_A)
    model = SplineModel(grid.id_A, grid.iq_A, grid.psi_d_Vs, grid.psi_q_Vs)
    assert float(model.psi_d(0.0, 0.0)) == pytest.approx(known.psi_f_Vs, rel=1e-6)
    assert "nameplate's guess" in text
    assert "cannot be seen at standstill" in capsys.readouterr().out
    assert command(["motor", "check", str(out)]) == 0


def test_after_a_refusal_nothing_is_written(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "found"
    assert command(["commission", "--motor", str(folder), "--machine", "spm_12V", "--out", str(out)]) == 2
    assert list(tmp_path.iterdir()) == []
