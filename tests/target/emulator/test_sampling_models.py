# SPDX-License-Identifier: Apache-2.0
"""Delay block and converter by themselves: an idle program runs, and the test accesses the registers from outside."""

import ctypes
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

CORE_S = 1 / 48e6  # after reset the core runs from the fast internal clock
ADC_S = 1 / 12e6
CONVERSION_S = 43 * ADC_S  # SMPLTS 12: 13 + 30 clocks
CALIBRATION_S = 14_000 * ADC_S  # assumed, adc.c
OUTPUT_S = 3 * CORE_S  # pre-trigger two cycles after its cause, trigger one later
COCO = CAL = 0x80
PDB_ON, SOFTWARE, LDOK, SWTRIG, PDBEIE = 0x80, 15 << 8, 1, 1 << 16, 1 << 17
PDB0_IRQ = 52
ENABLED = PDB_ON | SOFTWARE


@pytest.fixture
def core(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    """ADC0 calibrated, triggered by PDB0; inputs 1, 2, 3 in the first three result registers."""
    with Core.of_program(library, program("idle")) as core:
        core.run(1e-4)
        for name, value in (
            ("SCG.FIRCDIV", 0x301), ("PCC.PCC_ADC0", 3 << 24), ("PCC.PCC_ADC0", 3 << 24 | 1 << 30),
            ("PCC.PCC_PDB0", 1 << 30), ("ADC0.CFG1", 4), ("ADC0.CFG2", 12),
            *((f"ADC0.{name}", 0) for name in ("CLPS", "CLP3", "CLP2", "CLP1", "CLP0", "CLPX", "CLP9")),
            ("ADC0.SC3", 0x87),
        ):  # fmt: skip
            core.store(name, value)
        core.run(CALIBRATION_S)
        for name, value in (
            ("ADC0.SC3", 0), ("ADC0.SC2", 0x40), ("ADC0.SC10", 1), ("ADC0.SC11", 2), ("ADC0.SC12", 3),
        ):  # fmt: skip
            core.store(name, value)
        yield core


def calibrate_again(core: Core, converter: str = "ADC0") -> None:
    core.store(f"{converter}.SC2", 0)
    for name in ("CLPS", "CLP3", "CLP2", "CLP1", "CLP0", "CLPX", "CLP9"):
        core.store(f"{converter}.{name}", 0)
    core.store(f"{converter}.SC3", 0x87)


def test_a_calibration_takes_its_time(core: Core) -> None:
    calibrate_again(core)
    core.run(0.999 * CALIBRATION_S)
    assert core.load("ADC0.SC3") & CAL
    core.run(0.002 * CALIBRATION_S)
    assert core.load("ADC0.SC3") & CAL == 0
    assert core.load("ADC0.SC10") & COCO


def test_both_converters_calibrate_at_the_same_time(core: Core) -> None:
    """Each one's CAL falls when its own time has passed, and with its own clock."""
    core.store("PCC.PCC_ADC1", 3 << 24)
    core.store("PCC.PCC_ADC1", 3 << 24 | 1 << 30)
    core.store("ADC1.CFG1", 4 | 1 << 5)  # 6 MHz
    calibrate_again(core)
    core.run(0.25 * CALIBRATION_S)
    calibrate_again(core, "ADC1")
    core.run(0.74 * CALIBRATION_S)
    assert [core.load(f"ADC{k}.SC3") & CAL for k in range(2)] == [CAL, CAL]
    core.run(0.02 * CALIBRATION_S)
    assert [core.load(f"ADC{k}.SC3") & CAL for k in range(2)] == [0, CAL]
    core.store("ADC0.SC3", 0)  # no write during a calibration
    core.run(1.23 * CALIBRATION_S)
    assert core.load("ADC1.SC3") & CAL
    core.run(0.02 * CALIBRATION_S)
    assert core.load("ADC1.SC3") & CAL == 0


def test_a_longer_calibration_can_be_set(core: Core) -> None:
    core.adc_calibration(28_000)
    calibrate_again(core)
    core.run(1.999 * CALIBRATION_S)
    assert core.load("ADC0.SC3") & CAL
    core.run(0.002 * CALIBRATION_S)
    assert core.load("ADC0.SC3") & CAL == 0


@pytest.mark.parametrize("name", ["SC10", "SC2", "SC3", "CFG2"])
def test_a_write_during_a_calibration_is_refused(core: Core, name: str) -> None:
    calibrate_again(core)
    with pytest.raises(EmulationStoppedError, match="while it calibrates"):
        core.store(f"ADC0.{name}", 0)


def arm(core: Core, enabled: int, delayed: int, back_to_back: int, **registers: int) -> None:
    core.store("PDB0.CH0C1", enabled | delayed << 8 | back_to_back << 16)
    for name, value in registers.items():
        core.store(f"PDB0.{name}", value)
    core.store("PDB0.SC", ENABLED | LDOK)


def trigger(core: Core, more: int = 0) -> None:
    core.store("PDB0.SC", ENABLED | SWTRIG | more)


def done(core: Core) -> list[int]:
    return [k for k in range(3) if core.register(f"ADC0.SC1{k}") & COCO]


def test_a_delay_counts_from_the_trigger(core: Core) -> None:
    arm(core, 0b100, 0b100, 0, CH0DLY2=480, MOD=1000)
    trigger(core)
    core.run(480 * CORE_S + OUTPUT_S + CONVERSION_S - CORE_S)
    assert done(core) == []
    core.run(CORE_S)
    assert done(core) == [2]


def test_a_delay_beyond_the_modulus_never_triggers(core: Core) -> None:
    arm(core, 0b001, 0b001, 0, CH0DLY0=480, MOD=479)
    trigger(core)
    core.run(1e-3)
    assert done(core) == []


def test_a_delay_acts_only_after_it_was_loaded(core: Core) -> None:
    arm(core, 0b001, 0b001, 0, CH0DLY0=0, MOD=48000)
    core.store("PDB0.CH0DLY0", 24000)
    trigger(core)
    core.run(OUTPUT_S + CONVERSION_S)
    assert done(core) == [0]


def chain(core: Core) -> None:
    """Run three conversions, each of which starts at the end of the one before, until all are complete."""
    arm(core, 0b111, 0b001, 0b110, CH0DLY0=0, MOD=1000)
    trigger(core)
    core.run(3 * (OUTPUT_S + CONVERSION_S))


def test_back_to_back_conversions_follow_at_once(core: Core) -> None:
    arm(core, 0b111, 0b001, 0b110, CH0DLY0=0, MOD=1000)
    trigger(core)
    for complete in ([0], [0, 1], [0, 1, 2]):
        core.run(OUTPUT_S + CONVERSION_S - CORE_S)
        assert done(core) == complete[:-1]
        core.run(CORE_S)
        assert done(core) == complete


def read_all(core: Core) -> None:
    for k in range(3):
        core.load(f"ADC0.R{k}")


def test_results_that_are_read_let_the_chain_run_again(core: Core) -> None:
    for _ in range(5):
        chain(core)
        assert done(core) == [0, 1, 2]
        read_all(core)
        assert done(core) == []
    assert core.register("PDB0.CH0S") & 0xFF == 0


@pytest.mark.parametrize("unread", [0, 1, 2])
def test_an_unread_result_stops_the_sequence(core: Core, unread: int) -> None:
    """COCO does not rise when the next conversion of the unread result ends: nothing follows, and the pre-trigger is
    still locked at the next trigger."""
    chain(core)
    for k in {0, 1, 2} - {unread}:
        core.load(f"ADC0.R{k}")
    trigger(core)
    core.run(3 * (OUTPUT_S + CONVERSION_S))
    assert done(core) == list(range(unread + 1))
    assert core.register("PDB0.CH0S") & 0xFF == 0
    read_all(core)
    for _ in range(3):
        trigger(core)
        core.run(3 * (OUTPUT_S + CONVERSION_S))
        assert done(core) == []
        assert core.register("PDB0.CH0S") & 0xFF == 1


def leave_locked(core: Core, more: int = 0) -> None:
    chain(core)
    trigger(core, more)
    core.run(3 * (OUTPUT_S + CONVERSION_S))
    read_all(core)


@pytest.mark.parametrize("by", ["PDBEN", "EN"])
def test_disabling_releases_the_locks(core: Core, by: str) -> None:
    leave_locked(core)
    if by == "PDBEN":
        core.store("PDB0.SC", 0)
    else:
        core.store("PDB0.CH0C1", 0b110 | 0b001 << 8 | 0b110 << 16)
    chain(core)
    assert done(core) == [0, 1, 2]
    assert core.register("PDB0.CH0S") & 0xFF == 0


def test_a_trigger_during_a_conversion_is_ignored(core: Core) -> None:
    arm(core, 0b011, 0b011, 0, CH0DLY0=0, CH0DLY1=48, MOD=1000)  # 1 us later: during the first conversion
    trigger(core)
    core.run(3 * CONVERSION_S)
    assert done(core) == [0]
    assert core.register("PDB0.CH0S") & 0xFF == 0b10


def test_a_sequence_error_interrupts_until_it_is_cleared(core: Core) -> None:
    leave_locked(core, PDBEIE)
    assert core.word("taken", PDB0_IRQ) == 0
    trigger(core, PDBEIE)
    core.run(1e-6)
    assert core.word("taken", PDB0_IRQ) == 1
    assert core.read(0xE000_E200 + 4 * (PDB0_IRQ // 32), 4)[PDB0_IRQ % 32 // 8] >> PDB0_IRQ % 8 & 1  # still pending
    core.store("PDB0.CH0S", 0xFF0000)  # zeros clear the errors, ones keep the flags
    assert core.register("PDB0.CH0S") == 0x070000


def test_without_its_enable_a_sequence_error_does_not_interrupt(core: Core) -> None:
    leave_locked(core)
    trigger(core)
    core.run(1e-5)
    assert core.register("PDB0.CH0S") & 0xFF == 1
    assert core.word("taken", PDB0_IRQ) == 0


@pytest.mark.parametrize("bit", [1 << 1, 1 << 5, 1 << 15, 1 << 18, 1 << 8 | 1 << 7])
def test_other_modes_of_the_delay_block_are_refused(core: Core, bit: int) -> None:
    with pytest.raises(EmulationStoppedError, match=r"PDB0.SC: .* not (modelled|connected)"):
        core.store("PDB0.SC", bit)


@pytest.mark.parametrize(("name", "value"), [("CH1C1", 0), ("POEN", 2)])
def test_channel_1_and_other_pulses_are_refused(core: Core, name: str, value: int) -> None:
    with pytest.raises(EmulationStoppedError, match="not modelled|only pulse output 0"):
        core.store(f"PDB0.{name}", value)


@pytest.mark.parametrize(("delays", "modulus"), [(200 << 16 | 100, 1000), (100 << 16 | 300, 200)])
def test_a_pulse_that_ends_before_it_begins_or_after_the_counter_is_refused(
    core: Core, delays: int, modulus: int
) -> None:
    arm(core, 0, 0, 0, POEN=1, PODLY=delays, MOD=modulus)
    with pytest.raises(EmulationStoppedError, match="a pulse from .* is not modelled"):
        trigger(core)
