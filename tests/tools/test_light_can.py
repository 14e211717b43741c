# SPDX-License-Identifier: Apache-2.0
"""python-can is imported without asammdf, and is complete once its reader of MDF4 files is asked for.

Each import has a process of its own, because what a process has imported stays.
"""

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = "asammdf", "pandas", "sympy"


def run(program: str, *arguments: object) -> str:
    """What a Python program prints."""
    done = subprocess.run([sys.executable, "-c", program, *map(str, arguments)], capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("module", ["can", "cantools.database", "fluxtrue_tools.bus.interface"])
def test_the_dbc_and_the_bus_do_not_load_the_reader_of_mdf4(module: str) -> None:
    loaded = run(f"import fluxtrue_tools, sys, {module}; print(*(set({HEAVY!r}) & set(sys.modules)))")
    assert loaded == ""


def test_asammdf_can_be_imported_afterwards() -> None:
    assert run("import fluxtrue_tools, can; from asammdf import MDF; print(MDF.__name__)") == "MDF"


@pytest.mark.parametrize("before", ["can", "asammdf", "fluxtrue_tools.vecu.mdf"])
def test_python_can_writes_and_reads_mdf4_once_asked_to(before: str, tmp_path: Path) -> None:
    """By the file's suffix, as python-can's users do, whatever was imported before."""
    program = f"""
import sys
import fluxtrue_tools, {before}
from fluxtrue_tools import light_can
light_can.with_mdf()
import can
with can.Logger(sys.argv[1]) as log:
    log(can.Message(timestamp=12.5, arbitration_id=0x123, data=b"abc", is_extended_id=False))
with can.LogReader(sys.argv[1]) as reader:
    print(*[(hex(frame.arbitration_id), bytes(frame.data)) for frame in reader])
"""
    assert run(program, tmp_path / "log.mf4") == "('0x123', b'abc')"


def test_without_being_asked_python_can_says_what_is_missing(tmp_path: Path) -> None:
    program = """
import sys
import fluxtrue_tools, can
try:
    can.Logger(sys.argv[1])
except NotImplementedError as error:
    print(error)
"""
    assert "asammdf package was not found" in run(program, tmp_path / "log.mf4")
