# SPDX-License-Identifier: Apache-2.0
"""The incremental encoder of the S32K144's image on the emulated processor: no torque before its index has passed, the
movement that carries a free shaft past it, the absolute angle afterwards, and planted errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from listener import Listener
from mover import Mover
from planting import FIRMWARE, PlantedError, assert_found
from rotor_frame import error_A

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.image import V_DC, Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop

RAD_S = 0.10471975511965977
TORQUE = 40.0
TURN_PERIODS = 400  # at 1500 rpm
SMALL_NM = 5.0
FRICTION_NM = 0.3
CURRENT_PERCENT = 10.0  # of the largest current: it turns the shaft against its friction
LAG_RPM = 250.0  # of the tracked speed at 30,000 rpm per second; a jump of the angle makes it 377


@pytest.fixture(scope="module")
def encoder() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", angle="encoder")


@pytest.fixture(scope="module")
def flashed(encoder: Parts) -> Parts:
    return build.prepare("hsm1", angle="encoder", flashed=True)


@contextmanager
def started_beside_the_index(parts: Parts) -> Iterator[Loop]:
    """The rotor stands 0.3 turns beyond the index when the processor's supply comes."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": V_DC}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        speed = 1500.0 * RAD_S
        ramp = 100
        loop.run(ramp, {"plant.speed_rad_s": (0.0, speed)})
        loop.run(int(0.3 * TURN_PERIODS) - ramp)
        loop.run(ramp, {"plant.speed_rad_s": (speed, 0.0)})
        loop.set("emulator.power_cycle", 1)
        yield loop


def turn(loop: Loop, rpm: float, turns: float) -> None:
    """Accelerate by 3000 rpm in 100 ms, then turn this far."""
    speed = rpm * RAD_S
    loop.run(max(int(abs(rpm) / 3.0), 1), {"plant.speed_rad_s": (0.0, speed)})
    loop.run(int(turns * 600000.0 / abs(rpm)))


def torque_waits_for_the_index(parts: Parts) -> None:
    """Half a turn without the index: nothing switches. Then the index passes, at speed and in either direction."""
    for sign in (1.0, -1.0):
        with started_beside_the_index(parts) as loop:
            loop.set("enable", 1)
            loop.set("torque_requested_Nm", TORQUE)
            turn(loop, sign * 300.0, 0.15)
            assert loop.get("emulator.gates") == 0
            assert loop.get("run_state") == 0
            loop.run(2000)
            assert loop.get("run_state") == 1
            assert loop.get("fault_word") == 0
            assert loop.get("truth.torque_Nm") == pytest.approx(TORQUE, abs=1.0)


def the_angle_keeps_its_speed_when_the_index_passes(parts: Parts) -> None:
    """At 6500 rpm, with switching disabled: neither the speed nor the faults notice it."""
    with started_beside_the_index(parts) as loop:
        loop.record(("speed_rpm", "truth.speed_rpm"), 1)
        speed = loop.run(2200, {"plant.speed_rad_s": (0.0, 6500.0 * RAD_S)})
        assert np.max(np.abs(speed[:, 0] - speed[:, 1])) < LAG_RPM
        loop.run(500)
        assert loop.get("fault_word") == 0
        assert loop.get("speed_rpm") == pytest.approx(6500.0, rel=0.01)
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", TORQUE)
        loop.run(1000)
        assert error_A(loop) < 0.3
        assert loop.get("fault_word") == 0
        assert loop.get("truth.torque_Nm") == pytest.approx(TORQUE, abs=1.0)


@dataclass
class Vehicle:
    """The bus of a flashed image whose shaft is free."""

    loop: Loop
    stand: Stand
    bus: Listener
    mover: Mover

    @property
    def state(self) -> str:
        return str(self.bus.last["INV_Status"]["State"])

    @property
    def refused(self) -> str:
        return str(self.bus.last["INV_DcLink"]["RefusedReason"])


@contextmanager
def free_beside_the_index(parts: Parts) -> Iterator[Vehicle]:
    """A shaft without a load, 0.3 turns beyond the index; enable has been refused."""
    with started_beside_the_index(parts) as loop:
        for name, value in (("imposed_speed", 0.0), ("coulomb_Nm", FRICTION_NM), ("stiction_Nm", FRICTION_NM)):
            loop.set(f"plant.{name}", value)
        stand = Stand(loop)
        vehicle = Vehicle(loop, stand, Listener(stand.core), Mover(stand))
        stand.power_up()
        assert (vehicle.state, vehicle.refused) == ("ready", "angle_not_absolute")
        yield vehicle


def the_imposed_movement_alone_needs_no_angle(parts: Parts) -> None:
    """The spin and the torque with a connection are refused, by the same name as torque without a movement."""
    with free_beside_the_index(parts) as vehicle:
        for movement in ("spin", "connected"):
            vehicle.mover.agree(movement)
            vehicle.mover.run(50, Enable=1)
            assert (vehicle.state, vehicle.refused) == ("ready", "angle_not_absolute")
            assert vehicle.loop.get("emulator.gates") == 0
        vehicle.mover.agree("imposed")
        vehicle.mover.run(50, Enable=1)
        assert vehicle.state == "run" and vehicle.loop.get("emulator.gates") == 1
        vehicle.stand.run(50)  # without its message
        assert (vehicle.state, vehicle.refused) == ("ready", "movement_ended")
        assert vehicle.loop.get("emulator.gates") == 0


def the_movement_carries_the_shaft_past_its_index(parts: Parts) -> None:
    """Then the drive enables as usual, and its torque is right."""
    with free_beside_the_index(parts) as vehicle:
        vehicle.mover.agree("imposed")
        vehicle.mover.values |= {"CurrentD": CURRENT_PERCENT, "Damped": 1}
        vehicle.mover.run(700, Enable=1)
        vehicle.mover.values |= {"Damped": 0, "Direction": "backward"}
        vehicle.mover.run(2000)
        assert vehicle.state == "run" and vehicle.loop.get("fault_word") == 0
        vehicle.mover.agree("none")
        assert vehicle.loop.get("emulator.gates") == 0
        vehicle.stand.run(50, Enable=1)
        assert (vehicle.state, vehicle.refused) == ("run", "none")
        for torque in (SMALL_NM, -SMALL_NM):
            vehicle.stand.run(100, TorqueRequested=torque)
            assert vehicle.loop.get("truth.torque_Nm") == pytest.approx(torque, abs=0.5)
        assert vehicle.loop.get("fault_word") == 0


Check = Callable[[Parts], None]
QUADRATURE = "angle_quadrature.c"
PLANTED: dict[str, tuple[Check, PlantedError]] = {
    "any angle is absolute": (
        torque_waits_for_the_index,
        PlantedError(QUADRATURE, "encoder.absolute = (PTD->PDIR & 1U << PIN_INDEX) != 0U;", "encoder.absolute = true;"),
    ),
    "the capture is not armed": (
        torque_waits_for_the_index,
        PlantedError(QUADRATURE, "FTM2->C2SC = FTM_C2SC_ELSA;", "FTM2->C2SC = 0;"),
    ),
    "the index has no pin": (
        torque_waits_for_the_index,
        PlantedError("pins.c", "{PORTD, PIN_INDEX, 2, PULL_DOWN}", "{PORTD, PIN_INDEX, 1, PULL_DOWN}"),
    ),
    "the index is taken for the counter's present value": (
        the_angle_keeps_its_speed_when_the_index_passes,
        PlantedError(QUADRATURE, "FTM2->C2V << TURN_SHIFT", "FTM2->CNT << TURN_SHIFT"),
    ),
    "the wrong direction": (
        torque_waits_for_the_index,
        PlantedError(QUADRATURE, "TURN_SHIFT) - (uint32_t)at.second", "TURN_SHIFT) + (uint32_t)at.second"),
    ),
    "the tracker is not told": (
        the_angle_keeps_its_speed_when_the_index_passes,
        PlantedError("main.c", "drive_move_angle(&ecu.drive, angle_follow_index());", "(void)angle_follow_index();"),
    ),
}  # fmt: skip


MOVEMENT: dict[str, tuple[Check, PlantedError]] = {
    "the imposed movement needs the angle": (
        the_movement_carries_the_shaft_past_its_index,
        PlantedError(
            "drive/switch_off.c", "snapshot->angle_absolute || drive_imposes_angle(drive)", "snapshot->angle_absolute",
            FIRMWARE,
        ),
    ),
    "the state machine is not told of the imposed angle": (
        the_movement_carries_the_shaft_past_its_index,
        PlantedError("ecu/observe.c", "drive_imposes_angle(drive)", "false", FIRMWARE),
    ),
    "every movement imposes its angle": (
        the_imposed_movement_alone_needs_no_angle,
        PlantedError(
            "ecu/observe.c", "drive_imposes_angle(drive)", "movement_is_agreed(&drive->task.movement)", FIRMWARE,
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "check", [torque_waits_for_the_index, the_angle_keeps_its_speed_when_the_index_passes], ids=lambda c: c.__name__
)
def test_the_encoder_image_passes_each_check(encoder: Parts, check: Check) -> None:
    check(encoder)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_of_the_index_is_found(encoder: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED[name]
    assert_found(check, encoder, error, tmp_path)


@pytest.mark.parametrize(
    "check",
    [the_imposed_movement_alone_needs_no_angle, the_movement_carries_the_shaft_past_its_index],
    ids=lambda c: c.__name__,
)
def test_the_flashed_encoder_image_passes_each_check(flashed: Parts, check: Check) -> None:
    check(flashed)


@pytest.mark.parametrize("name", MOVEMENT)
def test_a_planted_error_of_the_movement_is_found(flashed: Parts, name: str, tmp_path: Path) -> None:
    check, error = MOVEMENT[name]
    assert_found(check, flashed, error, tmp_path)


def test_the_bus_names_the_reason(flashed: Parts) -> None:
    """The flashed image charges the dc link, waits in ready and refuses to enable."""
    with started_beside_the_index(flashed) as loop:
        stand = Stand(loop)
        bus = Listener(stand.core)
        stand.power_up()
        assert loop.get("emulator.gates") == 0
        assert str(bus.last["INV_Status"]["State"]) == "ready"
        assert str(bus.last["INV_DcLink"]["RefusedReason"]) == "angle_not_absolute"
        turn(loop, 300.0, 1.1)
        stand.run(20, Enable=0)
        stand.run(30, Enable=1)
        assert str(bus.last["INV_Status"]["State"]) == "run"
