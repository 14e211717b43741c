# SPDX-License-Identifier: Apache-2.0
"""The offset of the dc voltage's sensor: found, refused where it cannot be known, and what it does to a drive."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bus_stand import bus_stand

from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import campaign, dc_zero, hidden
from fluxtrue_tools.commission.dc_zero import DcZero, UnclearError, falling, settled
from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.proof import STEPS
from fluxtrue_tools.commission.score import dc_zero_error, resistance_error
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.simulated import simulated
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

MACHINES = [("saturated", 101), ("pmasynrm", 102), ("hsm1", 105), ("linear", 108)]  # two with an offset below 0
SMALL = [("hub", 100), ("hub", 103)]
TIMES = np.linspace(0.0, 1.0, 1000)
R_LEFT = 0.004  # of the resistance, beyond the gains of the sensors
OFFSET_V = 16.0  # 3 % of the full scale
WEAKENED_RPM = 6000.0


def shown(volts: Array, known: Nameplate) -> Array:
    """As a converter shows it, without noise."""
    lsb_V = known.v_dc_full_scale_V / 2**known.adc_bits
    return np.asarray(np.maximum(np.round(volts / lsb_V), 0.0) * lsb_V)


def exponential(charge_V: float, rate: float, offset_V: float) -> Array:
    return np.asarray(charge_V * np.exp(-rate * TIMES) + offset_V)


@pytest.mark.parametrize(("name", "seed"), MACHINES)
def test_the_offset_of_a_hidden_machine(name: str, seed: int, unknown: Motor, known: Nameplate) -> None:
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A)
    found = run(drive, chosen(("offsets",)), known, lambda _: None).dc_zero
    assert not found.unknown
    error = dc_zero_error(found, truth)
    print(f"{name} {seed}: {truth.plant['vdc_offset_V']:+.3f} V, error {100 * error:+.4f} %, {found.how}")
    assert abs(truth.plant["vdc_offset_V"]) > STEPS["dc_zero"] * known.v_dc_full_scale_V  # 0 V would fail
    assert abs(error) <= STEPS["dc_zero"]
    assert abs(found.value_V - truth.plant["vdc_offset_V"]) <= 4.0 * found.sigma_V
    assert drive.get("vdc_V") > 300.0  # the others have their battery
    assert drive.get("fault_word") == 0.0


@pytest.mark.parametrize(("name", "seed"), SMALL)
def test_the_offset_of_a_small_machine(name: str, seed: int, small: Motor, plate: Nameplate) -> None:
    drive, truth = hidden.make(name, seed, small, plate.i_max_A)
    found = run(drive, chosen(("offsets",)), plate, lambda _: None).dc_zero
    assert not found.unknown and abs(dc_zero_error(found, truth)) <= STEPS["dc_zero"]


def test_the_campaign_scores_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = campaign.one("hsm1", 105, folder, True, False)
    assert values is not None
    assert 0.0 < abs(values[campaign.DC_ZERO]) <= campaign.BOUNDS[campaign.DC_ZERO] == pytest.approx(0.1)
    assert campaign.DC_ZERO.split(",", maxsplit=1)[0] in capsys.readouterr().out


def test_the_machines_are_what_they_were_without_it(
    unknown: Motor, known: Nameplate, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drawn with a generator of its own."""
    _, _, plant = hidden.draw("hsm1", 105, unknown, known.i_max_A)
    monkeypatch.setattr(hidden, "_dc_zero", lambda *_: {})
    _, _, before = hidden.draw("hsm1", 105, unknown, known.i_max_A)
    assert {name for name in plant if plant[name] != before.get(name)} == {"vdc_offset_V", "vdc_least_V"}


@pytest.mark.parametrize(("offset_V", "noise_V"), [(0.5, 0.0), (20.0, 0.4)])
def test_a_discharged_link_shows_the_offset(offset_V: float, noise_V: float, known: Nameplate) -> None:
    noise = np.random.default_rng(5).normal(0.0, noise_V, len(TIMES))
    found_V, sigma_V = settled(shown(offset_V + noise, known), known)
    assert abs(found_V - offset_V) <= 2.0 * sigma_V <= 0.2


@pytest.mark.parametrize(
    ("volts", "why"),
    [
        (exponential(0.0, 1.0, 345.0), "still charged"),
        (exponential(0.0, 1.0, 60.0), "still charged: the dc link shows, with its contactor open, 60"),
        (exponential(8.0, 0.5, 1.0), "not discharged: with its contactor open the dc link changes by -3"),
        (exponential(1.0, 0.3, 2.0), "not discharged"),
        (exponential(0.0, 1.0, 0.0), "shows 0"),
        (exponential(0.0, 1.0, -4.0), "shows 0"),
    ],
)
def test_a_link_that_is_not_known_to_be_discharged_is_refused(volts: Array, why: str, known: Nameplate) -> None:
    with pytest.raises(UnclearError, match=why):
        settled(shown(volts, known), known)


@pytest.mark.parametrize("offset_V", [-20.0, -5.0, -0.3, 0.0, 0.3, 5.0])
@pytest.mark.parametrize("end", [1.0, 0.4])
def test_a_fall_goes_to_the_offset(offset_V: float, end: float, known: Nameplate) -> None:
    """Of either sign; also of a discharge that ends at 60 V and leaves the rest in the dc link."""
    volts = exponential(350.0, 4.4, offset_V)
    volts[int(end * len(volts)) :] = volts[min(int(end * len(volts)), len(volts) - 1)]
    found_V, sigma_V = falling(shown(volts, known), known)
    assert abs(found_V - offset_V) <= 4.0 * sigma_V <= 0.2


@pytest.mark.parametrize(
    ("volts", "why"),
    [
        (exponential(0.0, 1.0, 350.0), "not fallen"),
        (np.zeros(1), "not fallen"),
        (exponential(350.0, 0.3, 0.0), "not fallen"),
        (np.maximum(350.0 - 500.0 * TIMES, 0.0), "not fall as through a resistor"),  # a constant current
        (np.sqrt(np.maximum(350.0**2 - 2e5 * TIMES, 0.0)), "not fall as through a resistor|falls towards"),  # power
        (exponential(300.0, 6.0, 40.0), "falls towards 40"),
    ],
)
def test_a_fall_that_is_none_through_a_resistor_is_refused(volts: Array, why: str, known: Nameplate) -> None:
    with pytest.raises(UnclearError, match=why):
        falling(shown(volts, known), known)


class Link(SoftwareInTheLoop):
    """With chosen readings."""

    readings: tuple[str, Array, Array]

    def discharge(self) -> str:
        return self.readings[0]

    def dc_link_V(self, seconds: float) -> Array:
        return self.readings[1]

    def falling_link_V(self) -> Array:
        return self.readings[2]


@pytest.mark.parametrize(
    ("why", "at_rest_V", "fall", "value_V", "how"),
    [
        ("", 1.0, exponential(350.0, 5.0, 1.0), 1.0, "as its discharge confirms"),
        ("", 1.0, np.zeros(1), 1.0, "a charge that it loses slowly is not excluded"),
        ("", 8.0, np.zeros(1), None, "V with its contactor open, which may be a charge; "),
        ("", 6.0, exponential(350.0, 5.0, 1.0), 1.0, "discharged it still had 5"),  # lost within minutes
        ("", 60.0, exponential(350.0, 5.0, 1.0), 1.0, "end of the dc link's discharge"),
        ("state fault", 1.0, np.zeros(1), None, "state fault; "),
        ("", 1.0, exponential(350.0, 5.0, 5.0), None, "falls towards 5 V and shows"),
        ("", 0.0, np.zeros(1), None, "shows 0"),
    ],
)
def test_both_measurements_together(why: str, at_rest_V: float, fall: Array, value_V: float | None, how: str,
                                    unknown: Motor, known: Nameplate) -> None:  # fmt: skip
    _, flux_map, plant = hidden.draw("hsm1", 105, unknown, known.i_max_A)
    drive = Link(Loop(unknown.library, plant, flux_map))
    drive.readings = why, shown(np.full(1000, at_rest_V), known), shown(fall, known)
    found = dc_zero.measure(drive, replace(known, v_dc_offset_V=2.0))
    if value_V is None:
        assert how in found.unknown and found.value_V == 2.0 and found.shown_V == 0.0
    else:
        assert how in found.how and not found.unknown
        assert found.value_V == pytest.approx(2.0 + value_V, abs=0.1)


def test_over_can_also_with_what_a_discharge_leaves(unknown: Motor, known: Nameplate, tmp_path: Path) -> None:
    with bus_stand(unknown, known, tmp_path, ("saturated", 12), connected=True) as stand:
        first = run(stand.drive, chosen(("offsets",)), known, lambda _: None).dc_zero
        assert "confirms" in first.how and abs(dc_zero_error(first, stand.truth)) <= STEPS["dc_zero"]
        assert stand.line.state == "standby"
        again = run(stand.drive, chosen(("offsets",)), known, lambda _: None).dc_zero  # 60 V are left
        assert again.how == dc_zero.FALLEN and abs(dc_zero_error(again, stand.truth)) <= STEPS["dc_zero"]
        stand.channel.set(precharge_open=1.0)
        refused = run(stand.drive, chosen(("offsets",)), known, lambda _: None).dc_zero
        assert "still charged" in refused.unknown and "not fallen" in refused.unknown
        stand.drive.switch_off()


@pytest.mark.parametrize("offset_V", [-OFFSET_V, OFFSET_V])
def test_the_later_steps_take_it_away(offset_V: float, unknown: Motor, known: Nameplate) -> None:
    """5 % of the dc voltage: without it the resistance would be as wrong."""
    drive, truth = hidden.make("saturated", 12, unknown, known.i_max_A, changed={"vdc_offset_V": offset_V})
    found = run(drive, chosen(("resistance",)), known, lambda _: None)
    assert found.resistance is not None
    _, left = resistance_error(found.resistance.r_ohm, truth)
    print(f"{offset_V:+g} V: R {100 * left:+.2f} % beyond the gains")
    assert abs(left) <= R_LEFT


def weakened(scratch: Path, subtracted_V: float, offset_V: float) -> tuple[float, float, float]:
    """Limit and torque in field weakening, and the dc voltage that the drive takes."""
    scratch.mkdir()
    motor = load_motor(ROOT / "firmware" / "motors" / "hsm1")
    inverter = motor.config.inverter.model_copy(update={"v_dc_offset_V": subtracted_V})
    motor = replace(motor, config=motor.config.model_copy(update={"inverter": inverter}))
    with simulated(motor, scratch).loop({"vdc_offset_V": offset_V}) as loop:
        loop.run_s(0.1)
        loop.set("enable", 1.0)
        loop.set("torque_loop", 0.0)
        loop.run(round(1.0 / loop.period_s), {"plant.speed_rad_s": (0.0, WEAKENED_RPM * math.pi / 30.0)})
        loop.set("torque_requested_Nm", motor.config.machine.torque_max_Nm)
        loop.run_s(0.5)
        loop.record(("torque_limited_Nm", "truth.torque_Nm", "vdc_V", "fault_word"))
        rows = loop.run_s(0.05)
    assert not rows[:, 3].any()
    limit_Nm, torque_Nm, vdc_V = map(float, rows[:, :3].mean(axis=0))
    return limit_Nm, torque_Nm, vdc_V


def test_a_drive_subtracts_it(tmp_path: Path) -> None:
    """In field weakening the torque is limited by the dc voltage that the drive takes: with one that is too large it
    promises a torque that it does not make, with one that is too small it makes less than it could."""
    right = weakened(tmp_path / "right", 0.0, 0.0)
    assert right[0] == pytest.approx(right[1], rel=0.01)
    for name, offset_V in (("more", OFFSET_V), ("less", -OFFSET_V)):
        corrected = weakened(tmp_path / name, offset_V, offset_V)
        wrong = weakened(tmp_path / f"{name}-wrong", 0.0, offset_V)
        print(f"{offset_V:+g} V: N·m, N·m, V: right {right}, corrected {corrected}, wrong {wrong}")
        assert corrected[:2] == pytest.approx(right[:2], rel=0.002)
        assert abs(corrected[2] - right[2]) < 0.2 and wrong[2] - right[2] == pytest.approx(offset_V, abs=0.2)
        missed = wrong[0] - wrong[1] if offset_V > 0.0 else right[1] - wrong[1]
        assert missed > 0.03 * right[1]


def test_the_folder_names_its_source(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                     monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    def commissioned(out: Path) -> str:
        options = ["--motor", str(folder), "--machine", "hsm1", "--seed", "105", "--step", "resistance"]
        assert command(["commission", *options, "--out", str(out)]) == 0
        return (out / "motor.toml").read_text(encoding="utf-8")

    text = commissioned(tmp_path / "found")
    (line,) = (line for line in text.splitlines() if line.startswith("v_dc_offset_V"))
    assert "measured by fluxtrue commission: end of the dc link's discharge, ±" in line
    assert tomllib.loads(text)["inverter"]["v_dc_offset_V"] == pytest.approx(-5.124, abs=0.1)
    assert "dc-voltage sensor: offset -5.1" in capsys.readouterr().out
    monkeypatch.setattr(dc_zero, "measure", lambda *_: DcZero(unknown="still charged"))
    assert "v_dc_offset_V" not in commissioned(tmp_path / "not")
    assert "dc-voltage sensor: offset not found, +0 V as before: still charged" in capsys.readouterr().out
