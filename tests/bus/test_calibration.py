# SPDX-License-Identifier: Apache-2.0
"""Limits, reactions to bad frames and time-outs work with each calibratable value at both ends of its range."""

import ctypes
import math
from collections.abc import Iterator

import pytest
from ecu import COMMAND, LIMITS, Ecu

OUT_OF_RANGE = -2
# Name, lowest, smallest non-zero (None: the lowest is not zero), highest; from firmware/calibration/calibration_list.h
RANGES = {
    "torque_slew_Nm_per_s": (0.0, 10.0, 1e6),
    "observer_m": (2.0, None, 4.0),
    "flux_bandwidth_rad_s": (0.0, 1e-3, 500.0),
    "resistance_bandwidth_rad_s": (0.0, 1e-3, 150.0),
    "torque_loop_bandwidth_rad_s": (0.0, 0.04, 500.0),
    "dead_time_compensation": (0.0, 0.01, 1.5),
}
ENDS = [(name, value) for name, ends in RANGES.items() for value in ends if value is not None]


def calibrate(ecu: Ecu, name: str, value: float) -> int:
    return int(ecu.lib.sim_set(ecu.sim, name.encode(), ctypes.c_double(value)))


@pytest.fixture(params=ENDS, ids=lambda p: f"{p[0]}={p[1]:g}")
def calibrated(request: pytest.FixtureRequest) -> Iterator[Ecu]:
    """In state run at 955 rpm with 30 N·m, calibrated while it drives."""
    ecu = Ecu()
    ecu.power_up()
    ecu.speed_rad_s = 0.0
    while ecu.speed_rad_s < 100.0:
        ecu.speed_rad_s += 1.0
        ecu.run(1)
    ecu.send(LIMITS, {"PowerLimitDrive": 100.0, "PowerLimitRegen": 50.0})
    ecu.run(5)
    ecu.send(LIMITS, {"PowerLimitDrive": 100.0, "PowerLimitRegen": 50.0})
    ecu.run(200, TorqueRequested=30.0)
    assert calibrate(ecu, *request.param) == 0
    ecu.run(100)
    assert 25.0 < ecu.truth("torque_Nm") < 35.0
    yield ecu
    ecu.close()


def torque_after(ecu: Ecu, milliseconds: int) -> float:
    ecu.run(milliseconds)
    return abs(ecu.truth("torque_Nm"))


def test_a_value_that_would_become_zero_is_refused() -> None:
    ecu = Ecu()
    for name, (low, least, high) in RANGES.items():
        before = ecu.get(name)
        assert calibrate(ecu, name, math.nextafter(high, math.inf) * 1.001) == OUT_OF_RANGE
        assert calibrate(ecu, name, low - 0.01) == OUT_OF_RANGE
        if least is not None:
            assert calibrate(ecu, name, 1e-9) == OUT_OF_RANGE, name
        assert ecu.get(name) == before
    ecu.close()


def test_a_limit_of_the_vehicle_acts(calibrated: Ecu) -> None:
    calibrated.run(0, TorqueLimitDrive=0.0)
    assert torque_after(calibrated, 60) < 1.0


def test_a_lost_command_takes_the_torque_away(calibrated: Ecu) -> None:
    calibrated.talking = False
    assert torque_after(calibrated, 60) < 1.0


def test_bad_commands_take_the_torque_away(calibrated: Ecu) -> None:
    frame_id = calibrated.dbc.get_message_by_name(COMMAND).frame_id
    calibrated.talking = False
    for _ in range(3):
        data = calibrated.encode(COMMAND, calibrated.command)
        calibrated.put(frame_id, bytes([data[0] ^ 1]) + data[1:])
        calibrated.run(1)
    assert torque_after(calibrated, 60) < 1.0


def test_a_power_limit_that_falls_to_zero_acts(calibrated: Ecu) -> None:
    calibrated.send(LIMITS, {"PowerLimitDrive": 0.0, "PowerLimitRegen": 0.0})
    assert torque_after(calibrated, 60) < 2.0


def test_a_temperature_at_the_end_of_its_line_acts(calibrated: Ecu) -> None:
    calibrated.set("winding_C", 229.0)
    assert torque_after(calibrated, 60) < 8.0
