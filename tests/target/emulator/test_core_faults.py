# SPDX-License-Identifier: Apache-2.0
"""Faults of the core: the end of the emulation, or, if a test asks for it, the exceptions of the Armv7-M."""

import ctypes
from pathlib import Path

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core, EmulationStoppedError

HARD, MEMORY, BUS, USAGE = 3, 4, 5, 6
FORCED = 1 << 30
IACCVIOL, IBUSERR, PRECISERR, STKERR, BFARVALID, UNDEFINSTR, INVSTATE = (1 << k for k in (0, 8, 9, 12, 15, 16, 17))
DATA = PRECISERR | BFARVALID
LOCK_UP = 0x200
# CASE of programs/core_faults.c: CFSR, BFAR, address in the frame (None: of the instruction).
CAUSES = {
    0: (DATA, 0x6000_0000, None),
    1: (DATA, 0x0000_8000, None),
    2: (DATA, 0x4003_8008, None),
    3: (DATA, 0x4003_8008, None),
    4: (IACCVIOL, 0, 0x4003_8000),
    5: (IBUSERR, 0, 0x1FFF_0000),
    6: (UNDEFINSTR, 0, None),
    7: (INVSTATE, 0, "target"),
}
OWN = {0: BUS, 4: MEMORY, 5: BUS, 6: USAGE}
ENABLE_ALL = "-DSHCSR_BITS=ALL_FAULTS"


def seen(library: ctypes.CDLL, elf: Path, counting: bool = False) -> tuple[int, int, int, int, int]:
    """Vector, CFSR, HFSR and BFAR as the handler read them, and the address of its frame less that of the fault."""
    with Core.of_program(library, elf, counting) as core:
        core.take_faults()
        core.run(1e-4)
        assert core.word("entries") == 1
        assert core.word("after") == 0, "the code went on behind the fault"
        assert core.word("cleared") == 0
        assert core.resets == 0
        vector, pc, cfsr, hfsr, bfar = (core.word("seen", k) for k in range(5))
        return vector, cfsr, hfsr, bfar, pc


@pytest.mark.parametrize("counting", [False, True])
@pytest.mark.parametrize("case", CAUSES)
def test_a_core_fault_is_an_exception(library: ctypes.CDLL, program: Program, case: int, counting: bool) -> None:
    cause, address, place = CAUSES[case]
    elf = program("core_faults", f"-DCASE={case}")
    with Core.of_program(library, elf) as core:
        at = place if isinstance(place, int) else core.symbol(place or "at_fault") & ~1
    assert seen(library, elf, counting) == (HARD, cause, FORCED, address, at)


@pytest.mark.parametrize("case", OWN)
def test_an_enabled_fault_has_its_own_exception(library: ctypes.CDLL, program: Program, case: int) -> None:
    vector, cause, forced, _, _ = seen(library, program("core_faults", f"-DCASE={case}", ENABLE_ALL))
    assert (vector, cause, forced) == (OWN[case], CAUSES[case][0], 0)


def test_a_fault_that_its_own_exception_cannot_take(library: ctypes.CDLL, program: Program) -> None:
    """PRIMASK masks the fault's own exception, whose priority is 0, and not HardFault."""
    masked = program("core_faults", "-DCASE=6", ENABLE_ALL, '-DBEFORE="cpsid i"')
    vector, cause, forced, _, _ = seen(library, masked)
    assert (vector, cause, forced) == (HARD, UNDEFINSTR, FORCED)


@pytest.mark.parametrize("how", ["-DAGAIN=1", '-DBEFORE="cpsid f"'], ids=["in the handler", "FAULTMASK"])
def test_a_fault_in_the_handler_of_faults_is_a_lock_up(library: ctypes.CDLL, program: Program, how: str) -> None:
    with Core.of_program(library, program("core_faults", "-DCASE=6", how)) as core:
        core.take_faults()
        while core.resets == 0:
            assert core.now_s < 1e-3
            core.run(1e-6)
        assert core.register("RCM.SRS") == LOCK_UP


def test_a_stack_without_memory_still_reaches_hard_fault(library: ctypes.CDLL, program: Program) -> None:
    vector, cause, forced, _, _ = seen(library, program("core_faults", "-DCASE=8"))
    assert (vector, cause, forced) == (HARD, DATA | STKERR, FORCED)


@pytest.mark.parametrize("case", CAUSES)
def test_a_core_fault_that_no_test_expects_ends_the_emulation(
    library: ctypes.CDLL, program: Program, case: int
) -> None:
    with Core.of_program(library, program("core_faults", f"-DCASE={case}")) as core:
        for _ in range(2):
            with pytest.raises(EmulationStoppedError):
                core.run(1e-4)
        assert core.word("entries") == 0
