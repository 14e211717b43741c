# SPDX-License-Identifier: Apache-2.0
"""The library for Windows: it links, exports every call, needs no library of the compiler, and runs under Wine."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from progress import HANG_S
from sil import BUILD, ROOT
from test_examples import check_what_if

COMPILER = "x86_64-w64-mingw32-gcc"
FOLDER = BUILD / "windows"
WINE = next(filter(None, map(shutil.which, ("wine64", "wine", "/usr/lib/wine/wine64"))), None)

if not shutil.which(COMPILER):
    pytest.skip(f"{COMPILER} is not installed: no library for Windows is built", allow_module_level=True)


def run(*command: str | Path, **environment: str) -> str:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False,
                          env=os.environ | environment)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def dll() -> Path:
    """The DLL for the machine of the example."""
    run("cmake", "--preset", "windows", "-B", FOLDER, f"-DFLUXTRUE_MOTOR={ROOT / 'firmware' / 'motors' / 'paper'}")
    run("cmake", "--build", FOLDER, "--target", "fluxtrue_sil")
    return FOLDER / "fluxtrue_sil.dll"


@pytest.fixture
def program(dll: Path) -> Path:
    """The example beside the DLL, where Windows looks for it."""
    path = FOLDER / "what_if.exe"
    run(COMPILER, "-std=c11", "-Wall", "-Wextra", "-Werror", "-I.", "docs/howto/sil/what_if.c",
        dll.with_name("libfluxtrue_sil.dll.a"), "-o", path)  # fmt: skip
    return path


def test_the_dll_exports_every_call_of_the_header_and_needs_only_what_windows_has(dll: Path) -> None:
    header = (ROOT / "hal" / "host" / "fluxtrue.h").read_text(encoding="utf-8")
    declared = set(re.findall(r"^FLUXTRUE_API [\w *]+?\**(\w+)\(", header, re.MULTILINE))
    contents = run("x86_64-w64-mingw32-objdump", "-p", dll)
    exported = set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\] +[0-9a-f]+ )?(\w+)$", contents, re.MULTILINE))
    assert len(declared) >= 23
    assert declared - exported == set()
    needed = re.findall(r"DLL Name: (\S+)", contents)
    assert needed and [name for name in needed if name.lower().startswith("lib")] == []


def test_the_c_program_of_the_howto_links(program: Path) -> None:
    assert program.read_bytes().startswith(b"MZ")


@pytest.fixture
def wine() -> Iterator[dict[str, str]]:
    """Wine's environment; its server ends with the test."""
    if WINE is None:
        pytest.skip("Wine is not installed: the library for Windows is linked, but not run")
    environment = {"WINEPREFIX": str(FOLDER / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    yield environment
    server = shutil.which("wineserver") or shutil.which("/usr/lib/wine/wineserver64")
    if server:
        subprocess.run([server, "-k"], env=os.environ | environment, timeout=HANG_S, check=False)


def test_the_c_program_runs_as_on_this_computer(program: Path, wine: dict[str, str]) -> None:
    check_what_if(run(str(WINE), program, **wine))
