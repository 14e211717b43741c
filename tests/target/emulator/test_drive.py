# SPDX-License-Identifier: Apache-2.0
"""The image in closed loop: torque within the demonstration's bounds, and bit for bit the same state as on the host."""

import numpy as np
import pytest

from fluxtrue_tools.demo import grid, step
from fluxtrue_tools.demo.experiment import Bench, run
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.library import Loop

RPM = 2 * np.pi / 60
PART_S = 0.25
OVER_CURRENT, OVER_VOLTAGE, INPUT, GATE = 1 << 0, 1 << 1, 1 << 5, 1 << 15
CONVERSION_COMPLETE, INTERRUPT_ENABLE = 0x80, 0x40
EVERY_LIMIT = 0x3F  # of torque, power, voltage and current, inverter, winding, low dc voltage
POINTS = [(speed, torque) for speed in grid.SPEEDS_RPM for torque in grid.TORQUES_NM]


def test_the_measured_machine_keeps_its_torque_in_four_quadrants(parts: Parts) -> None:
    motor = parts.emulated()
    specs = [grid.scenario(speed, torque, True, "firmware") for speed, torque in POINTS]
    done = grid.parallel([lambda spec=spec: run(motor, spec) for spec in specs], lambda: None)
    for (speed, torque), recording in zip(POINTS, done, strict=True):
        error = recording.torque_error_percent
        assert recording.fault_word == 0
        assert error is not None
        # The demonstration's bound: 0.5 % or 0.15 N·m.
        assert abs(error) <= max(0.5, 15.0 / abs(torque)), f"{speed} rpm, {torque} N·m: {error} %"


def test_a_torque_step_meets_the_demonstrations_bounds(parts: Parts) -> None:
    result = step.torque_step(Bench(parts.motor, parts.emulated()))
    assert len(result.bounds) == 4
    for bound in result.bounds:
        assert bound.met, bound.text()


# The drive consists of parts of PART_S. EVENTS: values that are set at the start of a part, so that every torque limit,
# a fault of the gate driver and every reset occur. RAMPS: dc voltage at the start and the end of a part. OTHER_MODE:
# parts with the other identification.
EVENTS: dict[int, dict[str, float]] = {
    2: {"torque_limit_drive_Nm": 60.0}, 3: {"torque_limit_drive_Nm": 1e4},
    10: {"power_limit_drive_W": 20e3}, 11: {"power_limit_drive_W": 1e6},
    12: {"emulator.inverter_C": 99.0}, 13: {"emulator.inverter_C": 40.0},
    17: {"plant.winding_C": 222.0}, 18: {"plant.winding_C": 90.0},
    21: {"enable": 0.0}, 22: {"fault_reset": 1.0}, 23: {"enable": 1.0},
    25: {"identification_reset": 1.0}, 26: {"identification": 0.0}, 27: {"identification": 1.0, "torque_loop": 0.0},
    28: {"torque_loop": 1.0},
    29: {"emulator.gate_fault": 1.0}, 30: {"emulator.gate_fault": 0.0, "enable": 0.0},
    31: {"fault_reset": 1.0}, 32: {"enable": 1.0},
}  # fmt: skip
RAMPS: dict[int, tuple[float, float]] = {5: (350.0, 170.0), 6: (170.0, 350.0), 20: (350.0, 450.0), 21: (450.0, 350.0)}
OTHER_MODE = range(36, 38)


def drive_with_shadow(loop: Loop, seconds: float) -> tuple[int, int]:
    """Drive with the shadow on the host: torques of both signs, speeds into field weakening and back, a weakening
    magnet, and all events. Returns the deratings and the faults that occurred."""
    torques = (80.0, -60.0, 120.0, -20.0, 5.0)
    speeds = (3000.0, 800.0, 6500.0, -2500.0)
    derating = faults = 0
    mode = loop.get("identification_mode")
    for name in ("emulator.shadow", "enable", "identification", "torque_loop"):
        loop.set(name, 1)
    parts_ = round(seconds / PART_S)
    for k in range(parts_):
        for name, value in EVENTS.get(k, {}).items():
            loop.set(name, value)
        loop.set("identification_mode", 1 - mode if k in OTHER_MODE else mode)
        loop.set("torque_requested_Nm", torques[k % len(torques)])
        start, stop = (speeds[(k + j) // 4 % len(speeds)] * RPM for j in (0, 1))
        weaker = 1 - 0.15 * k / parts_, 1 - 0.15 * (k + 1) / parts_
        ramps = {"plant.speed_rad_s": (start, stop), "plant.magnet_scale": weaker}
        loop.run(2500, ramps | ({"plant.vdc_V": RAMPS[k]} if k in RAMPS else {}))
        derating |= int(loop.get("derating"))
        faults |= int(loop.get("fault_word"))
    return derating, faults


def check_shadow(loop: Loop, periods: int) -> None:
    difference = loop._library.sim_shadow_difference(loop._sim)
    assert difference is None, difference
    # A period is compared if no activity is running at its end. The task may still run at the end of the first period
    # of a step; at the ends of the other nine it is idle, except in a few steps that take longer.
    assert loop.get("emulator.compared") >= 0.89 * periods


@pytest.mark.parametrize("mode", [0, 1], ids=["paper", "robust"])
def test_ten_seconds_of_driving_leave_the_same_bits_as_on_the_host(drive: Loop, mode: int) -> None:
    drive.set("identification_mode", mode)
    derating, faults = drive_with_shadow(drive, 10.0)
    check_shadow(drive, 100_000)
    assert derating & EVERY_LIMIT == EVERY_LIMIT
    # The short circuit starts with a current above the over-current level.
    assert faults == OVER_VOLTAGE | OVER_CURRENT | GATE
    assert drive.get("fault_word") == 0
    assert drive.get("truth.torque_Nm") == pytest.approx(5.0, abs=1.0)  # it makes torque again


def test_a_resolver_image_computes_the_same_bits(resolver_parts: Parts) -> None:
    motor = resolver_parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0, "current_noise_A_rms": 0.5}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        drive_with_shadow(loop, 1.0)
        check_shadow(loop, 10_000)
        assert loop.get("fault_word") == 0


def test_a_changed_bit_in_the_state_of_the_shadow_is_detected(drive: Loop) -> None:
    drive_with_shadow(drive, 0.25)
    before = drive.get("emulator.differing")
    drive._library.sim_shadow_disturb(drive._sim)
    drive.run(10)
    assert before == 0
    assert drive.get("emulator.differing") > 0


def test_the_timer_is_set_up_as_the_motor_file_says(parts: Parts, drive: Loop) -> None:
    assert drive.get("emulator.dead_time_s") == pytest.approx(parts.motor.plant["dead_time_s"], rel=1e-6)
    assert drive.get("emulator.pwm_period_s") == pytest.approx(1 / parts.motor.plant["pwm_hz"], rel=1e-6)


def test_a_fault_of_the_gate_driver_ends_torque_control_until_it_is_reset(drive: Loop) -> None:
    drive.set("enable", 1)
    drive.set("torque_requested_Nm", 80.0)
    drive.run(3000)
    assert drive.get("truth.torque_Nm") > 50
    drive.set("emulator.gate_fault", 1)
    drive.run(50)
    # At 3000 rpm the back-EMF is below the dc voltage, so no current flows through the diodes while the fault line
    # keeps the outputs off.
    assert int(drive.get("fault_word")) == GATE
    assert abs(drive.get("truth.torque_Nm")) < 0.5
    drive.set("emulator.gate_fault", 0)
    drive.run(2000)
    # Now the short circuit that the firmware commands as safe state takes effect: docs/theory/safe-state.md, section 5.
    assert int(drive.get("fault_word")) & GATE
    assert -10.0 < drive.get("truth.torque_Nm") < -3.0
    drive.set("enable", 0)
    drive.run(100)
    drive.set("fault_reset", 1)
    drive.run(100)
    drive.set("enable", 1)
    drive.run(3000)
    assert drive.get("fault_word") == 0
    assert drive.get("truth.torque_Nm") > 50


@pytest.mark.parametrize("failure", ["no conversion", "no interrupt"])
def test_samples_that_keep_failing_bring_the_safe_state(drive: Loop, failure: str) -> None:
    """Either the first conversion of each period finds its previous result unread, or the end of a conversion causes no
    interrupt: no conversion starts the fast ISR any more. The fault stays as long as its cause."""
    drive.set("enable", 1)
    drive.set("torque_requested_Nm", 80.0)
    drive.run(3000)
    assert drive.get("truth.torque_Nm") > 50
    core = Core.of_simulation(drive._library, drive._sim)

    def fail(periods: int) -> None:
        if failure == "no interrupt":
            core.set_register("ADC0.SC11", core.register("ADC0.SC11") & ~INTERRUPT_ENABLE)
        for _ in range(periods):
            drive.run(1)
            if failure == "no conversion":
                core.set_register("ADC0.SC10", core.register("ADC0.SC10") | CONVERSION_COMPLETE)

    fail(40)
    assert int(drive.get("fault_word")) & INPUT
    fail(100)
    drive.set("enable", 0)
    drive.set("fault_reset", 1)
    fail(100)
    assert int(drive.get("fault_word")) & INPUT
    assert core.resets == 0
    assert abs(drive.get("truth.torque_Nm")) < 0.5  # 3000 rpm: switching disabled


def test_a_fault_of_the_resolver_raises_the_angle_fault(resolver_parts: Parts) -> None:
    motor = resolver_parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 100.0, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.run(200)
        assert loop.get("fault_word") == 0
        loop.set("emulator.resolver_fault", 1)
        loop.run(10)
        assert int(loop.get("fault_word")) & 1 << 4
        loop.set("emulator.resolver_fault", 0)  # the converter keeps it until its register is read
        loop.set("fault_reset", 1)
        loop.run(100)
        assert int(loop.get("fault_word")) & 1 << 4
