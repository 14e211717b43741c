# SPDX-License-Identifier: Apache-2.0
"""The image of hal/mps2 on QEMU's M4F, M7 and M33: same duties, faults and identified values as on the host."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.target.build import image

BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"])
QEMU = "qemu-system-arm"
# Each instruction takes 4 ns of virtual time, and idle time is skipped: every run is identical. A period has 25,000
# instructions, enough for all activities, which therefore never interrupt one another in another order than the host's.
CLOCK = ("-icount", "shift=2,sleep=off")
BOARDS = ("mps2-an386", "mps2-an500", "mps2-an505")
PERIODS = 4000


def _words(text: str) -> dict[str, int]:
    return {name: int(value, 16) for name, value in (line.split("=") for line in text.split())}


@pytest.fixture(scope="module")
def expected() -> dict[str, int]:
    program = next(BUILD.glob("tests/target/mps2/mps2_host*"))
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    return _words(done.stdout)


def _boot(board: str) -> dict[str, int]:
    if not have_arm_compiler() or shutil.which(QEMU) is None:
        pytest.skip(f"the Arm compiler or {QEMU} is not installed: no image is run")
    elf = image(board, BUILD.parent / board)
    command = [QEMU, "-M", board, "-nographic", "-monitor", "none", "-serial", "none", *CLOCK,
               "-semihosting-config", "enable=on,target=native", "-kernel", str(elf)]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return _words(done.stdout + done.stderr)


@pytest.mark.parametrize("board", BOARDS)
def test_an_emulated_board_computes_the_same_results_as_the_host(board: str, expected: dict[str, int]) -> None:
    assert _boot(board) == expected


def test_the_script_keeps_the_drive_switching_and_identifying_without_a_fault(expected: dict[str, int]) -> None:
    assert expected["faults"] == 0
    assert expected["overruns"] == 0
    assert expected["differing"] > PERIODS // 2
    assert expected["psi_delta"] != 0
    assert expected["r_delta"] != 0
