# SPDX-License-Identifier: Apache-2.0
"""The battery's voltage on the bus: what precharge and the dc voltage sensor are compared with."""

import numpy as np
import pytest
from report import Figures
from rig import Rig

BATTERY_V = 350.0
NEAR, MISMATCH = 0.05, 0.08  # of the battery's voltage
PRECHARGE, BATTERY_VOLTAGE = 1 << 1, 1 << 7
READY = 3  # of State
VDC = "truth.vdc_V"
# Of the precharge in the plant: its time constant with the capacitor of the virtual ECU.
PRECHARGE_OHM = 0.02 / 500e-6


def ecu_faults(rig: Rig) -> int:
    rig.advance(0.11)  # the cycle of the message and a margin
    return int(rig.signal("INV_Faults", "EcuFaults"))


def tell(rig: Rig, battery_V: float) -> None:
    """The bus transmits the battery's voltage, and no limit of its power."""
    rig.power_limits_kW, rig.battery_V = (600.0, 600.0), battery_V
    rig.advance(0.3)


def precharge(rig: Rig, state: str) -> float:
    """Charges the dc link until this state; the result is the step of the dc voltage when the contactor closes."""
    trace = rig.record([VDC], 1)
    rig.ask(mode="torque")
    rig.wait_for(state, 4.0)
    return float(np.abs(np.diff(trace[VDC])).max())


@pytest.mark.plant
@pytest.mark.parametrize("precharge_s", [0.02, 0.3])
def test_the_contactor_closes_only_near_the_battery(rig: Rig, figures: Figures, precharge_s: float) -> None:
    """A slow precharge has settled, in the old sense, long before the capacitor is charged."""
    rig.stand.set(precharge_s=precharge_s)
    tell(rig, BATTERY_V)
    step_V = precharge(rig, "ready")
    figures.promise(f"step of the dc voltage, {precharge_s:g} s", step_V, NEAR * BATTERY_V, "V")


@pytest.mark.plant
def test_without_the_signal_the_voltage_only_has_to_settle(rig: Rig) -> None:
    rig.stand.set(dc_load_ohm=4.0 * PRECHARGE_OHM)
    rig.power_limits_kW = (600.0, 600.0)
    assert precharge(rig, "ready") == pytest.approx(0.2 * BATTERY_V, abs=1.0)


@pytest.mark.plant
@pytest.mark.parametrize(
    ("cause", "told_V", "fault"),
    [
        ({"precharge_open": 1.0}, BATTERY_V, PRECHARGE),
        ({"dc_load_ohm": 0.1}, BATTERY_V, PRECHARGE),
        ({"dc_load_ohm": 4.0 * PRECHARGE_OHM}, BATTERY_V, BATTERY_VOLTAGE),
        ({"vdc_gain": 0.9}, BATTERY_V, BATTERY_VOLTAGE),
        ({"vdc_gain": 1.0}, 0.9 * BATTERY_V, BATTERY_VOLTAGE),
        ({"vdc_gain": 1.0}, 1.1 * BATTERY_V, BATTERY_VOLTAGE),
        ({"vdc_gain": 1.0}, 3.0, BATTERY_VOLTAGE),
    ],
    ids=["resistor open", "dc link shorted", "dc link loaded", "sensor low", "told low", "told high", "told nothing"],
)
def test_a_precharge_beside_the_battery_ends_in_a_named_fault_with_the_contactor_open(
    rig: Rig, cause: dict[str, float], told_V: float, fault: int
) -> None:
    rig.expected.faults = True
    rig.stand.set(**cause)
    tell(rig, told_V)
    precharge(rig, "fault")
    assert READY not in rig.series("INV_Status", "State")[1]  # the first state that closes the contactor
    assert ecu_faults(rig) == fault
    assert int(rig.signal("INV_Faults", "FirstFault")) == 32 + fault.bit_length()


@pytest.mark.plant
def test_a_battery_voltage_that_is_lost_during_precharge_keeps_the_contactor_open(rig: Rig) -> None:
    rig.expected.faults = True
    rig.stand.set(precharge_s=0.4)
    tell(rig, BATTERY_V)
    rig.ask(mode="torque")
    rig.wait_for("precharge")
    rig.power_limits_kW = None
    rig.wait_for("fault", 4.0)
    assert ecu_faults(rig) == BATTERY_VOLTAGE


@pytest.mark.plant
@pytest.mark.parametrize("gain", [0.7, 0.8, 0.9, 1.1, 1.2])
@pytest.mark.parametrize(("speed_rpm", "asked_Nm"), [(0.0, 60.0), (100.0, -30.0), (3000.0, 60.0), (6000.0, 6.0)])
def test_a_wrong_dc_voltage_sensor_ends_the_torque(
    rig: Rig, figures: Figures, speed_rpm: float, asked_Nm: float, gain: float
) -> None:
    """The monitors of the drive find it only at speed and with torque, but then earlier; x 1.3 is an over-voltage."""
    rig.expected.faults = True
    tell(rig, BATTERY_V)
    rig.turn(speed_rpm)
    rig.start(asked_Nm)
    rig.advance(1.0)
    trace = rig.record(["truth.time_s", "truth.torque_shaft_mean_Nm"])
    start_s = float(rig.stand.get("truth.time_s")[0])
    rig.stand.set(vdc_gain=gain)
    rig.advance(0.6)
    time_s, torque_Nm = trace["truth.time_s"] - start_s, trace["truth.torque_shaft_mean_Nm"]
    at = f"{speed_rpm:g} rpm, {asked_Nm:g} N·m, sensor x {gain:g}"
    figures.plot(at, [("torque, N·m", [("shaft", time_s, torque_Nm)])])
    gone_ms = 1e3 * float(time_s[np.abs(torque_Nm) > 5.0].max())
    figures.promise(f"time until no torque, {at}", gone_ms, 320.0, "ms")
    assert rig.state in ("safe_state", "fault")
    if speed_rpm < 200.0:
        assert (rig.signal("INV_Faults", "DriveFaults"), ecu_faults(rig)) == (0, BATTERY_VOLTAGE)


@pytest.mark.plant
def test_a_battery_that_gives_way_under_load_is_no_mismatch(rig: Rig) -> None:
    """12 % within 20 ms, transmitted up to a cycle later, and 5 % that are not transmitted."""
    tell(rig, BATTERY_V)
    rig.turn(3000.0)
    rig.start(60.0)
    for told_V in (0.88 * BATTERY_V, BATTERY_V, 0.93 * BATTERY_V):
        rig.stand.ramp("plant.vdc_V", told_V, 0.02)
        rig.advance(0.1)
        rig.battery_V = 1.05 * told_V
        rig.advance(0.6)
        assert rig.state in ("run", "derate")
