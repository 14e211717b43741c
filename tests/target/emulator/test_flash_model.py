# SPDX-License-Identifier: Apache-2.0
"""The flash controller and the data flash by themselves: an idle program runs, the test accesses the registers."""

import ctypes
from collections.abc import Iterator

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

FLASH, SECTOR, PHRASE = 0x1000_0000, 2048, 8
CCIF, ACCERR, FPVIOL, MGSTAT0 = 0x80, 0x20, 0x10, 0x01
PROGRAM, ERASE = 0x07, 0x09
PROGRAM_S, ERASE_S = 90e-6, 12e-3
SLOW_PROGRAM_S, SLOW_ERASE_S = 225e-6, 130e-3
DATA = bytes(range(1, 9))
ERASED = b"\xff" * PHRASE
PROTECTION_BYTE = 0x40F  # FDPROT in the flash configuration field


@pytest.fixture
def core(library: ctypes.CDLL, program: Program) -> Iterator[Core]:
    with Core.of_program(library, program("idle")) as core:
        core.run(1e-4)
        yield core


def launch(core: Core, code: int, offset: int, data: bytes = ERASED, block: int = 0x80) -> None:
    """Write the parameters and start the command."""
    address = block << 16 | offset
    for name, value in (("FCCOB0", code), ("FCCOB1", address >> 16 & 0xFF), ("FCCOB2", address >> 8 & 0xFF),
                        ("FCCOB3", address & 0xFF)):  # fmt: skip
        core.store(f"FTFC.{name}", value)
    for name, value in zip("7654BA98", data, strict=True):
        core.store(f"FTFC.FCCOB{name}", value)
    core.store("FTFC.FSTAT", CCIF)


def done(core: Core, code: int, offset: int, data: bytes = ERASED) -> int:
    """The status after the command."""
    launch(core, code, offset, data)
    core.run(SLOW_ERASE_S)
    return core.load("FTFC.FSTAT")


def cells(core: Core, offset: int, size: int = PHRASE) -> bytes:
    return core.read(FLASH + offset, size)


def refused(core: Core, message: str, *command: int) -> None:
    with pytest.raises(EmulationStoppedError, match=message):
        launch(core, *command)


def test_a_phrase_is_programmed_into_erased_cells(core: Core) -> None:
    assert done(core, PROGRAM, 0x1238, DATA) == CCIF
    assert cells(core, 0x1238) == DATA
    assert cells(core, 0x1230) == cells(core, 0x1240) == ERASED


def test_a_sector_is_erased(core: Core) -> None:
    for offset in (2 * SECTOR - 8, 2 * SECTOR, 3 * SECTOR - 8, 3 * SECTOR):
        assert done(core, PROGRAM, offset, DATA) == CCIF
    assert done(core, ERASE, 2 * SECTOR + 16) == CCIF
    assert cells(core, 2 * SECTOR, SECTOR) == b"\xff" * SECTOR
    assert cells(core, 2 * SECTOR - 8) == cells(core, 3 * SECTOR) == DATA
    assert [core.flash_erases(k) for k in range(4)] == [0, 0, 1, 0]


@pytest.mark.parametrize(("code", "seconds", "slow_s"), [(PROGRAM, PROGRAM_S, SLOW_PROGRAM_S),
                                                          (ERASE, ERASE_S, SLOW_ERASE_S)])  # fmt: skip
def test_a_command_takes_its_time(core: Core, code: int, seconds: float, slow_s: float) -> None:
    for slow, wanted in ((False, seconds), (True, slow_s)):
        core.flash_slow(slow)
        launch(core, code, 0)
        core.run(0.99 * wanted)
        assert core.load("FTFC.FSTAT") == 0
        core.run(0.02 * wanted)
        assert core.load("FTFC.FSTAT") == CCIF


def test_parameters_of_a_running_command_are_refused(core: Core) -> None:
    launch(core, ERASE, 0)
    with pytest.raises(EmulationStoppedError, match="a command runs"):
        core.store("FTFC.FCCOB0", PROGRAM)


@pytest.mark.parametrize(
    ("code", "offset"), [(PROGRAM, 4), (ERASE, 8), (PROGRAM, 1 << 16), (ERASE, 1 << 17), (0x55, 0)]
)
def test_a_wrong_command_is_an_access_error(core: Core, code: int, offset: int) -> None:
    launch(core, code, offset)
    assert core.load("FTFC.FSTAT") == CCIF | ACCERR


def test_an_error_blocks_the_next_command(core: Core) -> None:
    launch(core, PROGRAM, 4)
    assert done(core, PROGRAM, 0, DATA) == CCIF | ACCERR
    assert cells(core, 0) == ERASED
    core.store("FTFC.FSTAT", ACCERR)
    assert done(core, PROGRAM, 0, DATA) == CCIF
    assert cells(core, 0) == DATA


def test_a_protected_region_keeps_its_cells(core: Core) -> None:
    """Each bit protects an eighth; software can set a protection, not remove it."""
    core.store("FTFC.FDPROT", 0xFD)
    core.store("FTFC.FDPROT", 0xFF)
    assert core.load("FTFC.FDPROT") == 0xFD
    for code in (PROGRAM, ERASE):
        launch(core, code, 0x2000, DATA)
        assert core.load("FTFC.FSTAT") == CCIF | FPVIOL
        core.store("FTFC.FSTAT", FPVIOL)
    assert done(core, PROGRAM, 0x1FF8, DATA) == CCIF
    assert done(core, PROGRAM, 0x4000, DATA) == CCIF
    core.power_cycle()
    assert core.load("FTFC.FDPROT") == 0xFF
    core.write(PROTECTION_BYTE, b"\xfe")
    core.power_cycle()
    assert core.load("FTFC.FDPROT") == 0xFE


def test_cells_that_are_not_erased_fail_verification(core: Core) -> None:
    assert done(core, PROGRAM, 0, DATA) == CCIF
    assert done(core, PROGRAM, 0, b"\x0f" * PHRASE) == CCIF | MGSTAT0
    core.flash_worn(3, True)
    assert done(core, ERASE, 3 * SECTOR) == CCIF | MGSTAT0
    core.flash_weak(4, True)
    assert done(core, ERASE, 4 * SECTOR) == CCIF
    assert done(core, PROGRAM, 4 * SECTOR, b"\x00" * PHRASE) == CCIF | MGSTAT0


# ---- read by a program: programs/flash.c


def test_reading_beside_a_command_is_refused(library: ctypes.CDLL, program: Program) -> None:
    stopped(library, program, 1, "a command runs on it")


def test_a_cached_read_of_changed_cells_is_refused(library: ctypes.CDLL, program: Program) -> None:
    stopped(library, program, 2, "may hold what was there")
    stopped(library, program, 6, "may hold what was there")
    with Core.of_program(library, program("flash", "-DCASE=3")) as core:
        core.run(0.05)
        assert core.word("seen") == 0x0403_0201


def test_an_uncorrectable_phrase_is_a_bus_fault(library: ctypes.CDLL, program: Program) -> None:
    with Core.of_program(library, program("flash", "-DCASE=4")) as core:
        core.flash_spoil(FLASH)
        with pytest.raises(EmulationStoppedError, match="uncorrectable error, a bus fault"):
            core.run(0.05)
        assert core.register("FTFC.FERSTAT") == 2
    with Core.of_program(library, program("flash", "-DCASE=5")) as core:
        core.flash_spoil(FLASH)
        core.run(0.05)
        assert core.word("failed") > 100
        assert core.word("failed") < 900


def stopped(library: ctypes.CDLL, program: Program, case: int, message: str) -> None:
    with (
        Core.of_program(library, program("flash", f"-DCASE={case}")) as core,
        pytest.raises(EmulationStoppedError, match=message),
    ):
        core.run(0.05)


def test_a_command_in_high_speed_run_is_refused(core: Core) -> None:
    registers = ("SOSCDIV", "SOSCCFG", "SOSCCSR", "SPLLDIV", "SPLLCFG", "SPLLCSR", "HCCR", "RCCR")
    values = (0x101, 0x24, 1, 0x302, 12 << 16, 1, 0x0600_0013, 0x0601_0013)
    for name, value in zip(registers, values, strict=True):
        core.store(f"SCG.{name}", value)
        core.run(2e-3 if name.endswith("CSR") else 0)  # until the source is valid
    core.store("SMC.PMPROT", 0x80)
    core.store("SMC.PMCTRL", 0x60)
    refused(core, "must not be launched in HSRUN", ERASE, 0)


def test_a_cut_command_leaves_uncertain_cells(core: Core) -> None:
    assert done(core, PROGRAM, SECTOR, DATA) == CCIF
    left = set()
    for seed in range(1, 40):
        core.flash_random(seed)
        launch(core, PROGRAM, PHRASE * seed, b"\0" * PHRASE)
        core.run(0.5 * PROGRAM_S)
        core.power_cycle()
        left.add(cells(core, PHRASE * seed))
    assert len(left) > 20
    launch(core, ERASE, SECTOR)
    core.run(0.5 * ERASE_S)
    core.power_cycle()
    erased = cells(core, SECTOR, SECTOR)
    assert erased.count(0xFF) > 0.3 * SECTOR
    assert core.flash_erases(1) == 1
    assert done(core, ERASE, SECTOR) == CCIF
    assert cells(core, SECTOR, SECTOR) == b"\xff" * SECTOR


def test_other_commands_are_refused(core: Core) -> None:
    refused(core, "command 0x80 is not modelled", 0x80, 0)


def test_commands_on_the_program_flash_are_refused(core: Core) -> None:
    with pytest.raises(EmulationStoppedError, match="program flash is not modelled"):
        launch(core, ERASE, 0, block=0)


def test_flash_interrupts_are_refused(core: Core) -> None:
    with pytest.raises(EmulationStoppedError, match="interrupts and suspending"):
        core.store("FTFC.FCNFG", 0x80)
