# SPDX-License-Identifier: Apache-2.0
"""The identified values survive a power cycle. The torque is that of the plant."""

import math

import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import MEMORY_SIZE, Loop
from fluxtrue_tools.sim.motor import Motor

RPM = 2.0 * math.pi / 60.0
MAGNET, COMMAND_NM, SPEED_RPM = 0.88, 60.0, 2000.0
POINTS = ((1500, 50), (2500, 20), (600, -40), (3000, 70), (4500, 30), (1200, -60), (5000, 60), (2000, 90))


def power_on(motor: Motor, memory: bytes | None = None) -> Loop:
    loop = Loop(motor.library, motor.plant | {"imposed_speed": 1.0, "magnet_scale": MAGNET}, motor.flux_map)
    if memory is not None:
        loop.remember(memory)
    loop.record(("truth.torque_mean_Nm", "fault_word"), 10)
    return loop


def to(loop: Loop, before: tuple[float, float], after: tuple[float, float], seconds: float) -> float:
    """Ramp from one speed and torque to another; the mean torque of the last 10 ms."""
    ramps = {"plant.speed_rad_s": (before[0] * RPM, after[0] * RPM), "torque_requested_Nm": (before[1], after[1])}
    rows = loop.run(round(seconds * 1e4), ramps)
    assert rows[:, 1].max() == 0.0
    return float(rows[-10:, 0].mean())


def error_after_enabling(motor: Motor, memory: bytes | None) -> float:
    """Torque error in percent, 0.1 s after switching was enabled at speed and 50 ms after the torque was reached."""
    with power_on(motor, memory) as loop:
        assert loop.get("memory_recalled") == float(memory is not None)
        to(loop, (0.0, 0.0), (SPEED_RPM, 0.0), 0.5)
        loop.set("enable", 1.0)
        to(loop, (SPEED_RPM, 0.0), (SPEED_RPM, COMMAND_NM), 0.05)
        return 100.0 * (to(loop, (SPEED_RPM, COMMAND_NM), (SPEED_RPM, COMMAND_NM), 0.05) / COMMAND_NM - 1.0)


@pytest.fixture(scope="module")
def memory(hsm1: Motor) -> bytes:
    """The contents of the flash after twenty seconds of driving and a stop."""
    with power_on(hsm1) as loop:
        loop.set("enable", 1.0)
        at = (0.0, 0.0)
        for rpm, torque in POINTS:
            to(loop, at, (rpm, torque), 1.0)
            at = (rpm, torque / 2)
            to(loop, (rpm, torque), at, 1.5)
        to(loop, at, (0.0, 0.0), 1.0)
        assert loop.get("memory_saves") == 0.0  # nothing is saved while the drive runs
        loop.set("enable", 0.0)
        to(loop, (0.0, 0.0), (0.0, 0.0), 0.2)
        assert loop.get("memory_saves") == 1.0
        return loop.memory()


def without_loop(motor: Motor) -> float:
    with power_on(motor) as loop:
        loop.set("torque_loop", 0.0)
        loop.set("identification", 0.0)
        loop.set("enable", 1.0)
        to(loop, (0.0, 0.0), (SPEED_RPM, COMMAND_NM), 0.5)
        return 100.0 * (to(loop, (SPEED_RPM, COMMAND_NM), (SPEED_RPM, COMMAND_NM), 0.05) / COMMAND_NM - 1.0)


def test_with_the_memory_the_first_torque_is_right(hsm1: Motor, memory: bytes) -> None:
    kept = error_after_enabling(hsm1, memory)
    print(f"tables {without_loop(hsm1):.2f} %, first start {error_after_enabling(hsm1, None):.2f} %, kept {kept:.2f} %")
    # The magnet is 12 % weak and makes about two thirds of the torque; the iron is supplied.
    assert without_loop(hsm1) < -5.0
    assert abs(kept) <= 1.0


def test_after_a_damaged_memory_the_drive_starts_from_the_priors(hsm1: Motor, memory: bytes) -> None:
    with power_on(hsm1, bytes(b ^ 0x01 for b in memory)) as damaged, power_on(hsm1) as fresh:
        assert damaged.get("memory_recalled") == 0.0
        for name in ("psi_f_Vs", "r_ohm", "lq_scale", "drop_V"):
            assert damaged.get(name) == fresh.get(name)


def test_the_memory_of_another_motor_is_not_used(hsm1: Motor, paper: Motor, memory: bytes) -> None:
    with Loop(paper.library, paper.plant, paper.flux_map) as loop:
        loop.remember(memory)
        assert loop.get("memory_recalled") == 0.0


def test_the_memory_is_given_whole_and_before_the_first_period(hsm1: Motor, memory: bytes) -> None:
    assert len(memory) == MEMORY_SIZE
    with power_on(hsm1) as loop:
        with pytest.raises(FluxtrueError, match="out of range"):
            loop.remember(memory[:-1])
        loop.run(1)
        with pytest.raises(FluxtrueError, match="read only"):
            loop.remember(memory)


def test_the_torque_loop_has_no_confidence_in_recalled_values_before_they_are_confirmed(
    hsm1: Motor, memory: bytes
) -> None:
    with power_on(hsm1, memory) as loop:
        to(loop, (0.0, 0.0), (SPEED_RPM, 0.0), 0.5)
        assert loop.get("torque_confidence") == 0.0
        loop.set("enable", 1.0)
        to(loop, (SPEED_RPM, 0.0), (SPEED_RPM, COMMAND_NM), 0.05)
        to(loop, (SPEED_RPM, COMMAND_NM), (SPEED_RPM, COMMAND_NM), 0.5)
        assert loop.get("torque_confidence") > 0.9
