# SPDX-License-Identifier: Apache-2.0
"""The emulated processor by itself: small programs with one wrong access each, and exceptions of every kind."""

import ctypes
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import Program

from fluxtrue_tools.bench import image
from fluxtrue_tools.emulate.core import BREAK, Core, EmulationStoppedError

WATCHDOG, POWER_ON = 0x20, 0x80

REFUSED = {
    1: "write of SIM.PLATCGC offset 0x40: the register is not modelled",
    2: "read of SCG offset 0x44: there is no register",
    3: "write of FTM0.MOD offset 0x8: the peripheral's clock is off (PCC)",
    4: "write of FTM0.MOD offset 0x8: 0x00010000 changes the reserved bits 0x00010000",
    5: "read of 0x40025000: no peripheral is modelled there",
    6: "write of FTM0.MOD offset 0x8: 1 bytes, the register has 4",
    7: "write of 4 bytes at 0x00008000: no memory, or not permitted",
    8: "write of 4 bytes at 0x1fff7ffc: no memory, or not permitted",
    9: "write of 0x00000001 to the core's register 0xe000ed94 (4 bytes): not modelled",
    10: "the bits 0x8 are write protected (FMS.WPEN)",
    11: "HSRUN is not allowed by PMPROT.AHSRUN",
    12: "0x12345678 is neither unlock nor refresh",
    13: "vector 21 (IRQ 5) has no handler",
    14: "does not contain the key 0x05FA",
    15: "a floating-point instruction ran although CPACR does not allow it",
    16: "in HSRUN the core's clock changes by more than a factor of two",
    17: "clock gates must not be changed in HSRUN",
    18: "write of SMC.PMPROT: it can be written once after a reset",
    19: "write of ADC0.SC3: calibration requires CLPS ... CLP9 to be 0",
    20: "ADC0: a sample takes less than 275 ns",
    21: "ADC0 converts without having been calibrated",
    22: "write of LPIT0 offset 0x10: the module was not enabled four clocks before",
    23: "write of CAN0.MCR: the bits 0x20000000 can be written in freeze mode only",
    24: "write of CAN0.MCR: its message memory has not been initialised",
    25: "FTM0 is used, but PORTD.PCR15 does not give it the pin (MUX 2)",
    26: "PTC: line 0 is switched on, but it is an input (PDDR)",
    27: "access to 0x20000800: SIM.CHIPCTL.SRAMU_RETEN keeps this RAM from being accessed",
    30: "write of SCB.CCR: traps of divisions by zero",
    31: "the core raised exception 2",
    32: "the core raised exception 7",
    28: "SCG selects clock source 1, which is off, not valid yet or no whole number of ticks",
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_modelled_is_an_error(library: ctypes.CDLL, program: Program, case: int) -> None:
    with Core.of_program(library, program("poke", f"-DCASE={case}")) as core:
        with pytest.raises(EmulationStoppedError):
            core.run(3e-3)  # some start the oscillator and the PLL first
        assert core.error is not None
        assert REFUSED[case] in core.error
        assert "(reset+0x" in core.error, core.error  # the place in the program
        with pytest.raises(EmulationStoppedError, match="the emulation stopped"):
            core.run(1e-3)  # it cannot be continued


def test_the_program_counter_of_a_refused_access_is_exact(library: ctypes.CDLL, program: Program) -> None:
    elf = program("poke", "-DCASE=4")
    with Core.of_program(library, elf) as core:
        with pytest.raises(EmulationStoppedError):
            core.run(1e-3)
        assert core.error is not None
        pc = int(core.error.split("pc ")[1].split()[0], 16)
        (opcode,) = struct.unpack("<H", core.read(pc, 2))
    is_store_word = opcode >> 11 == 0b01100 or opcode >> 4 == 0xF8C  # STR (immediate), T1 or T3
    assert is_store_word


def test_ram_that_is_closed_to_keep_its_content_is_open_again_after_a_restored_state_and_after_a_power_on(
    library: ctypes.CDLL, program: Program
) -> None:
    second = "access to 0x20000804: SIM.CHIPCTL"  # the program's first access is that to 0x20000800
    with Core.of_program(library, program("poke", "-DCASE=29")) as core:
        start = core.save()
        for again in (lambda: None, lambda: core.restore(start), lambda: core.reset(POWER_ON)):
            again()
            with pytest.raises(EmulationStoppedError):
                core.run(1e-3)
            assert second in (core.error or "")
        core.free(start)


def test_a_reset_within_an_it_block_ends_the_block(library: ctypes.CDLL, program: Program) -> None:
    """EPSR.IT is zero after a reset: no instruction of the handler is skipped, wherever the program was stopped."""
    with Core.of_program(library, program("poke", "-DCASE=33")) as core:
        for k in range(40):
            core.run(1e-3 + k * 10e-9)  # an instruction takes 31 ns
            core.reset(POWER_ON)
            core.run(1e-3)
            assert core.error is None, f"stopped {k} times 10 ns later: {core.error}"


@pytest.fixture(scope="module")
def exceptions(program: Program) -> Path:
    return program("exceptions")


@pytest.mark.parametrize("counting", [False, True])
def test_exceptions_nest_by_priority(library: ctypes.CDLL, exceptions: Path, counting: bool) -> None:
    with Core.of_program(library, exceptions, counting) as core:
        core.run(5.5e-3)
        # HIGH after it was masked; LOW, interrupted by HIGH and by MIDDLE, which pends LOW again; LOW once more with
        # the same interruptions; HIGH.
        first = [6]
        once = [1, 6, 2, 4, 5, 3]
        order = [core.word("order", k) for k in range(core.word("at"))]
        assert core.word("masked") == 0
        assert order == first + once + once + first
        assert core.word("wrong") == 0
        # Each run of HIGH doubles the value, which therefore counts its runs.
        (value,) = struct.unpack("<f", core.read(core.symbol("value"), 4))
        assert value == 2.0 ** order.count(6)


@pytest.mark.parametrize("counting", [False, True])
def test_what_follows_an_access_in_an_it_block_is_not_conditional(
    library: ctypes.CDLL, program: Program, counting: bool
) -> None:
    """RAM below and above 0x20000000, a peripheral and the flash; loads, and stores to RAM."""
    elf = program("conditional")
    with Core.of_program(library, elf, counting) as core:
        core.run(1e-3)
        assert [core.word("sum", k) for k in range(4)] == [0x77] * 4


def _it_blocks(elf: Path) -> list[list[int]]:
    """The addresses of the instructions of each IT block."""
    listing = subprocess.run(["arm-none-eabi-objdump", "-d", str(elf)], check=True, capture_output=True, text=True)
    code = [line.split("\t") for line in listing.stdout.splitlines() if line.count("\t") >= 2]
    addresses = [int(words[0].strip(" :"), 16) for words in code]
    sizes = {k: len(words[2].strip()) - 1 for k, words in enumerate(code) if set(words[2].strip()) <= set("ite")}
    return [addresses[k + 1 : k + 1 + size] for k, size in sizes.items()]


def test_an_interrupt_at_any_instruction_changes_no_result(library: ctypes.CDLL, program: Program) -> None:
    """Flags, registers and memory of IT blocks with every condition; the core takes no interrupt within a block."""
    elf = program("interrupted")
    with Core.of_program(library, elf, counting=True) as core:
        start = core.save()
        core.run(1e-3)
        undisturbed, length = core.word("sum"), core.instructions
        enabled_after = 100
        points: list[int] = []
        for n in range(enabled_after, length):
            core.restore(start)
            core.break_after(n)
            if core.run(1e-3) != BREAK or core.word("done") == 1:
                break
            core.pend(16 + 10)
            core.run(1e-3)
            assert (core.word("done"), core.word("interrupts"), core.word("sum")) == (1, 1, undisturbed), n
            points.append(core.word("from"))
        core.free(start)
    blocks = _it_blocks(elf)
    assert len(blocks) > 14 * 4
    assert set(points).isdisjoint(address for block in blocks for address in block)
    follow = {block[-1] + size for block in blocks for size in (2, 4)}
    assert len(follow.intersection(points)) >= 14 * 4


LOW, MIDDLE, HIGH, LPIT = (16 + irq for irq in (10, 11, 12, 48))


def test_handlers_are_counted_without_what_interrupts_them(
    library: ctypes.CDLL, exceptions: Path, tmp_path: Path
) -> None:
    counts = []
    for counting in (False, True):
        with Core.of_program(library, exceptions, counting) as core:
            core.run(5.5e-3)
            counts.append([[getattr(core.counts(v), n) for n, _ in core.counts(v)._fields_]
                           for v in (LOW, MIDDLE, HIGH, LPIT)])  # fmt: skip
    low, middle, high, _ = counts[0]
    # Only counting by blocks includes an instruction that an IT skips: one for each comparison, of which LOW has two.
    assert [one[0] for one in counts[0]] == [one[0] for one in counts[1]]
    assert all(0 <= block[1] - one[1] <= 2 * one[0] for block, one in zip(*counts, strict=True))
    assert (low[0], middle[0], high[0]) == (2, 2, 4)
    # HIGH has no branch: each run has as many instructions as the listing from the symbol to the return.
    listing = subprocess.run(["arm-none-eabi-objdump", "-d", "--disassemble=high", str(exceptions)], check=True,
                             capture_output=True, text=True).stdout  # fmt: skip
    instructions = [line for line in listing.splitlines() if "\t" in line and ".word" not in line]
    returns = next(k for k, line in enumerate(instructions) if "bx\tlr" in line or "{pc}" in line or ", pc}" in line)
    assert high[2] == high[3] == returns + 1
    assert middle[2] < middle[3]  # it pends LOW in its first run only


def test_a_profile_counts_instructions_that_an_it_skips_and_no_branch_for_them(
    library: ctypes.CDLL, exceptions: Path
) -> None:
    with Core.of_program(library, exceptions) as core:
        core.run(5.5e-3)
        blocks = [core.counts(v) for v in (LOW, MIDDLE, HIGH)]
    image.declare(library)
    with Core.of_program(library, exceptions, counting=True) as core:
        size = image.CODE_SIZE // 2
        assert library.emu_profile_start(core._handle, b"\1" * size, size, 1000)
        core.run(5.5e-3)
        executed = [core.counts(v).sum for v in (LOW, MIDDLE, HIGH)]
        spans = list(image.take(library, core._handle))
    for vector, block in zip((LOW, MIDDLE, HIGH), blocks, strict=True):
        issued = [count for v, count, _ in spans if v == vector]
        assert (len(issued), min(issued), max(issued), sum(issued)) == (
            block.runs, block.least, block.most, block.sum)  # fmt: skip
    assert sum(executed) < sum(block.sum for block in blocks)  # something was skipped
    # LOW and HIGH compare, but have no branch: their cost is one for each instruction.
    assert all(cost == count for v, count, cost in spans if v in (LOW, HIGH))


def test_a_sleeping_core_is_woken_by_each_tick(library: ctypes.CDLL, exceptions: Path) -> None:
    with Core.of_program(library, exceptions) as core:
        core.run(5.5e-3)
        ticks, executed = core.word("ticks"), core.instructions
        core.run(2e-3)
        assert core.word("ticks") == ticks + 2
        assert core.instructions - executed < 100


def test_an_unserviced_watchdog_resets_and_reports_why(library: ctypes.CDLL, exceptions: Path) -> None:
    with Core.of_program(library, exceptions) as core:
        core.run(9.9e-3)
        assert core.resets == 0
        core.run(0.3e-3)
        assert core.resets == 1  # 10 ms after it was set up
        core.run(3e-3)
        assert core.word("cause") == WATCHDOG
        core.run(20e-3)
        assert core.resets == 3


def test_a_snapshot_restores_everything(library: ctypes.CDLL, exceptions: Path) -> None:
    with Core.of_program(library, exceptions) as core:
        core.run(3.2e-3)
        snapshot = core.save()
        seen = core.word("ticks"), core.now_s, core.instructions
        core.run(3e-3)
        assert core.word("ticks") == seen[0] + 3
        core.restore(snapshot)
        core.free(snapshot)
        assert (core.word("ticks"), core.now_s, core.instructions) == seen
        core.run(3e-3)
        assert core.word("ticks") == seen[0] + 3


NARROW = struct.pack("<4H", 0x2001, 0xBF00, 0xBF00, 0x4770)  # movs r0, #1; two instructions without effect; bx lr
WIDE = struct.pack("<4H", 0x2002, 0xF3AF, 0x8000, 0x4770)  # movs r0, #2; a wide one; bx lr: one instruction less


@pytest.fixture
def patched(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    """A program that has called the narrow function in RAM, which is therefore translated."""
    with Core.of_program(library, program("patched")) as core:
        core.run(1e-4)
        core.write(core.symbol("is_written"), bytes(4))
        core.run(1e-4)
        core.write(core.symbol("in_ram"), NARROW)
        core.write(core.symbol("is_written"), b"\1")
        core.run(1e-4)
        assert [core.word("answer", k) for k in range(2)] == [1, 1]
        yield core


def test_code_that_a_debugger_writes_runs(patched: Core) -> None:
    cycles = patched.word("cycles")
    patched.write(patched.symbol("in_ram"), WIDE)
    patched.write(patched.symbol("in_flash") & ~1, WIDE[:2])
    patched.run(1e-4)
    assert [patched.word("answer", k) for k in range(2)] == [2, 2]
    assert cycles - patched.word("cycles") in (1, 2)  # an instruction takes 1.5 cycles


def test_code_that_a_snapshot_restores_runs(patched: Core) -> None:
    cycles, snapshot = patched.word("cycles"), patched.save()
    patched.write(patched.symbol("in_ram"), WIDE)
    patched.run(1e-4)
    assert patched.word("answer", 1) == 2
    patched.restore(snapshot)
    patched.free(snapshot)
    patched.run(1e-4)
    assert (patched.word("answer", 1), patched.word("cycles")) == (1, cycles)


def test_code_that_a_reset_loses_does_not_run(patched: Core) -> None:
    """The RAM's content is lost: after the start the program finds its flag set, and no function."""
    patched.reset(WATCHDOG)
    patched.run(1e-4)
    assert [patched.word("answer", k) for k in range(2)] == [1, 0xA5A5A5A5]  # nothing has returned from there


def test_a_file_that_is_no_program_is_refused_by_name(library: ctypes.CDLL, tmp_path: Path) -> None:
    path = tmp_path / "not.elf"
    path.write_bytes(b"\x7fELF\x02 a 64-bit one" + bytes(64))
    with pytest.raises(Exception, match="not.elf: is not a 32-bit little-endian ELF file for Arm"):
        Core.of_program(library, path)
