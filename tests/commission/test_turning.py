# SPDX-License-Identifier: Apache-2.0
"""The steps that turn the shaft: hidden machines with an unknown connection, refusals, the limits of a movement."""

import math
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import connection, hidden, spin, turning
from fluxtrue_tools.commission.drive import CONNECTION, SoftwareInTheLoop
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import turned
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.motor import Motor

# pmasynrm 322 slows down so fast that its current never settles without more of it along q. With errors of other kinds
# the drag of pmasynrm 127 takes all torque of the largest current below the wanted speed.
MACHINES = [("saturated", 101, False), ("pmasynrm", 322, False), ("hsm1", 135, False), ("pmasynrm", 127, True)]
OFFSET_DEG, HARMONICS_DEG, PSI_F, INERTIA, DRAG = 0.2, 0.2, 0.005, 0.03, 0.1
SILENT, FAST = 1.0, 2.0
RUN = 1.0
STEP_S = 1e-3


@pytest.mark.parametrize(("name", "seed", "other_errors"), MACHINES)
def test_an_unknown_connection_magnet_inertia_and_drag(
    name: str, seed: int, other_errors: bool, unknown: Motor, known: Nameplate
) -> None:
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A, connected=False, other_errors=other_errors)
    before = {each: drive.get(each) for each in CONNECTION}
    found = run(drive, chosen(("drag",)), known, lambda _: None)
    errors = turned(found, truth)
    print(f"{name} {seed}: {errors}")
    assert errors.is_connected
    assert abs(errors.offset_deg) <= OFFSET_DEG
    assert errors.harmonics_deg <= HARMONICS_DEG
    assert abs(errors.psi_f) <= PSI_F
    assert abs(errors.inertia) <= INERTIA
    assert errors.drag <= DRAG
    assert {each: drive.get(each) for each in CONNECTION} == before
    assert drive.get("enable") == 0.0 and drive.get("fault_word") == 0.0
    assert drive.get("machine_monitors") == 1.0 and drive.get("current_mode") == 0.0


def changed(unknown: Motor, known: Nameplate, **plant: float) -> SoftwareInTheLoop:
    """A hidden machine with a defect."""
    drive, _ = hidden.make("saturated", 101, unknown, known.i_max_A, connected=False, changed=plant)
    return drive


@pytest.mark.parametrize(
    ("plant", "message"),
    [({"imposed_speed": 1.0, "speed_rad_s": 0.0}, "did not move"), ({"angle_stuck": 1.0}, "did not move"),
     ({"inertia_kgm2": 100.0}, "the rotor did not (follow|move)")],
)  # fmt: skip
def test_a_rotor_that_does_not_follow_is_refused(
    plant: dict[str, float], message: str, unknown: Motor, known: Nameplate
) -> None:
    drive = changed(unknown, known, **plant)
    with pytest.raises(FluxtrueError, match=message):
        run(drive, chosen(("phases",)), known, lambda _: None)
    assert drive.get("enable") == 0.0 and drive.get("run_state") != RUN


def agreed(unknown: Motor, known: Nameplate) -> SoftwareInTheLoop:
    """The angle is imposed, the currents are zero, the movement is agreed for CONSENT_S."""
    drive = changed(unknown, known)
    turning.connect(drive, None, known, "test")
    return drive


def test_a_movement_ends_when_the_commands_stop(unknown: Motor, known: Nameplate) -> None:
    drive = agreed(unknown, known)
    turning.currents(drive, 10.0, 0.0)
    turning.advance(drive, turning.STEP_S, "test")
    drive.capture(("run_state",), round(1.5 * turning.CONSENT_S / drive.period_s))
    assert drive.get("run_state") != RUN
    assert drive.get("spin_failure") == SILENT
    with pytest.raises(FluxtrueError, match="test: switching was disabled"):
        turning.advance(drive, turning.STEP_S, "test")


def test_a_movement_ends_at_the_agreed_speed(unknown: Motor, known: Nameplate) -> None:
    truth = hidden.make("saturated", 101, unknown, known.i_max_A, connected=False)[1]
    drive = changed(unknown, known)
    wired = turning.Connection(int(truth.plant["pole_pairs"]), truth.reversed, truth.offset_rad)
    turning.connect(drive, wired, known, "test")
    turning.currents(drive, 0.0, 0.25 * known.i_max_A)
    fastest = 0.0
    with pytest.raises(FluxtrueError, match="faster than 30 %"):
        for _ in range(500):
            rows = turning.advance(drive, turning.STEP_S, "test")
            fastest = max(fastest, abs(turning.speed_rad_s(rows, drive.period_s)))
    assert drive.get("spin_failure") == FAST
    assert fastest <= 1.05 * turning.LIMIT_SHARE * known.speed_max_rpm * turning.TURN / 60.0
    assert drive.get("run_state") != RUN


def test_the_source_of_the_angle_changes_only_while_switching_is_disabled(unknown: Motor, known: Nameplate) -> None:
    drive = agreed(unknown, known)
    before = drive.get("theta_e_rad")
    drive.set("angle_offset_rad", 2.0)
    drive.set("angle_imposed", 0.0)
    turning.advance(drive, turning.STEP_S, "test")
    assert drive.get("theta_e_rad") == pytest.approx(before, abs=1e-6)
    turning.release(drive)
    assert drive.get("theta_e_rad") != pytest.approx(before, abs=0.01)
    assert drive.get("fault_word") == 0.0


# The rotor of linear 113 swings at 0.7 Hz about this current; that of leaf 124 at 1.3 Hz, near the frequency with which
# the offsets of its sensors turn.
@pytest.mark.parametrize(("name", "seed"), [("hsm1", 110), ("linear", 113), ("leaf", 124)])
def test_the_rotor_follows_the_smallest_current(name: str, seed: int, unknown: Motor, known: Nameplate) -> None:
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A, connected=False)
    found = run(drive, chosen(("phases",)), known, lambda _: None).followed
    assert found is not None
    print(f"{name} {seed}: {found}")
    assert found.current_A == pytest.approx(connection.SHARES[0] * known.i_max_A)
    assert found.connection.pole_pairs == truth.plant["pole_pairs"]
    assert abs(math.remainder(found.connection.offset_rad - truth.offset_rad, turning.TURN)) < spin.ROUGH_RAD


def swinging(pole_pairs: int, swing_hz: float) -> tuple[Array, Array]:
    """Imposed turns there and back, and those of a rotor without friction that swings about the current."""
    hz = np.array(connection._shares())
    hz = np.repeat(np.concatenate((hz, -hz)) * connection.HZ, round(turning.STEP_S / STEP_S))
    imposed = STEP_S * np.cumsum(hz)
    turns, speed, rotor = 0.0, 0.0, []
    for wanted in imposed:
        speed += STEP_S * (turning.TURN * swing_hz) ** 2 * math.sin(turning.TURN * (wanted - turns)) / turning.TURN
        turns += STEP_S * speed
        rotor.append(turns)
    return imposed, np.array(rotor) / pole_pairs


@pytest.mark.parametrize(("pole_pairs", "swing_hz"), [(2, 0.7), (2, 1.0), (4, 1.3), (8, 2.5)])
def test_a_rotor_that_swings_slowly_shows_its_pole_pairs(pole_pairs: int, swing_hz: float) -> None:
    found = connection.followed(*swinging(pole_pairs, swing_hz), 1.0)
    assert connection._is_right(found)
    assert found.connection.pole_pairs == pole_pairs and not found.connection.reversed


def test_a_machine_with_a_weak_magnet_is_accelerated_by_its_reluctance(unknown: Motor, known: Nameplate) -> None:
    wanted = turning.SPEED_SHARE * known.speed_max_rpm * turning.TURN / 60.0
    seconds = []
    for currents in (spin.ALONG_Q, spin.TURNED):
        drive, truth = hidden.make("pmasynrm", 127, unknown, known.i_max_A, connected=False)
        wired = turning.Connection(int(truth.plant["pole_pairs"]), truth.reversed, truth.offset_rad)
        turning.connect(drive, wired, known, "test")
        rows = spin.accelerate(drive, known, wanted, "test", currents)
        seconds.append(len(rows) * drive.period_s)
        assert np.abs(rows[:, :2]).max() < 0.5 * known.i_max_A
    print(seconds)
    assert seconds[1] < 0.5 * seconds[0]


def test_a_folder_of_the_turning_steps_alone(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found"
    options = ["--motor", str(folder), "--machine", "saturated", "--seed", "101", "--step", "drag", "--out", str(out)]
    assert command(["commission", *options]) == 0
    text = (out / "motor.toml").read_text(encoding="utf-8")
    for key in ("pole_pairs", "psi_f_Vs", "inertia_kgm2"):
        line = next(line for line in text.splitlines() if line.startswith(f"{key} = "))
        assert "measured by fluxtrue commission" in line and ("±" in line or "followed" in line)
    assert "counts against the field" in capsys.readouterr().out
    assert command(["motor", "check", str(out)]) == 0
