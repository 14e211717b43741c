# SPDX-License-Identifier: Apache-2.0
"""Through a reset at 9500 rpm: the short circuit is there again within 2 ms, and the dc link stays below 1.2 of the
battery's voltage. A slice of the campaign of resets.py, real resets, and planted errors. How long the calibration of a
converter takes is assumed; with twice that time the bounds are kept, too."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random

import flash_saves as flash
import pytest
import resets
from planting import PlantedError, assert_found

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import CENTRE, LIMIT, Core, State
from fluxtrue_tools.sim.library import Loop

POINTS = 10
WITHOUT_GATES_MS = 2.0
STEP_PERIODS = 10  # in 1 ms
VDC_SHARE = 1.2
FIRST_WATCHDOG_S = 0.1
COPIES = 0x2000_0000  # of the state, hal/s32k144/retained.c
COPY_BYTES = 40
SEQUENCE, SPEED = 4, 12  # their places in a copy
SLOW_CALIBRATION = 28_000  # clocks of a converter
FIRST_SPEED_SHARE = 0.06  # instructions in between lengthen the 0.1 ms of the first speed
# Periods between two resets: before the copies are read; before the short circuit; while it is held and nothing has
# been written yet, twice; after the task's first write.
FURTHER_RESETS = ((1,), (10,), (50, 50), (230,))
SAFE_STATE = 6  # of port C, hal/s32k144/pins.h
HELD = 0x2A3F  # FTM0.SWOCTRL: the short circuit
LOWER, NO_OUTPUTS = 0b10_1010, 0
FILTER_S = 8 / 48e6  # of the fault input: 4 + FFVAL clocks of the internal oscillator
CLOCK_S = 1 / 48e6


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", flashed=True)


@pytest.fixture(scope="module")
def resolver_parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", angle="resolver", flashed=True)


def holds(outcome: resets.Outcome) -> None:
    """The bounds of one reset, with the hardware's path where the processor has nothing that it remembers."""
    assert outcome.vdc_share <= VDC_SHARE, outcome
    if outcome.kind == "power-on":
        assert math.isnan(outcome.without_gates_ms), "the retained RAM is not valid: nothing may be switched on"
    else:
        assert outcome.without_gates_ms <= WITHOUT_GATES_MS, outcome
        assert outcome.held, outcome


def four_resets_stay_within_the_bounds(parts: Parts) -> None:
    for outcome in resets.campaign(parts, 4, both=False):
        holds(outcome)


def the_hardware_has_the_bridge_until_the_pwm_runs(parts: Parts) -> None:
    """Released, the line asks for the board's safe state; the task drives it low in its second step."""
    with Core.of_program(parts.emulated().library, parts.image) as core:
        while core.run(1e-4) == LIMIT:
            assert not is_line_driven(core)
        end_s = core.now_s + 5e-3
        while core.now_s < end_s:
            core.run(1e-4)
        assert is_line_driven(core)


def is_line_driven(core: Core) -> bool:
    return core.register("PTC.PDDR") >> SAFE_STATE & 1 == 1


def test_resets_of_every_kind_stay_within_the_bounds(parts: Parts) -> None:
    for outcome in resets.campaign(parts, POINTS, both=False):
        holds(outcome)


def test_the_hardware_has_the_bridge_until_the_pwm_runs(parts: Parts) -> None:
    the_hardware_has_the_bridge_until_the_pwm_runs(parts)


def test_with_a_resolver_too(resolver_parts: Parts) -> None:
    for outcome in resets.campaign(resolver_parts, 5, both=False):
        holds(outcome)


@pytest.mark.parametrize("angle", ["as5047", "sincos", "windings"])
def test_with_the_other_sensors(angle: str) -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    for outcome in resets.campaign(build.prepare("hsm1", angle=angle, flashed=True), 2, both=False):
        print(f"{angle}: {outcome.without_gates_ms:.2f} ms after a reset by {outcome.kind}")
        holds(outcome)


def a_slow_calibration_costs_neither_the_bound_nor_the_speed(parts: Parts) -> None:
    loop, stand = resets.powered_up(parts)
    with loop:
        stand.core.adc_calibration(SLOW_CALIBRATION)
        newest = max(range(2), key=sequences(stand.core).__getitem__)
        known = number(stand.core, COPIES + COPY_BYTES * newest + SPEED)
        outcome = resets.reset(loop, stand, "watchdog", 0.0, 0.3, hardware=True)
        measured = number(stand.core, stand.core.symbol("speed"))
        print(f"{outcome.without_gates_ms:.2f} ms after a reset, with {measured / known:.3f} of the speed")
        holds(outcome)
        assert measured == pytest.approx(known, rel=FIRST_SPEED_SHARE)


@pytest.mark.parametrize("angle", build.FLASHED)
def test_a_slow_calibration_costs_neither_the_bound_nor_the_speed(angle: str) -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    a_slow_calibration_costs_neither_the_bound_nor_the_speed(build.prepare("hsm1", angle=angle, flashed=True))


def a_gate_fault_in_the_start_opens_the_bridge(parts: Parts) -> None:
    """While the short circuit is held and the timer does not count yet: by hardware, whatever the software does."""
    loop, stand = resets.powered_up(parts)
    with loop:
        core = stand.core
        core.reset(resets.KINDS["watchdog"])
        while core.register("FTM0.SWOCTRL") != HELD:
            core.run(2e-6)
        assert core.outputs == LOWER
        held = core.save()
        for state in (State.STUCK, State.RUNS):
            core.restore(held)
            core.core_state(state)
            core.run(1e-4)
            assert core.outputs == LOWER
            core.board(gate_fault=True)
            core.run(FILTER_S + CLOCK_S)
            assert core.outputs == NO_OUTPUTS
            core.board()
            core.run(5e-3)
            assert core.outputs == NO_OUTPUTS, "the fault has ended; nothing has cleared its latch yet"
        core.free(held)


def test_a_gate_fault_in_the_start_opens_the_bridge(parts: Parts) -> None:
    a_gate_fault_in_the_start_opens_the_bridge(parts)


def test_without_the_hardware_path_a_power_on_reset_exceeds_the_bound(parts: Parts) -> None:
    """The bound of the tests above can be missed, and the board's path is what keeps it."""
    loop, stand = resets.powered_up(parts)
    with loop:
        stand.run(60, TorqueRequested=-60.0)
        outcome = resets.reset(loop, stand, "power-on", -60.0, 0.3, hardware=False)
    assert outcome.vdc_share > VDC_SHARE


@pytest.mark.parametrize("how", ["stack", "watchdog"])
def test_a_reset_by_the_processor_itself(parts: Parts, how: str) -> None:
    """A stack that uses its reserve ends in panic(); a task that no longer comes leaves the watchdog unserved."""
    loop, stand = resets.powered_up(parts)
    with loop:
        if how == "stack":
            stand.core.write(stand.core.symbol("stack_bottom") + 128, bytes(4))
        else:
            stand.core.set_register("LPIT0.MIER", 0)
        loop.record(("truth.vdc_V", "emulator.gates", "emulator.resets"), 1)
        rows = [row for _ in range(100) for row in stand.run_ms()]
        assert stand.core.resets == 1
        first = next(k for k, row in enumerate(rows) if row[2] == 1)
        off = [k for k, row in enumerate(rows) if row[1] == 0.0]
        # Without its task the drive reacts first: half a step with switching disabled, then the short circuit (SS-21).
        before = [k for k in off if k < first - 1]
        assert len(before) == (0 if how == "stack" else STEP_PERIODS // 2)
        during = off[len(before) :]
        assert during and during[-1] < first + STEP_PERIODS * WITHOUT_GATES_MS
        assert max(row[0] for row in rows) <= VDC_SHARE * resets.BATTERY_V
        assert rows[-1][1] == 1.0


@pytest.mark.parametrize("damaged", [(0,), (1,), (0, 1)], ids=["first copy", "second copy", "both"])
def test_a_damaged_copy_is_not_used(parts: Parts, damaged: tuple[int, ...]) -> None:
    """Every bit is covered by its complement. With one copy left the drive continues, without any it does not."""
    random = Random(7)
    loop, stand = resets.powered_up(parts)
    with loop:
        for copy in damaged:
            at = COPIES + COPY_BYTES * copy + random.randrange(COPY_BYTES)
            stand.core.write(at, bytes([stand.core.read(at, 1)[0] ^ 1 << random.randrange(8)]))
        outcome = resets.reset(loop, stand, "watchdog", 0.0, 0.3, hardware=True)
    assert outcome.vdc_share <= VDC_SHARE
    assert math.isnan(outcome.without_gates_ms) == (len(damaged) == 2)


def sequences(core: Core) -> list[int]:
    return [int.from_bytes(core.read(COPIES + COPY_BYTES * k + SEQUENCE, 4), "little") for k in range(2)]


def number(core: Core, address: int) -> int:
    """A speed of 16 bits."""
    return int.from_bytes(core.read(address, 2), "little", signed=True)


def again(loop: Loop, stand: Stand, spacing: tuple[int, ...]) -> resets.Outcome:
    """A reset by the watchdog before each of these numbers of periods, and after the last one by the pin."""
    for periods in spacing:
        loop.set("emulator.reset_share", 0.3)
        loop.set("emulator.reset", resets.KINDS["watchdog"])
        loop.run(periods)
    return resets.reset(loop, stand, "pin", 60.0, 0.3, hardware=True)


def further_resets_find_the_copies(parts: Parts) -> None:
    """Each reset withdraws that the RAM is kept, and the task writes its first copy 20 ms later."""
    loop, stand = resets.powered_up(parts)
    with loop:
        stand.run(60, TorqueRequested=60.0)
        for spacing in FURTHER_RESETS:
            holds(resets.in_a_copy(partial(again, loop, stand, spacing)))


def test_further_resets_find_the_copies(parts: Parts) -> None:
    further_resets_find_the_copies(parts)


def test_the_task_continues_the_copies_after_two_resets(parts: Parts) -> None:
    """Both are as they were until it writes the older one, with the next number."""
    loop, stand = resets.powered_up(parts)
    with loop:
        core = stand.core
        core.reset(resets.KINDS["watchdog"])
        kept, numbers = core.read(COPIES, 2 * COPY_BYTES), sequences(core)
        for _ in range(2):
            core.run(5e-3)
            assert core.read(COPIES, 2 * COPY_BYTES) == kept
            core.reset(resets.KINDS["watchdog"])
        while sequences(core) == numbers:
            core.run(1e-4)
        assert sorted(sequences(core)) == [max(numbers), max(numbers) + 1]


def copies_of_an_earlier_power_on_are_not_used(parts: Parts) -> None:
    """A short power-off leaves them in the RAM, and the next reset comes when the task has written one of the two."""
    loop, stand = resets.powered_up(parts)
    with loop:
        core, kept = stand.core, stand.core.read(COPIES, 2 * COPY_BYTES)
        core.reset(resets.KINDS["power-on"])
        core.write(COPIES, kept)
        assert sequences(core)[0] != 0
        while sequences(core)[0] != 0:  # until the first copy is written
            core.run(1e-4)
        core.run(1e-4)  # and complete
        core.reset(resets.KINDS["pin"])
        core.run(5e-3)
        assert core.register("FTM0.SWOCTRL") != HELD


def test_copies_of_an_earlier_power_on_are_not_used(parts: Parts) -> None:
    copies_of_an_earlier_power_on_are_not_used(parts)


def test_a_slow_machine_is_not_shorted(parts: Parts) -> None:
    loop, stand = resets.powered_up(parts)
    with loop:
        rpm = (resets.SPEED_RPM, 3000.0)
        for k in range(400):
            at = [(rpm[0] + (rpm[1] - rpm[0]) * (k + j) / 400) * resets.RPM for j in (0, 1)]
            stand.run_ms({"plant.speed_rad_s": (at[0], at[1])})
        outcome = resets.reset(loop, stand, "watchdog", 0.0, 0.3, hardware=True)
    assert math.isnan(outcome.without_gates_ms)
    assert outcome.vdc_share < 1.01


def slots(damaged: int) -> bytes:
    """The data flash with so many slots whose headers are those of the longest record and whose records are damaged."""
    random, record = Random(1), flash.SLOT_BYTES - 16
    full = [struct.pack("<4I", 1, record, k, 0) + random.randbytes(record) for k in range(damaged)]
    return b"".join(full).ljust(flash.FLASH_BYTES, b"\xff")


def start_s(parts: Parts, damaged: int) -> float:
    with Core.of_program(parts.emulated().library, parts.image) as core:
        core.write(flash.FLASH, slots(damaged))
        assert core.run(FIRST_WATCHDOG_S) == CENTRE, "the PWM does not start before the watchdog resets"
        assert core.resets == 0
        return core.now_s


@pytest.mark.parametrize("damaged", [0, 1, flash.SLOTS])
def test_the_pwm_starts_long_before_the_first_watchdog(parts: Parts, damaged: int) -> None:
    seconds = start_s(parts, damaged)
    print(f"{damaged} damaged slots: the PWM starts after {1e3 * seconds:.1f} ms")
    assert seconds < FIRST_WATCHDOG_S / 2


PLANTED_ERRORS: dict[str, tuple[Callable[[Parts], None], PlantedError]] = {
    "nothing is kept": (
        four_resets_stay_within_the_bounds,
        PlantedError("main.c", "    after_reset_note(&ecu.drive);\n", ""),
    ),
    "the RAM is not retained": (
        four_resets_stay_within_the_bounds,
        PlantedError("retained.c", "    SIM->CHIPCTL = SIM->CHIPCTL & ~SIM_CHIPCTL_SRAMU_RETEN;\n", ""),
    ),
    "the retained RAM is written": (
        four_resets_stay_within_the_bounds,
        PlantedError("retained.c", "    SIM->CHIPCTL = SIM->CHIPCTL | SIM_CHIPCTL_SRAMU_RETEN;\n", ""),
    ),
    "the RAM is not retained from its reading on": (
        further_resets_find_the_copies,
        PlantedError("retained.c", "    keep_copies();\n    return is_valid;\n", "    return is_valid;\n"),
    ),
    "the RAM is not retained until its reading": (
        further_resets_find_the_copies,
        PlantedError("startup.c", r'"bic r1, r1, %2\n"', r'""'),
    ),
    "copies stay in the RAM at power-on": (
        copies_of_an_earlier_power_on_are_not_used,
        PlantedError("retained.c", "        discard();\n", "        (void)discard;\n"),
    ),
    "the crystal is awaited first": (
        four_resets_stay_within_the_bounds,
        PlantedError("after_reset.c", "    clock_first();\n", "    clock_init();\n    clock_first();\n"),
    ),
    "the gate supply stays off": (
        four_resets_stay_within_the_bounds,
        PlantedError("after_reset.c", "    PTC->PSOR = retained.lines & KEPT_LINES;\n", ""),
    ),
    "the timer is set up again": (
        four_resets_stay_within_the_bounds,
        PlantedError("main.c", "    if (!holds) {\n", "    if (!holds || holds) {\n"),
    ),
    "the fault input is not set up before the short circuit": (
        a_gate_fault_in_the_start_opens_the_bridge,
        PlantedError("pwm.c", "    configure_faults();\n", "    (void)configure_faults;\n"),
    ),
    "one converter is calibrated after the other": (
        a_slow_calibration_costs_neither_the_bound_nor_the_speed,
        PlantedError(
            "sampling.c",
            "    begin_calibration(ADC1, divider);\n",
            "    await(&ADC0->SC3, ADC_SC3_CAL, 0);\n    begin_calibration(ADC1, divider);\n",
        ),
    ),
    "the state machine starts anew": (
        four_resets_stay_within_the_bounds,
        PlantedError("main.c", "    ecu_continue(&ecu);\n", ""),
    ),
    "the line of the safe state is low from the start": (
        the_hardware_has_the_bridge_until_the_pwm_runs,
        PlantedError("pins.c", "((1U << PIN_PRECHARGE) |", "((1U << PIN_SAFE_STATE) | (1U << PIN_PRECHARGE) |"),
    ),
}


@pytest.mark.parametrize("name", PLANTED_ERRORS)
def test_a_planted_error_is_found(parts: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED_ERRORS[name]
    assert_found(check, parts, error, tmp_path)


OF_WINDINGS = {
    "the excitation ends before the calibration": PlantedError(
        "excitation.c", "k < SETTLING_PERIODS || sampling_first_calibrates();", "k < SETTLING_PERIODS;"
    ),
    "the excitation follows the calibration": PlantedError(
        "angle_sincos.c", "    excitation_first();\n", "    sampling_first_end();\n    excitation_first();\n"
    ),
    "there is no excitation": PlantedError("angle_sincos.c", "    excitation_first();\n", ""),
}


@pytest.mark.parametrize("name", OF_WINDINGS)
def test_a_planted_error_of_the_windings_is_found(name: str, tmp_path: Path) -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    windings = build.prepare("hsm1", angle="windings", flashed=True)
    assert_found(a_slow_calibration_costs_neither_the_bound_nor_the_speed, windings, OF_WINDINGS[name], tmp_path)
