# SPDX-License-Identifier: Apache-2.0
"""The resolver of the S32K144's image on the emulated processor: the angle is the one of the sampling instant, nothing
waits for it, and each check finds its planted errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from planting import PlantedError, assert_found, image_with_error
from sensor_drive import ANGLE, FAST_RPM, RAD_S

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core, State
from fluxtrue_tools.sim.library import Loop

FAST_VECTOR = 16 + 39
SLOW_RPM = 500.0  # at which the tracker follows after lost periods
WORDS_TO_SEND = 4
MARGIN_TICKS = 22  # 0.2 µs


@pytest.fixture(scope="module")
def resolver() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", angle="resolver")


@pytest.fixture(scope="module")
def encoder(resolver: Parts) -> Parts:
    return build.prepare("hsm1", angle="encoder")


@contextmanager
def driving(parts: Parts, rpm: float = FAST_RPM) -> Iterator[tuple[Loop, Core]]:
    """A drive that makes torque, and its emulated processor."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": rpm * RAD_S, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("emulator.shadow", 1)
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", 40.0)
        loop.run(500)
        yield loop, Core.of_simulation(motor.library, loop._sim)


def the_angle_is_that_of_the_sampling_instant(parts: Parts) -> None:
    """The host computes the same periods with the angle that the shaft had at the sampling instants, while the speed
    changes: an angle of any other age would change every bit that follows from it."""
    with driving(parts) as (loop, _):
        loop.run(500, {"plant.speed_rad_s": (FAST_RPM * RAD_S, 0.7 * FAST_RPM * RAD_S)})
        assert loop._library.sim_shadow_difference(loop._sim) is None
        assert loop.get("fault_word") == 0
        assert loop.get("truth.torque_Nm") == pytest.approx(40.0, abs=1.0)


def lost_periods_leave_no_old_angle(parts: Parts) -> None:
    """The core executes nothing for up to two periods. The frames of these periods have been received meanwhile,
    and only the newest counts: none may stay in the FIFO, or every later angle would be old."""
    with driving(parts, SLOW_RPM) as (loop, core):
        for periods in (1, 2):
            core.core_state(State.STUCK)
            loop.run(periods)
            core.core_state(State.RUNS)
            loop.run(200)
            assert not int(loop.get("fault_word")) & ANGLE
            assert core.load("LPSPI0.FSR") == WORDS_TO_SEND  # at the start of a period: nothing received
        assert loop.get("truth.torque_Nm") == pytest.approx(40.0, abs=1.0)


Check = Callable[[Parts], None]
LATE = PlantedError("angle_resolver.c", "#define READY_TICKS 85U", "#define READY_TICKS 180U")
EARLY = PlantedError("angle_resolver.c", "#define READY_TICKS 85U", "#define READY_TICKS 60U")
OF_THE_LAST_PERIOD = PlantedError(
    "angle_resolver.c", "    position = frame;\n",
    "    static uint32_t last;\n    position = last;\n    last = frame;\n    frame = position;\n",
)  # fmt: skip
OLDEST_OF_THE_FIFO = PlantedError(
    "serial_angle.c",
    "        *frame = LPSPI0->RDR;\n        LPSPI0->TDR = word;\n    }\n",
    "        *frame = LPSPI0->RDR;\n        LPSPI0->TDR = word;\n        break;\n    }\n",
)
PLANTED: dict[str, tuple[Check, PlantedError]] = {
    "the angle of the period before": (the_angle_is_that_of_the_sampling_instant, OF_THE_LAST_PERIOD),
    "the transfer starts before the converter is ready": (the_angle_is_that_of_the_sampling_instant, EARLY),
    "the transfer starts too late": (the_angle_is_that_of_the_sampling_instant, LATE),
    "the oldest frame counts": (lost_periods_leave_no_old_angle, OLDEST_OF_THE_FIFO),
}


@pytest.mark.parametrize(
    "check", [the_angle_is_that_of_the_sampling_instant, lost_periods_leave_no_old_angle], ids=lambda c: c.__name__
)
def test_the_resolver_image_passes_each_check(resolver: Parts, check: Check) -> None:
    check(resolver)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_of_the_angle_is_found(resolver: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED[name]
    assert_found(check, resolver, error, tmp_path, as_built=True)


def test_the_frame_is_there_before_it_is_read(resolver: Parts, tmp_path: Path) -> None:
    """The angle is still complete with 0.2 µs less."""
    later = PlantedError("angle_resolver.c", "#define READY_TICKS 85U", f"#define READY_TICKS {85 + MARGIN_TICKS}U")
    image = image_with_error(resolver.image, [later], tmp_path, as_built=True)
    the_angle_is_that_of_the_sampling_instant(replace(resolver, image=image))


def _fast_isr(parts: Parts) -> float:
    with driving(parts, 1000.0) as (loop, core):
        core.clear_counts()
        loop.run(1000)
        counts = core.counts(FAST_VECTOR)
        return counts.sum / counts.runs


def test_the_fast_interrupt_does_not_wait_for_the_resolver(resolver: Parts, encoder: Parts) -> None:
    """Checking, taking and replacing a frame takes some 25 instructions more than reading an encoder's counter."""
    assert _fast_isr(resolver) <= _fast_isr(encoder) + 30
