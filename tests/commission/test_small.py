# SPDX-License-Identifier: Apache-2.0
"""Small machines for 48 V: light rotors, windings that drop a tenth and more of the voltage. All of them: python -m
fluxtrue_tools.commission.campaign --nameplate unknown_48V."""

from dataclasses import replace

import numpy as np
import pytest
from watched import Watched

from fluxtrue_tools.commission import drag, heating, hidden, iron, plot, spin, turning
from fluxtrue_tools.commission.campaign import BOUNDS, FOLDER, MOVEMENT, NAMEPLATES, SMALL_FOLDER, draw
from fluxtrue_tools.commission.drag import Drag
from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.proof import STEPS
from fluxtrue_tools.commission.score import balance_error, resistance_error, score, turned
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.steps import Found, chosen, run
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

SECONDS_MAX, SHARE_MAX = 60.0, 0.7
PERIOD_S, PAIRS, PSI_F, INERTIA = 5e-5, 4, 0.02, 5e-4


def test_all_steps_of_a_light_machine_keep_every_bound(
    small: Motor, plate: Nameplate, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its drag takes a third of its speed between two levels of `spin`, which refused it; the offsets of the current
    sensors made its rotor turn before each burst, which was refused; its inertia was 4.6 % too large, and 67 % without
    bounds of the inductances."""
    kept = []
    monkeypatch.setattr(heating, "run", lambda *args, **more: kept.append(run(*args, **more)))
    times = heating.measure("hub", 103, small, plate)
    found, truth = kept[0], hidden.draw("hub", 103, small, plate.i_max_A, connected=False)[0]
    print(times)
    assert times["all"][0] <= SECONDS_MAX
    assert max(share for _, share in times.values()) <= SHARE_MAX
    errors = turned(found, truth)
    reached = score(found.surface.model, truth, plate.i_max_A, truth.psi_f_Vs)
    print(errors, reached)
    assert errors.is_connected
    assert reached.map_rms <= STEPS["map_rms"]
    assert abs(resistance_error(found.resistance.r_ohm, truth)[0]) <= STEPS["r_error"]
    assert balance_error(found.balance, truth) <= STEPS["balance"]
    assert abs(errors.offset_deg) <= STEPS["offset_deg"]
    assert abs(errors.psi_f) <= STEPS["psi_f_error"]
    assert abs(errors.inertia) <= STEPS["inertia_error"]
    assert errors.drag <= STEPS["drag_error"]
    assert errors.harmonics_deg <= STEPS["harmonics_deg"]


def test_the_offsets_of_the_sensors_are_no_torque(small: Motor, plate: Nameplate) -> None:
    """24 electrical turns in a second and a drag of 0.6 % of the largest torque, which came out 24 % wrong."""
    drive, truth = hidden.make("ebike", 102, small, plate.i_max_A, connected=False)
    errors = turned(run(drive, chosen(("drag",)), plate, lambda _: None), truth)
    print(errors)
    assert errors.drag <= STEPS["drag_error"]
    assert errors.harmonics_deg <= STEPS["harmonics_deg"]
    assert abs(errors.inertia) <= STEPS["inertia_error"]


@pytest.mark.parametrize("seed", [100, 106])
def test_the_iron_turns_the_flux_linkage_of_a_small_inductance(seed: int, small: Motor, plate: Nameplate) -> None:
    """By 1.9 and 0.6 mrad beside a sensor that is wrong by up to 17 mrad once and 13 mrad twice per turn; over windows
    of electrical turns 0.2 and 1.0 mrad were found. A third is the uncertainty that the folder states."""
    drive, truth = hidden.make("hub", seed, small, plate.i_max_A, connected=False, other_errors=True)
    found = run(drive, chosen(("spin",)), plate, lambda _: None).spun
    assert found is not None
    per_flux = truth.plant["iron_k_excess"] * np.sqrt(found.omega_rad_s)
    behind_rad = np.arctan(truth.plant["lq_H"] * truth.plant["lq_scale"] * per_flux / 1.5)  # (CM-29)
    print(found, behind_rad)
    assert -found.lag_s * found.omega_rad_s == pytest.approx(behind_rad, rel=iron.UNCERTAINTY)


def turned_by(i_d_A: float, offset_turns: float) -> np.ndarray:
    """1.7 turns of a shaft that loses a third of its speed, with a sensor that is wrong once and twice per turn; no
    resistance, no inductance."""
    times = PERIOD_S * np.arange(3400)
    turns = offset_turns + 12.0 * times - 12.0 * times**2
    speed = PAIRS * 2.0 * np.pi * (12.0 - 24.0 * (times + 0.5 * PERIOD_S))
    true = 2.0 * np.pi * turns
    error = 0.017 * np.sin(true + 1.0) + 0.013 * np.sin(2.0 * true)
    u = 1j * speed * np.sinc(0.5 * speed * PERIOD_S / np.pi) * PSI_F * np.exp(-1j * error)
    i = np.full(len(times), i_d_A)
    return np.column_stack((i, 0.0 * i, u.real, u.imag, np.angle(np.exp(1j * (PAIRS * true + error))), turns))


def test_a_whole_turn_of_the_shaft_has_no_harmonics() -> None:
    """All windows begin at the same angle, so that what one of them leaves is in the result."""
    taken = [spin.Window(turned_by(level, 0.3)) for level in spin.LEVELS]
    found = spin.magnet(taken, PERIOD_S, 0j, PAIRS)
    electrical = spin.magnet(taken, PERIOD_S, 0j, 1)
    print(found.error_rad, electrical.error_rad)
    assert abs(found.error_rad) < 1e-4
    assert abs(electrical.error_rad) > 1e-3


def test_a_current_settles_although_the_rotor_stops_meanwhile(small: Motor, plate: Nameplate) -> None:
    """The lightest rotor that is drawn loses its speed within the windows of one level: they become longer, because the
    errors of sensors and inverter have a mean over less than an electrical turn."""
    truth, flux_map, plant = hidden.draw("hub", 103, small, plate.i_max_A, connected=False)
    plant["inertia_kgm2"] = hidden.LOW_INERTIA[0] * 1.5 * plant["pole_pairs"] * truth.psi_f_Vs * plate.i_max_A
    drive = SoftwareInTheLoop(Loop(small.library, plant, flux_map))
    found = run(drive, chosen(("spin",)), plate, lambda _: None).spun
    assert found is not None
    assert abs(found.psi_f_Vs / (truth.psi_f_Vs * plant["vdc_gain"]) - 1.0) < 0.01


def test_a_winding_that_drops_more_than_the_voltage_of_the_levels(small: Motor, plate: Nameplate) -> None:
    """A tenth of the phase voltage at the largest current, ten times the guess: 42.5 A were not reached."""
    drive, truth = hidden.make("hub", 100, small, plate.i_max_A)
    found = run(drive, chosen(("resistance",)), plate, lambda _: None).resistance
    assert found is not None
    assert found.r_ohm > 9.0 * plate.r_ohm
    assert abs(resistance_error(found.r_ohm, truth)[0]) <= STEPS["r_error"]


LIGHT = [("anaheim", 101), ("hub", 103), ("anaheim", 104)]  # of the nine those that moved by more than a degree
START_RAD_S = np.radians(30.0)  # electrical: a quarter of a degree in a burst of the map


@pytest.mark.parametrize(("name", "seed"), LIGHT)
def test_a_light_rotor_moves_by_less_than_a_degree(name: str, seed: int, small: Motor, plate: Nameplate) -> None:
    """By 3.0, 1.2 and 4.3 degrees with at most 0.55 of the voltage, three half waves, and a rotor that turned with up
    to 230 degrees in a second when the pulses began: it had been braked by a speed that is reported too late, and then
    turned by the offsets of the current sensors."""
    truth, flux_map, plant = hidden.draw(name, seed, small, plate.i_max_A)
    drive = Watched(Loop(small.library, plant, flux_map))
    found = run(drive, chosen(("map",)), plate, lambda _: None)
    assert found.surface is not None
    moved_deg = np.degrees(plate.pole_pairs * np.array(drive.moves_rad[-len(found.bursts) :]))
    starts_rad_s = plate.pole_pairs * np.abs(drive.starts_rad_s)
    reached = score(found.surface.model, truth, plate.i_max_A, truth.psi_f_Vs)
    print(name, seed, np.round(moved_deg, 2), np.round(np.degrees(starts_rad_s)), reached)
    assert 0.0 < moved_deg.max() <= BOUNDS[MOVEMENT]
    assert np.degrees(found.moved_rad) == pytest.approx(moved_deg.max(), abs=0.1)  # what the campaign reports
    assert starts_rad_s[-len(found.bursts) :].max() <= START_RAD_S
    assert reached.map_rms <= STEPS["map_rms"]


def accelerated(torque_Nm: np.ndarray) -> np.ndarray:
    """Rows of a machine that this torque turns, without resistance: an exact movement from sample to sample."""
    speed = np.concatenate(([0.0], np.cumsum(0.5 * (torque_Nm[1:] + torque_Nm[:-1])))) * PERIOD_S / INERTIA
    theta = PAIRS * np.concatenate(([0.0], np.cumsum(speed[:-1] + 0.5 * np.diff(speed)))) * PERIOD_S
    u_q = PAIRS * (speed + 0.5 * np.append(np.diff(speed), 0.0)) * PSI_F
    zero, i_d = np.zeros(len(theta)), 1e-3 * np.cos(0.1 * np.arange(len(theta)))
    return np.column_stack((i_d, torque_Nm / (1.5 * PAIRS * PSI_F), zero, u_q, np.angle(np.exp(1j * theta)), zero))


def steps_of_torque(plate: Nameplate) -> Drag:
    """A torque that changes in the middle of windows of 20 ms, as in an acceleration of half a second."""
    torque = np.repeat([0.12, 0.24, 0.12, 0.36, -0.1, 0.1], [900, 1100, 700, 1300, 1500, 500])
    known = replace(plate, pole_pairs=PAIRS, psi_f_Vs=PSI_F)
    return drag.evaluate([accelerated(torque)], PERIOD_S, known)


def test_a_torque_that_changes_within_a_window_gives_the_inertia(plate: Nameplate) -> None:
    """With the impulse at the middle of a window in place of its mean the inertia is 0.7 % too large."""
    found = steps_of_torque(plate)
    print(found)
    assert found.inertia_kgm2 == pytest.approx(INERTIA, rel=0.003)
    assert abs(float(found.torque_Nm(np.array(0.5 * found.to_rad_s)))) < 2e-3


def test_a_shaft_is_slow_by_its_electrical_turns_and_by_its_share_of_the_speed(plate: Nameplate) -> None:
    known = replace(plate, pole_pairs=2)
    hz = 2.0 * np.pi / 2.0
    assert not spin._is_slow(24.0 * hz, 24.0 * hz, known)
    assert spin._is_slow(19.0 * hz, 24.0 * hz, known)
    assert not spin._is_slow(19.0 * hz, 20.0 * hz, known)  # no faster one is possible
    assert not spin._is_slow(30.0 * hz, 100.0 * hz, known)
    assert spin._is_slow(-21.0 * hz, -100.0 * hz, known)


def test_the_hidden_machines_of_the_first_nameplate_are_the_same_as_ever() -> None:
    assert draw(6)[0] == ("hsm1", 100) and draw(6)[5] == ("hsm1", 105)
    assert draw(3, SMALL_FOLDER.name) == [("hub", 100), ("anaheim", 101), ("ebike", 102)]
    assert set(NAMEPLATES) == {FOLDER.name, SMALL_FOLDER.name}
    plant = hidden.draw("hsm1", 100, motors.load(str(FOLDER)), 250.0)[2]
    assert plant["r_ohm_20"] == pytest.approx(0.016692396501793577, rel=1e-12)
    assert plant["inertia_kgm2"] == pytest.approx(0.11239717438798408, rel=1e-12)


@pytest.mark.parametrize(("name", "seed"), draw(9, SMALL_FOLDER.name))
def test_small_machines_are_of_the_size_of_small_machines(name: str, seed: int, small: Motor, plate: Nameplate) -> None:
    """hidden.py says why; the torque is that of the machine, not of the nameplate."""
    truth, _, plant = hidden.draw(name, seed, small, plate.i_max_A, connected=False, other_errors=True)
    torque_Nm = 1.5 * plant["pole_pairs"] * truth.psi_f_Vs * plate.i_max_A
    assert 0.05 <= plant["r_ohm_20"] * plate.i_max_A / (48.0 / 3.0**0.5) <= 0.25
    assert 5e-5 <= plant["inertia_kgm2"] / torque_Nm <= 2e-3
    assert 0.01 <= plant["viscous_Nms"] * 3000.0 * np.pi / 30.0 / torque_Nm <= 0.04
    assert 0.3e-6 <= plant["dead_time_s"] <= 1.3e-6
    assert 0.001 <= plant["coulomb_Nm"] / torque_Nm <= 0.004
    assert plant["ld_H"] == plant["lq_H"]


def test_a_rotor_lighter_than_a_servo_does_not_pass_the_agreed_speed(small: Motor, plate: Nameplate) -> None:
    """2 % of the largest current for the 50 ms of a try would take it beyond 30 % of the largest speed."""
    truth, flux_map, plant = hidden.draw("hub", 103, small, plate.i_max_A, connected=False)
    torque_Nm = 1.5 * plant["pole_pairs"] * truth.psi_f_Vs * plate.i_max_A
    drive = SoftwareInTheLoop(Loop(small.library, plant | {"inertia_kgm2": 1.5e-5 * torque_Nm}, flux_map))
    wired = turning.Connection(int(plant["pole_pairs"]), truth.reversed, truth.offset_rad)
    turning.connect(drive, wired, plate, "test")
    wanted = turning.SPEED_SHARE * plate.speed_max_rpm * turning.TURN / 60.0
    rows = spin.accelerate(drive, plate, wanted, "test")
    assert wanted < abs(turning.speed_rad_s(rows[-200:], drive.period_s)) < 1.2 * wanted


def test_the_picture_of_the_torque_says_where_the_magnet_comes_from(plate: Nameplate) -> None:
    spun = Spun(turning.Connection(4, False, 0.0), 0.02, 1e-6, 1e-5, 0.0, 300.0)
    assert plot.magnet_of(Found(spun=spun), plate) == "the measured"
    assert plot.magnet_of(Found(), plate) == "the nameplate's"
    assert plot.magnet_of(Found(), replace(plate, psi_f_source="data sheet")) == "a given"


def test_pole_pairs_are_about_those_of_the_nameplate(small: Motor, plate: Nameplate) -> None:
    """With 20 on the nameplate of a hub motor, whose speed is that of so many, two are none of its kind."""
    many = replace(small, plant=small.plant | {"pole_pairs": 20.0})
    drawn = [hidden.draw("ebike", seed, many, plate.i_max_A, connected=False)[2]["pole_pairs"] for seed in range(40)]
    assert min(drawn) >= 10 and max(drawn) <= 40 and len(set(drawn)) > 15
