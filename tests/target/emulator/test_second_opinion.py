# SPDX-License-Identifier: Apache-2.0
"""The core's exceptions, masks, priorities, SysTick and floating-point context: this emulator's models (nvic.c, scs.c)
behave like those of QEMU, which were written independently."""

import ctypes
import shutil
import subprocess

import pytest
from conftest import Program

from fluxtrue_tools.emulate.core import Core

QEMU = "qemu-system-arm"
ANY_M4F = "mps2-an386"
CLOCK = ("-icount", "shift=3,sleep=off")
MARKS = 16  # every step begins with a mark


def qemu(program: Program) -> list[int]:
    if shutil.which(QEMU) is None:
        pytest.skip(f"{QEMU} is not installed: there is nothing to compare with")
    elf = program("core_slice", "-DSEMIHOSTING", data=0x2000_0800, bss=0x2000_0000)
    command = [QEMU, "-M", ANY_M4F, "-nographic", "-monitor", "none", "-serial", "none", *CLOCK,
               "-semihosting-config", "enable=on,target=native", "-kernel", str(elf)]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [int(word, 16) for word in (done.stdout + done.stderr).split()]


@pytest.mark.parametrize("counting", [False, True])
def test_qemu_takes_the_same_exceptions(library: ctypes.CDLL, program: Program, counting: bool) -> None:
    with Core.of_program(library, program("core_slice"), counting) as core:
        core.run(50e-3)
        ours = [core.word("out", k) for k in range(core.word("used"))]
    assert sum(word >> 16 == 0xC0DE for word in ours) == MARKS
    assert ours == qemu(program)
