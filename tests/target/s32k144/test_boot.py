# SPDX-License-Identifier: Apache-2.0
"""The S32K144's image boots on the emulated processor, and does not enable switching with damaged data."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from damage import damaged
from listener import Listener

from fluxtrue_tools import faults
from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.core import CENTRE, LIMIT, Core, EmulationStoppedError
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.target import image
from fluxtrue_tools.target.build import image as build_image

BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"]).parent
CLOCK_SELECTED = 0x18  # FTM0_SC.CLKS
FAULT_CONFIG = 1 << 7
ADC0_IRQ, PDB0_IRQ, PDB1_IRQ = 39, 52, 68
COCO = 0x80
CLOCK_S = 1 / 112e6
RUN_S = 0.1  # eight times the watchdog's time-out of 12 ms


@pytest.fixture(scope="module")
def parts() -> build.Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1")


@pytest.fixture(scope="module", params=["s32k144", "s32k144-resolver"])
def elf(request: pytest.FixtureRequest, parts: build.Parts) -> Path:
    return build_image(request.param, BUILD / request.param)


def _core(parts: build.Parts, elf: Path) -> Core:
    return Core.of_program(parts.emulated().library, elf)


def _periods(core: Core, seconds: float) -> Iterator[int]:
    end = core.now_s + seconds
    while end - core.now_s > CLOCK_S:  # a shorter time than one clock would not advance the core
        yield core.run(end - core.now_s)


def test_the_pwm_runs_soon_after_reset_and_nothing_resets_again(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        assert core.run(RUN_S) == CENTRE
        assert core.now_s < 0.05
        stops = list(_periods(core, RUN_S))
        assert stops.count(CENTRE) == pytest.approx(RUN_S * 10_000, abs=2)
        assert core.resets == 0


def test_a_stopped_emulation_ends_the_test_at_once(parts: build.Parts, elf: Path) -> None:
    """After a stop the emulated time no longer advances, so a loop that waits for an end time would never end."""
    with _core(parts, elf) as core:
        core.run(RUN_S)
        core.set_register("PCC.PCC_ADC0", 0)  # the fast ISR reads from a converter without a clock
        with pytest.raises(EmulationStoppedError, match=r"read of ADC0\.R\d .* the peripheral's clock is off"):
            list(_periods(core, RUN_S))


def test_with_a_damaged_table_the_pwm_never_starts_but_the_bus_runs(
    parts: build.Parts, elf: Path, tmp_path: Path
) -> None:
    sealed = image.Image(elf)
    sealed.content[sealed.place(sealed.symbol("table_g") + 100, 1)] ^= 0x04
    damaged = tmp_path / "damaged.elf"
    damaged.write_bytes(sealed.content)
    with _core(parts, damaged) as core:
        assert core.run(RUN_S) == LIMIT
        assert core.register("FTM0.SC") & CLOCK_SELECTED == 0
        assert core.register("CAN0.MCR") & 0x8000_0000 == 0  # the module is enabled
        assert core.resets == 0


def _sent_messages(parts: build.Parts, elf: Path) -> dict[str, dict[str, object]]:
    """The last frame of each message that an image sends in its first 0.3 s, decoded. The PWM must not start."""
    with _core(parts, elf) as core:
        listener = Listener(core)
        assert core.run(0.3) == LIMIT
        assert core.register("FTM0.SC") & CLOCK_SELECTED == 0
    return listener.last


@pytest.mark.parametrize(("place", "at", "content"), [
    ("table_g", 100, b"\x01\x00"),
    ("hot_start", 0, b"\x00\xbf"),  # what is copied to the RAM; nothing executes its first instruction before the check
])  # fmt: skip
def test_damage_that_a_start_finds_is_named_on_the_bus(
    parts: build.Parts, elf: Path, tmp_path: Path, place: str, at: int, content: bytes
) -> None:
    messages = _sent_messages(parts, damaged(elf, tmp_path / "damaged.elf", place, at, content))
    assert messages["INV_Status"]["State"] == "fault"
    assert messages["INV_Faults"]["DriveFaults"] == FAULT_CONFIG
    assert messages["INV_Configuration"]["MotorCheck"] == "image_checksum"


def test_damaged_code_is_named_on_the_bus(parts: build.Parts, elf: Path, tmp_path: Path) -> None:
    """One bit of the handler of core faults, which nothing executes before there is one."""
    content = image.Image(elf)
    handler = content.symbol("fault_handler") & ~1
    assert content.symbol("program_start") <= handler < content.symbol("program_end")
    flipped = content.content[content.place(handler, 1)] ^ 1
    at = handler - content.symbol("program_start")
    broken = damaged(elf, tmp_path / "damaged.elf", "program_start", at, bytes([flipped]))
    with _core(parts, broken) as core:
        listener = Listener(core)
        for _ in _periods(core, 0.5):
            if int(str(listener.last.get("INV_Faults", {}).get("DriveFaults", 0))) & FAULT_CONFIG:
                break
        print(f"found {core.now_s * 1e3:.0f} ms after reset")
        list(_periods(core, 0.2))
    assert int(str(listener.last["INV_Faults"]["DriveFaults"])) & FAULT_CONFIG
    assert listener.last["INV_Configuration"]["MotorCheck"] == "image_checksum"


def test_a_dead_time_beyond_the_timer_is_named_on_the_bus(parts: build.Parts, elf: Path, tmp_path: Path) -> None:
    content = image.Image(elf)
    at = content.place(content.symbol("motor"), 128)
    dead_time = content.content[at : at + 128].index(struct.pack("<f", 2e-6))
    impossible = damaged(elf, tmp_path / "impossible.elf", "motor", dead_time, struct.pack("<f", 1e-3))
    image.seal(impossible)
    messages = _sent_messages(parts, impossible)
    assert messages["INV_Faults"]["DriveFaults"] == FAULT_CONFIG
    assert messages["INV_Configuration"]["MotorCheck"] == "pwm_timer"


def test_an_image_that_was_never_sealed_does_not_drive(parts: build.Parts, elf: Path, tmp_path: Path) -> None:
    content = image.Image(elf)
    at = content.place(content.symbol("protected_crc"), 4)
    content.content[at : at + 4] = b"\xff\xff\xff\xff"
    unsealed = tmp_path / "unsealed.elf"
    unsealed.write_bytes(content.content)
    with _core(parts, unsealed) as core:
        assert core.run(RUN_S) == LIMIT


def test_most_of_the_stack_is_never_touched(parts: build.Parts, elf: Path) -> None:
    """The worst case may need half of the stack. An idle drive without frames on the bus must need less."""
    with _core(parts, elf) as core:
        list(_periods(core, RUN_S))
        bottom, top = core.symbol("stack_bottom"), core.symbol("stack_top")
        stack = core.read(bottom, top - bottom)
        untouched = len(stack) - len(stack.lstrip(b"\xc5"))
        assert untouched > (top - bottom) // 2


@pytest.mark.parametrize("place", ["table_ref_i_d", "run_command"], ids=["table", "code in RAM"])
def test_what_is_damaged_later_disables_switching(parts: build.Parts, place: str) -> None:
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", 20.0)
        loop.run(1000)
        assert loop.get("fault_word") == 0
        core = Core.of_simulation(motor.library, loop._sim)
        address = core.symbol(place) & ~1
        byte = core.read(address, 1)[0] ^ 0x01
        assert core._library.emu_write(core._handle, address, bytes([byte]), 1)
        loop.run(1000)
        assert int(loop.get("fault_word")) == FAULT_CONFIG
        assert faults.refused_data(int(loop.get("motor_check"))).startswith("image_checksum: ")
        assert abs(loop.get("truth.torque_Nm")) < 0.5


def test_interrupts_rank_fault_fast_identification_bus_task(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        core.run(RUN_S)
        by_irq = {irq: core.read(0xE000_E400 + irq, 1)[0] >> 4 for irq in (103, 39, 69, 81, 78, 48)}
    assert list(by_irq.values()) == [0, 1, 2, 3, 3, 4]


def test_the_processor_runs_at_112_mhz_with_clock_monitors(parts: build.Parts, elf: Path) -> None:
    """8 MHz * 28 / 2; bus and flash at a half and a quarter; loss of the oscillator or of the PLL's lock resets."""
    with _core(parts, elf) as core:
        core.run(RUN_S)
        assert core.register("SMC.PMCTRL") >> 5 & 3 == 3  # HSRUN
        assert core.register("SCG.HCCR") == 6 << 24 | 0 << 16 | 1 << 4 | 3
        assert core.register("SCG.SPLLCFG") == 12 << 16
        assert core.register("SCG.SOSCCSR") & 0x3_0000 == 0x3_0000
        assert core.register("SCG.SPLLCSR") & 0x3_0000 == 0x3_0000


def test_the_bus_runs_at_500_kbit_per_second_and_samples_at_87_5_percent(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        core.run(RUN_S)
        control = core.register("CAN0.CTRL1")
    assert control >> 13 & 1 == 0  # clocked by the oscillator of 8 MHz
    before = 1 + (control & 7) + 1 + (control >> 19 & 7) + 1  # synchronisation, propagation, segment 1
    after = (control >> 16 & 7) + 1
    assert 8_000_000 / ((control >> 24) + 1) / (before + after) == 500_000
    assert before / (before + after) == 0.875


def test_the_watchdog_has_a_window_and_can_no_longer_be_changed(parts: build.Parts, elf: Path) -> None:
    """At the lowest oscillator frequency, 113 kHz, the time-out of 12 ms is 1356 ticks. The task services the watchdog
    at intervals of at least 113 ticks, and the closed window must be shorter."""
    with _core(parts, elf) as core:
        core.run(RUN_S)
        list(_periods(core, 0.01))
        control = core.register("WDOG.CS")
        assert control & 0x8080 == 0x8080  # WIN, EN
        assert control & 0x20 == 0  # UPDATE
        assert core.register("WDOG.TOVAL") / 113e3 == pytest.approx(12e-3, abs=1e-5)
        assert 0 < core.register("WDOG.WIN") < 113


def test_all_lines_to_the_board_are_outputs_and_off_after_start(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        core.run(RUN_S)
        list(_periods(core, 0.005))  # the second step of the task drives the line of the safe state
        assert core.register("PTC.PDDR") == 0b11_0100_1111  # precharge ... driver supply, safe state, A0, A1
        assert core.register("PTC.PDOR") & 0b100_1111 == 0
        assert core.register("FTM0.OUTMASK") & 0x3F == 0x3F


def test_no_conversion_is_triggered_while_another_runs(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        list(_periods(core, RUN_S))
        assert core.register("PDB0.CH0S") & 0xFF == 0
        assert core.register("PDB1.CH0S") & 0xFF == 0


def _count_entries(core: Core) -> dict[int, int]:
    """Counts the entries of each handler from now on, by interrupt number."""
    entered: dict[int, int] = {}

    def count_entry(vector: int, is_entry: bool) -> None:
        if is_entry:
            entered[vector - 16] = entered.get(vector - 16, 0) + 1

    core.on_exception(count_entry)
    return entered


def test_every_period_is_sampled(parts: build.Parts, elf: Path) -> None:
    with _core(parts, elf) as core:
        core.run(RUN_S)
        entered = _count_entries(core)
        periods = list(_periods(core, RUN_S)).count(CENTRE)
        assert entered[ADC0_IRQ] == pytest.approx(periods, abs=1)
        assert not {PDB0_IRQ, PDB1_IRQ} & entered.keys()


@pytest.mark.parametrize("register", ["ADC0.SC10", "ADC0.SC12", "ADC0.SC13", "ADC1.SC10", "ADC1.SC12"])
def test_a_result_that_was_not_read_in_time_costs_at_most_three_periods(
    parts: build.Parts, elf: Path, register: str
) -> None:
    """The next conversion into the register leaves the delay block locked until the interrupt of the sequence error
    restarts the block. In a period without the fast ISR the results of the other converter stay unread, so that its
    block may be locked as well."""
    with _core(parts, elf) as core:
        list(_periods(core, 0.0205))  # five periods after a start of the 1 kHz task, which reads results, too
        entered = _count_entries(core)
        assert core.run(1e-3) == CENTRE
        core.run(20e-6)  # the fast ISR of this period has read everything
        core.set_register(register, core.register(register) | COCO)
        entered.clear()
        periods = list(_periods(core, 0.02)).count(CENTRE)
        assert 1 <= entered.get(PDB0_IRQ, 0) + entered.get(PDB1_IRQ, 0) <= 2
        assert periods - entered[ADC0_IRQ] <= 3
        assert core.resets == 0


@pytest.mark.parametrize(("built", "impossible_value"), [(2e-6, 0.0), (2e-6, 1.3e-5), (1e-4, 1e-3)])
def test_with_a_period_or_dead_time_that_the_timer_cannot_make_the_pwm_never_starts(
    parts: build.Parts, elf: Path, tmp_path: Path, built: float, impossible_value: float
) -> None:
    """A dead time of zero, or of more than an eighth of the period; a period of more than 16 bits. The image's checksum
    is right."""
    changed = image.Image(elf)
    start = changed.place(changed.symbol("motor"), 4)
    end = changed.place(changed.symbol("cal_end") - 4, 4)
    word = struct.pack("<f", built)
    assert changed.content.count(word, start, end) == 1
    at = changed.content.index(word, start, end)
    changed.content[at : at + 4] = struct.pack("<f", impossible_value)
    path = tmp_path / "changed.elf"
    path.write_bytes(changed.content)
    image.seal(path)
    with _core(parts, path) as core:
        assert core.run(RUN_S) == LIMIT
        assert core.register("FTM0.SC") & CLOCK_SELECTED == 0
        assert core.resets == 0


@pytest.mark.parametrize(("register", "value"), [("LPIT0.MIER", 0), ("FTM0.EXTTRIG", 0)])
def test_a_task_or_a_fast_interrupt_that_no_longer_comes_resets_within_20_ms(
    parts: build.Parts, elf: Path, register: str, value: int
) -> None:
    """Without its timer's interrupt the task does not run and does not service the watchdog. Without the fast ISR the
    task finds that no period has passed and stops servicing. The 20 ms are the time-out, 12 ms at the slowest
    oscillator, plus up to three steps until the task detects the stall."""
    with _core(parts, elf) as core:
        list(_periods(core, RUN_S))
        assert core.resets == 0
        core.set_register(register, value)
        stopped_s = core.now_s
        for _ in range(500):
            core.run(1e-3)
            if core.resets == 1:
                break
        assert core.resets == 1
        assert core.now_s - stopped_s < 0.02
        assert core.run(RUN_S) == CENTRE  # it starts again
        assert core.word("cause") & 0x20  # RCM_SRS.WDOG: the cause of the reset that the bus reports
