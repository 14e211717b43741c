# SPDX-License-Identifier: Apache-2.0
"""Limits set by the vehicle, and limits of the drive itself."""

import numpy as np
import pytest
from report import Figures
from rig import Rig

TRUTH = "truth.torque_shaft_mean_Nm"
POWER = "truth.mechanical_W"


def settled(rig: Rig, *names: str) -> list[float]:
    rig.advance(1.0)
    trace = rig.record(names)
    rig.advance(0.2)
    return [float(trace[name].mean()) for name in names]


@pytest.mark.plant
@pytest.mark.parametrize("speed_rpm", [1500.0, -1500.0])
def test_torque_limits_hold_in_all_four_quadrants(rig: Rig, figures: Figures, speed_rpm: float) -> None:
    """Limits of 50 N·m to drive and 20 N·m to brake, with requests of 90 N·m in both directions."""
    rig.turn(speed_rpm)
    rig.ask(limit_drive_Nm=50.0, limit_regen_Nm=20.0)
    rig.start()
    trace = rig.record(["truth.time_s", TRUTH])
    rows = []
    for asked_Nm in (90.0, -90.0):
        rig.ask(torque_Nm=asked_Nm)
        drives = asked_Nm * speed_rpm > 0.0
        wanted_Nm = np.copysign(50.0 if drives else 20.0, asked_Nm)
        rig.advance(1.2)
        rows.append([asked_Nm, wanted_Nm, float(trace[TRUTH][-200:].mean())])
    figures.table(f"{speed_rpm:g} rpm", ["asked N·m", "allowed", "shaft"], rows)
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    figures.plot(f"Asked for +90 and then -90 N·m at {speed_rpm:g} rpm",
                 [("torque, N·m", [("shaft", time_s, trace[TRUTH])])])  # fmt: skip
    for asked_Nm, wanted_Nm, truth_Nm in rows:
        figures.promise(f"shaft less limit, asked {asked_Nm:g} N·m", truth_Nm - wanted_Nm, 0.3, "N·m")


@pytest.mark.plant
def test_a_limit_of_zero_is_no_torque(rig: Rig) -> None:
    rig.turn(1500.0)
    rig.ask(limit_drive_Nm=0.0, limit_regen_Nm=0.0)
    rig.start(90.0)
    assert abs(settled(rig, TRUTH)[0]) < 0.5


@pytest.mark.plant
def test_the_machine_gives_what_it_can_where_more_is_asked_for(rig: Rig, figures: Figures) -> None:
    """At high speed the voltage limits the torque: the shaft torque is the available torque on the bus."""
    rig.turn(8000.0, 1.0)
    rig.start(132.0)
    truth_Nm = settled(rig, TRUTH)[0]
    told_Nm = rig.signal("INV_Limits", "TorqueMax")
    assert 5.0 < truth_Nm < 131.0
    figures.promise("shaft less what the bus calls available", 100.0 * (truth_Nm / told_Nm - 1.0), 10.0, "%")


@pytest.mark.plant
@pytest.mark.parametrize(("torque_Nm", "limits_kW"), [(100.0, (12.0, 60.0)), (-100.0, (60.0, 12.0))],
                         ids=["drive", "regen"])  # fmt: skip
def test_the_battery_is_not_asked_for_more_power_than_it_allows(
    rig: Rig, figures: Figures, torque_Nm: float, limits_kW: tuple[float, float]
) -> None:
    rig.power_limits_kW = limits_kW
    rig.turn(3000.0)
    rig.start(torque_Nm)
    trace = rig.record(["truth.time_s", "truth.idc_A", "truth.vdc_V", TRUTH])
    rig.advance(1.5)
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    power_kW = 1e-3 * trace["truth.idc_A"] * trace["truth.vdc_V"]
    power, torque = [("dc link", time_s, power_kW)], [("shaft", time_s, trace[TRUTH])]
    figures.plot("Battery allows 12 kW", [("power, kW", power), ("torque, N·m", torque)])
    last = time_s > 1.0
    figures.promise("largest power", np.abs(power_kW).max() / 12.0, 1.1, "of what is allowed")
    figures.promise("power at the end less 12 kW", np.abs(power_kW[last].mean()) - 12.0, 1.2, "kW")
    assert rig.signal("INV_DcLink", "DeratingReason") == 4.0


@pytest.mark.plant
def test_a_hot_inverter_derates_says_why_and_trips_only_without_torque(rig: Rig, figures: Figures) -> None:
    rig.expected.faults = True
    rig.turn(1500.0)
    rig.start(120.0)
    rig.advance(0.5)
    trace = rig.record(["truth.time_s", TRUTH])
    rig.stand.ramp("board.inverter_C", 130.0, 9.0)
    reasons, temperatures = [], []
    while rig.state != "fault" and len(reasons) < 100:
        rig.advance(0.1)
        reasons.append((rig.state, rig.signal("INV_DcLink", "DeratingReason")))
        temperatures.append(rig.stand.get("board.inverter_C")[0])
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    torque_Nm = trace[TRUTH]
    figures.plot("The inverter warms by 10 K/s", [
        ("torque, N·m", [("shaft", time_s, torque_Nm)]),
        ("temperature, °C", [("inverter", 0.1 * np.arange(1, len(temperatures) + 1), temperatures)]),
    ])  # fmt: skip
    derated = [reason for state, reason in reasons if state == "derate"]
    assert len(derated) >= 5 and set(derated) == {1.0}, "half a second or more, and because of the temperature"
    assert rig.state == "fault"
    assert abs(torque_Nm[-300]) < 15.0, "next to no torque was left when it tripped"
