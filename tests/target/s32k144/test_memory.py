# SPDX-License-Identifier: Apache-2.0
"""The image remembers what it has identified: saved at key-off, recalled at key-on, whenever the supply fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import flash_cuts
import flash_saves as flash
import numpy as np
import pytest
from flash_saves import Parts
from planting import PlantedError, image_with_error

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.core import Core, EmulationStoppedError
from fluxtrue_tools.errors import FluxtrueError

POINTS = ((1500.0, 50.0), (2500.0, 20.0), (600.0, -40.0))


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", angle="resolver")  # an absolute angle: the shaft may stand anywhere at key-on


@pytest.fixture(scope="module")
def flashed(parts: Parts) -> bytes:
    """The data flash after a drive and a stop."""
    with flash.key_on(parts) as (loop, core):
        flash.drive(loop, POINTS, 0.5)
        flash.until_saving(loop, core)
        flash.until_saved(loop, core)
        return core.read(flash.FLASH, flash.FLASH_BYTES)


def test_a_drive_remembers_what_it_has_identified(parts: Parts) -> None:
    with flash.key_on(parts) as (loop, core):
        prior = flash.identified(loop)
        assert not flash.is_recalled(core)
        flash.drive(loop, POINTS, 0.5)
        assert flash.saves(core) == 0
        flash.until_saving(loop, core)
        flash.until_saved(loop, core)
        assert flash.saves(core) == 1
        (record,) = flash.records(core)
        before = flash.identified(loop)
        assert before["psi_f_Vs"] < 0.95 * prior["psi_f_Vs"]
        flash.power_cycle(loop)
        assert flash.is_recalled(core)
        loop.run(20)  # two steps of the task
        # While switching is disabled, only the leak changes them.
        assert flash.identified(loop) == pytest.approx(before, rel=2e-3)
        assert record.slot == record.sequence == 0
        flash.drive(loop, flash_cuts.SHORT, 0.2)  # and it drives


def test_the_values_recalled_are_those_of_the_record(parts: Parts, flashed: bytes) -> None:
    with flash.key_on(parts, flashed) as (_, core):
        (record,) = flash.records(core)
        states = flash.RECORD.pack(*flash.RECORD.unpack(record.content))[4 : 4 + 4 * flash.STATES]
        assert states in core.read(0x1FFF_8000, 0xF000)


def test_the_bus_image_remembers_too(flashed: bytes) -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    bus = build.prepare("hsm1", angle="resolver", flashed=True)
    with Core.of_program(bus.emulated().library, bus.image) as core:
        core.write(flash.FLASH, flashed)
        core.run(0.1)
        assert flash.is_recalled(core)


def test_switching_waits_until_the_save_is_complete(parts: Parts) -> None:
    with flash.key_on(parts) as (loop, core):
        core.flash_slow(True)
        flash.drive(loop, POINTS, 0.2)
        flash.until_saving(loop, core)
        loop.set("enable", 1)
        while core.register("SMC.PMCTRL") == 0:
            loop.run(1)
            assert core.outputs == 0
        loop.run(100)
        assert core.outputs == 0x3F
        assert flash.saves(core) == 1
        assert loop.get("fault_word") == 0
        assert core.resets == 0


def test_the_tick_is_where_it_was_after_a_save(parts: Parts) -> None:
    """A quarter period after the start of a period, so that a step always has the same number of periods."""
    with flash.key_on(parts) as (loop, core):

        def phase() -> float:
            seen: list[int] = []
            core.on_exception(
                lambda vector, entered: seen.append(core.load("FTM0.CNT")) if vector == 16 + 48 and entered else None
            )
            loop.run(100)
            core.on_exception(lambda *_: None)
            assert len(seen) in {9, 10, 11}
            return max(seen)

        before = phase()
        flash.drive(loop, POINTS, 0.2)
        flash.until_saving(loop, core)
        flash.until_saved(loop, core)
        loop.run(100)
        assert phase() == pytest.approx(before, abs=600)  # ticks of 112 MHz, of 11200


# ---- what it is good for

FIRST_TEN_S = ((600.0, 60.0), (1200.0, 60.0), (2000.0, 60.0), (2500.0, -40.0), (3000.0, 80.0))
LONG = (*POINTS, (3000.0, 70.0), (4500.0, 30.0), (1200.0, -60.0), (5000.0, 60.0), (2000.0, 90.0))


def torque_error_Nm(parts: Parts, memory: bytes | None) -> np.ndarray:
    """Magnitude of the plant's torque error, mean of each of the first ten seconds after key-on: five points of two
    seconds, of which the first half second is the way there."""
    with flash.key_on(parts, memory) as (loop, core):
        assert flash.is_recalled(core) == (memory is not None)
        loop.record(("truth.torque_mean_Nm", "torque_command_Nm", "fault_word"), 10)
        for name in ("enable", "identification", "torque_loop"):
            loop.set(name, 1)
        rows, at = [], (0.0, 0.0)
        for rpm, torque in FIRST_TEN_S:
            for start, periods in ((at, 5000), ((rpm, torque), 15000)):
                ramps = {"plant.speed_rad_s": (start[0] * flash.RPM, rpm * flash.RPM)}
                rows.append(loop.run(periods, ramps | {"torque_requested_Nm": (start[1], torque)}))
            at = (rpm, torque)
        recorded = np.vstack(rows)
    assert recorded[:, 2].max() == 0
    magnitude: np.ndarray = np.abs(recorded[:, 0] - recorded[:, 1]).reshape(10, -1).mean(axis=1)
    return magnitude


def test_with_the_memory_the_first_torque_is_right(parts: Parts) -> None:
    """The magnet is 12 % weak and makes about two thirds of the torque."""
    with flash.key_on(parts) as (loop, core):
        flash.drive(loop, LONG, 1.0)
        flash.until_saving(loop, core)
        flash.until_saved(loop, core)
        memory = core.read(flash.FLASH, flash.FLASH_BYTES)
    kept, first = torque_error_Nm(parts, memory), torque_error_Nm(parts, None)
    print(f"with the memory {kept.round(2)}, without {first.round(2)} N·m")
    assert kept.max() <= 0.3
    assert first[:2].min() > 2.0


# ---- a supply that fails


@pytest.mark.parametrize("last", [0, flash.SLOTS - 1], ids=["blank slot", "sector to be erased"])
def test_a_cut_at_every_step_leaves_the_old_or_the_new_record(parts: Parts, last: int) -> None:
    assert flash_cuts.campaign(parts, 1, last) > 40


# ---- errors that the tests above must find


def cut(parts: Parts) -> None:
    flash_cuts.campaign(parts, 1, flash.SLOTS - 1)


PLANTED_ERRORS: dict[str, tuple[Callable[[Parts], None], PlantedError]] = {
    "a command in HSRUN": (cut, PlantedError("nvm.c", "    clock_slow();\n", "")),
    "the speculation stays on": (cut, PlantedError("nvm.c", "MSCM_OCMDR1_OCM1(SPECULATION_OFF)", "0U")),
    "bus faults are not ignored": (cut, PlantedError("nvm.c", "SCB_CCR | CCR_BFHFNMIGN", "SCB_CCR")),
    "nothing is erased": (cut, PlantedError("nvm.c", "flash_command(ERASE_SECTOR, slot, 0)", "true")),
    "the clock stays slow": (
        test_switching_waits_until_the_save_is_complete,
        PlantedError("nvm.c", "    clock_fast();\n", ""),
    ),
    "the tick is not aligned": (
        test_the_tick_is_where_it_was_after_a_save,
        PlantedError("nvm.c", "    tick_align(pwm_elapsed() / (CLOCK_CORE_HZ / CLOCK_PERIPHERAL_HZ));\n", ""),
    ),
}


@pytest.mark.parametrize("name", PLANTED_ERRORS)
def test_a_planted_error_is_found(name: str, parts: Parts, tmp_path: Path) -> None:
    check, error = PLANTED_ERRORS[name]
    planted = replace(parts, image=image_with_error(parts.image, error, tmp_path))
    with pytest.raises((AssertionError, EmulationStoppedError, FluxtrueError)):
        check(planted)
