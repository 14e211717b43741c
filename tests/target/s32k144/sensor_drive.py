# SPDX-License-Identifier: Apache-2.0
"""A fast drive for the checks of angle sensors: an angle of another instant than the currents' shows in the torque."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rotor_frame import error_A

from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop

FAST_RPM = 6500.0
RAD_S = 0.10471975511965977
TORQUE = 40.0
ANGLE = 1 << 4
RAMP_PERIODS = 200
CURRENT_A = 0.3


@contextmanager
def driving(parts: Parts, **errors: float) -> Iterator[Loop]:
    """errors: values of the emulator by name, from the start on."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        for name, value in errors.items():
            loop.set(f"emulator.{name}", value)
        loop.run(3000, {"plant.speed_rad_s": (0.0, FAST_RPM * RAD_S)})
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", TORQUE)
        loop.run(1000)
        yield loop


def is_right(loop: Loop) -> bool:
    near = error_A(loop) < CURRENT_A
    return near and loop.get("fault_word") == 0 and abs(loop.get("truth.torque_Nm") - TORQUE) < 1.0


def the_angle_is_that_of_the_sampling_instant(parts: Parts) -> None:
    with driving(parts) as loop:
        assert is_right(loop)
        loop.run(RAMP_PERIODS, {"plant.speed_rad_s": (FAST_RPM * RAD_S, 0.98 * FAST_RPM * RAD_S)})
        assert is_right(loop)
