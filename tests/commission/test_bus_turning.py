# SPDX-License-Identifier: Apache-2.0
"""The steps that turn the shaft over CAN, on the virtual ECU: a hidden machine, refusals, and what ends a movement."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bus_stand import COMMAND_ID, COMMISSION_ID, Stand, bus_stand

from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import bus_turning, hidden, spin, turning
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import turned
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.motor import Motor

NAME, SEED = "saturated", 101
OFFSET_DEG, HARMONICS_DEG, PSI_F, INERTIA, DRAG = 0.2, 0.2, 0.005, 0.03, 0.1  # the bounds of test_turning.py
HARMONICS = {"angle_h1_rad": 0.02, "angle_h1_phase": 1.0, "angle_h2_rad": 0.01, "angle_h2_phase": 4.0}
LIMIT_S = 2.0  # of acceleration without an end by the tool
SMALL_S = 0.2
STOPPED_S = 0.05  # time-out of 30 ms and one step of the tool


@pytest.fixture
def stand(unknown: Motor, known: Nameplate, tmp_path: Path) -> Iterator[Stand]:
    with bus_stand(unknown, known, tmp_path, (NAME, SEED), connected=False) as made:
        yield made


def test_an_unknown_connection_magnet_inertia_and_drag_over_can(stand: Stand, known: Nameplate) -> None:
    """The sensor has harmonics, which the firmware corrects more and more while the shaft turns."""
    stand.truth.plant.update(HARMONICS)
    stand.channel.set(**HARMONICS)
    found = run(stand.drive, chosen(("drag",)), known, lambda _: None)
    errors = turned(found, stand.truth)
    print(f"{NAME} {SEED}: {errors}, {stand.line.now_s:.0f} s simulated")
    assert errors.is_connected
    assert abs(errors.offset_deg) <= OFFSET_DEG
    assert errors.harmonics_deg <= HARMONICS_DEG
    assert abs(errors.psi_f) <= PSI_F
    assert abs(errors.inertia) <= INERTIA
    assert errors.drag <= DRAG
    assert stand.drive.get("run_state") == 0.0 and stand.drive.get("fault_word") == 0.0
    assert stand.drive.get("dead_time_compensation") == pytest.approx(1.0, abs=1e-3)


def spinning(stand: Stand, known: Nameplate) -> None:
    """The shaft is being accelerated by a sixth of the largest current."""
    turning.connect(stand.drive, stand.wired, known, "test")
    turning.currents(stand.drive, 0.0, 0.16 * known.i_max_A)
    stand.drive.rest(SMALL_S)
    assert stand.speed_rad_s() > 1.0


def is_off(stand: Stand) -> bool:
    stand.line.pass_time(STOPPED_S)
    return stand.line.state == "ready" and stand.drive.get("run_state") == 0.0 and stand.drive.get("fault_word") == 0.0


def silent(stand: Stand, _: Nameplate) -> None:
    stand.clock.kept_back = frozenset({COMMISSION_ID})


def without_request(stand: Stand, _: Nameplate) -> None:
    stand.clock.kept_back = frozenset({COMMISSION_ID, COMMAND_ID})


def other_movement(stand: Stand, _: Nameplate) -> None:
    stand.line.move(kind="imposed")


def withdrawn(stand: Stand, _: Nameplate) -> None:
    stand.line.move(kind="none")


def torque(stand: Stand, _: Nameplate) -> None:
    stand.line.ask(torque_Nm=5.0)


@pytest.mark.parametrize(("action", "message"), [
    (silent, "the commands stopped"), (without_request, "the commands stopped|command timed out"),
    (other_movement, "the inverter has refused it"), (withdrawn, "the inverter has refused it"),
    (torque, "a torque was requested"),
])  # fmt: skip
def test_what_is_not_the_agreed_movement_ends_it_with_one_message(
    action: Callable[[Stand, Nameplate], None], message: str, stand: Stand, known: Nameplate
) -> None:
    spinning(stand, known)
    action(stand, known)
    with pytest.raises(FluxtrueError, match=message):
        stand.drive.rest(STOPPED_S)
    assert is_off(stand)


def test_a_movement_ends_at_the_agreed_speed_over_can(stand: Stand, known: Nameplate) -> None:
    spinning(stand, known)
    fastest = 0.0
    with pytest.raises(FluxtrueError, match="faster than 30 %"):
        for _ in range(round(LIMIT_S / turning.STEP_S)):
            stand.drive.rest(turning.STEP_S)
            fastest = max(fastest, stand.speed_rad_s())
    limit = turning.LIMIT_SHARE * known.speed_max_rpm * turning.TURN / 60.0
    assert 0.9 * limit < fastest <= 1.05 * limit
    assert is_off(stand)


@pytest.mark.parametrize("plant", [{"imposed_speed": 1.0, "speed_rad_s": 0.0}, {"inertia_kgm2": 100.0}])
def test_a_blocked_or_coupled_shaft_ends_the_movement(plant: dict[str, float], stand: Stand, known: Nameplate) -> None:
    stand.channel.set(**plant)
    turning.connect(stand.drive, stand.wired, known, "test")
    turning.currents(stand.drive, 0.0, 0.16 * known.i_max_A)
    with pytest.raises(FluxtrueError, match="blocked or coupled"):
        for _ in range(150):
            stand.drive.rest(turning.STEP_S)
    assert is_off(stand)


def test_a_rotor_that_does_not_follow_is_refused_over_can(stand: Stand, known: Nameplate) -> None:
    stand.channel.set(imposed_speed=1.0, speed_rad_s=0.0)
    with pytest.raises(FluxtrueError, match="the rotor did not move"):
        run(stand.drive, chosen(("phases",)), known, lambda _: None)
    assert stand.drive.get("run_state") == 0.0


def test_a_movement_is_refused_while_switching_is_enabled(stand: Stand) -> None:
    stand.drive.set("enable", 1.0)
    stand.line.move()
    stand.line.pass_time(STOPPED_S)
    stand.line.move(kind="imposed")
    with pytest.raises(FluxtrueError, match="the inverter has refused it"):
        stand.drive.rest(STOPPED_S)
    assert is_off(stand)


def test_before_the_index_has_passed_only_the_imposed_movement_runs(stand: Stand, known: Nameplate) -> None:
    stand.channel.set(board_angle_unknown=1.0)
    with pytest.raises(FluxtrueError, match="switching cannot be enabled.*angle not absolute"):
        turning.connect(stand.drive, stand.wired, known, "test")
    assert is_off(stand)
    turning.connect(stand.drive, None, known, "test")
    turning.currents(stand.drive, 0.06 * known.i_max_A, 0.0)
    stand.drive.rest(SMALL_S)
    assert stand.current_A() > 0.03 * known.i_max_A
    turning.release(stand.drive)
    stand.channel.set(board_angle_unknown=0.0)
    spinning(stand, known)


@pytest.mark.parametrize("name", ["linear", "pmasynrm"])
def test_the_gains_of_another_machine_are_refused(tmp_path: Path, name: str) -> None:
    """Along d the inductance of hsm1 is 4.5 times that of pmasynrm; linear has other pole pairs, too."""
    motor = motors.load("hsm1")
    known = nameplate_of(hidden.folder_of("hsm1"), motor)
    with bus_stand(motor, known, tmp_path, (name, SEED), connected=False) as stand:
        wanted = turning.SPEED_SHARE * known.speed_max_rpm * turning.TURN / 60.0
        with pytest.raises(FluxtrueError, match="along d did not settle"):
            bus_turning.direction(stand.drive, known, wanted, stand.wired)
        turning.release(stand.drive)
        assert is_off(stand)


def test_a_current_that_oscillates_by_more_than_its_level_is_refused() -> None:
    rows = np.zeros((200, 5))
    rows[:, 0] = 15.0 + 22.0 * np.sin(np.arange(200))  # 15.6 A rms
    with pytest.raises(FluxtrueError, match="the current oscillates by 16 A rms .* for the nameplate"):
        spin._refuse_oscillation([spin.Window(rows)], 15.0)
    spin._refuse_oscillation([spin.Window(rows)], 16.0)


def test_after_an_early_end_enable_needs_a_new_consent(stand: Stand, known: Nameplate) -> None:
    spinning(stand, known)
    silent(stand, known)
    with pytest.raises(FluxtrueError, match="the commands stopped"):
        stand.drive.rest(STOPPED_S)
    stand.clock.kept_back = frozenset()
    stand.line.ask(enable=False)
    stand.line.pass_time(STOPPED_S)
    stand.line.ask(enable=True)
    stand.line.pass_time(STOPPED_S)
    assert stand.line.state == "ready" and stand.line.refused == "movement ended"
    turning.release(stand.drive)
    spinning(stand, known)


def test_the_map_s_steps_keep_the_connection_that_was_found(stand: Stand, known: Nameplate) -> None:
    """The firmware's motor data have another connection."""
    turning.connect(stand.drive, stand.wired, known, "test")
    turning.release(stand.drive)
    found = run(stand.drive, chosen(("resistance",)), known, lambda _: None)
    assert found.resistance is not None
    assert abs(found.resistance.r_ohm / stand.truth.plant["r_ohm_20"] - 1.0) <= 0.01


def test_the_command_turns_the_shaft_and_writes_a_folder(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "found"
    options = ["--motor", str(folder), "--virtual-ecu", "--machine", NAME, "--seed", str(SEED), "--step", "phases",
               "--out", str(out)]  # fmt: skip
    assert command(["commission", *options]) == 0, capsys.readouterr().err
    assert "counts against the field" in capsys.readouterr().out
    assert command(["motor", "check", str(out)]) == 0


class Shaft:
    """A drive whose shaft coasts at 12 turns in a second, of which the scope holds less than one; each capture begins
    at the same angle of a sensor that is wrong once and twice per turn. No resistance, no inductance."""

    period_s = 5e-5
    tells_angle_correction = False
    HZ, PSI_F = 12.0, 0.02

    def __init__(self, pole_pairs: int) -> None:
        self._pole_pairs, self._is_braked = pole_pairs, False
        self._set: dict[str, float] = {}

    def set(self, name: str, value: float) -> None:
        self._set[name] = value
        self._is_braked |= name == "iq_ref_A" and value < -0.1

    def get(self, name: str) -> float:
        return 1.0 if name == "run_state" else self._set.get(name, 0.0)

    def rest(self, seconds: float) -> None:
        """Nothing changes."""

    def capture(self, names: Sequence[str], periods: int) -> np.ndarray:
        return np.zeros((1, len(names)))

    def shaft_rad_s(self) -> float:
        return 0.0 if self._is_braked else 2.0 * np.pi * self.HZ * (1.0 + 0.1 * bool(self._set.get("iq_ref_A")))

    def capture_during(self, names: Sequence[str], periods: int, divisor: int, action: Callable[[float], None]
                       ) -> np.ndarray:  # fmt: skip
        i_d_A = self._set["id_ref_A"]
        action(periods * self.period_s)
        times = self.period_s * divisor * np.arange(periods // divisor)
        shaft = 2.0 * np.pi * (0.3 + self.HZ * times)
        error = 0.017 * np.sin(shaft + 1.0) + 0.013 * np.sin(2.0 * shaft)
        speed = 2.0 * np.pi * self._pole_pairs * self.HZ
        u = 1j * speed * np.sinc(0.5 * speed * self.period_s / np.pi) * self.PSI_F * np.exp(-1j * error)
        theta = np.angle(np.exp(1j * (self._pole_pairs * shaft + error)))
        return np.column_stack((np.full(len(times), i_d_A), 0.0 * times, u.real, u.imag, theta))


def test_a_level_over_can_has_a_whole_turn_of_the_shaft(known: Nameplate) -> None:
    """At 20 kHz the scope's memory holds 61 ms of every period, 0.7 turns: over the electrical turns in it the angle is
    wrong by the mean of the sensor's harmonics, 0.6 degrees."""
    plate = replace(known, pole_pairs=4, i_max_A=50.0, offset_A=0j)
    shaft, wired = Shaft(4), turning.Connection(4, False, 0.0)
    found = bus_turning.direction(shaft, plate, 2.0 * np.pi * Shaft.HZ, wired)  # type: ignore[arg-type]
    print(found)
    assert abs(found.error_rad) < 2e-4
    assert abs(found.psi_Vs) == pytest.approx(Shaft.PSI_F, rel=3e-3)  # the harmonics are in the slope of the angle, too
