# SPDX-License-Identifier: Apache-2.0
"""Image, library, bus, Python tools, wheel, build and changelog report one version."""

from __future__ import annotations

import ctypes
import importlib.metadata
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from ecu import BUILD, ROOT, Ecu

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target import image
from fluxtrue_tools.target.build import image as build_image
from fluxtrue_tools.version import read

HEADER = ROOT / "firmware" / "types" / "version.h"
# Read here by other means than the tools' own.
NUMBERS = tuple(int(number) for number in re.findall(r"^#define \w+_(?:MAJOR|MINOR|PATCH) (\d+)$",
                                                     HEADER.read_text(encoding="utf-8"), re.MULTILINE))  # fmt: skip
VERSION = ".".join(map(str, NUMBERS))


def fluxtrue(*arguments: str) -> str:
    """What a command prints."""
    command = [sys.executable, "-m", "fluxtrue_tools", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def by_the_build() -> str:
    cache = (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")
    return re.findall(r"^CMAKE_PROJECT_VERSION:STATIC=(.+)$", cache, re.MULTILINE)[0]


def by_the_library() -> str:
    library = ctypes.CDLL(str(BUILD / "motors" / "hsm1" / "libfluxtrue_sil.so"))
    library.fluxtrue_version.restype = ctypes.c_char_p
    return library.fluxtrue_version().decode()


def by_the_bus() -> str:
    ecu = Ecu()
    ecu.run(1100)  # the frame comes once a second
    frame = ecu.last["INV_Version"]
    ecu.close()
    return f"{frame['Major']}.{frame['Minor']}.{frame['Patch']}"


def by_the_command_line() -> str:
    return fluxtrue("--version").removeprefix("fluxtrue ")


def by_the_changelog() -> str:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## \[(.+?)\]", text, re.MULTILINE)
    assert headings[0] == "Unreleased"
    return headings[1]


@pytest.mark.parametrize("reported", [by_the_build, by_the_library, by_the_bus, by_the_command_line, by_the_changelog])
def test_what_reports_a_version_reports_that_of_the_header(reported: Callable[[], str]) -> None:
    assert len(NUMBERS) == 3
    assert reported() == VERSION


@pytest.mark.parametrize("file", ["fluxtrue.elf", "fluxtrue.bin"])
def test_the_image_reports_it_as_words_and_as_text(file: str) -> None:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    built = build_image("s32k144", BUILD.parent / "s32k144").with_name(file)
    assert image.version(built) == image.Version(NUMBERS, VERSION)
    assert fluxtrue("target", "version", str(built)) == VERSION


def test_the_virtual_ecu_reports_it_as_words_and_as_text() -> None:
    assert image.version(BUILD / "motors" / "hsm1" / "fluxtrue_vecu") == image.Version(NUMBERS, VERSION)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the tools, installed into a folder."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-index",
                    "--no-build-isolation", "--no-deps", "--target", folder, ROOT / "tools"],
                   check=True)  # fmt: skip
    return folder


def run_installed(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command of the installed package; the checkout's own is not on its path."""
    program = "import sys; sys.path.insert(0, sys.argv.pop(1)); from fluxtrue_tools.__main__ import main; main()"
    return subprocess.run([sys.executable, "-I", "-c", program, str(folder), *arguments],
                          capture_output=True, text=True, check=False)  # fmt: skip


def test_the_wheel_reports_it(installed: Path) -> None:
    (found,) = importlib.metadata.distributions(name="fluxtrue-tools", path=[str(installed)])
    assert found.version == VERSION
    assert run_installed(installed, "--version").stdout.strip() == f"fluxtrue {VERSION}"


def test_the_wheel_checks_a_motor_and_refuses_what_needs_a_checkout(installed: Path) -> None:
    assert run_installed(installed, "motor", "check", str(ROOT / "firmware" / "motors" / "paper")).returncode == 0
    refused = run_installed(installed, "sim", "some.toml")
    assert refused.returncode == 2
    assert refused.stderr.startswith("error: command 'sim' needs the firmware's sources: run tools/fluxtrue in a check")


@pytest.mark.parametrize("content", [b"", b"\x7fELF" + bytes(64), image.MARK, 2 * image.MARK.ljust(64, b"\0")])
def test_a_file_without_one_version_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "some.bin"
    path.write_bytes(content)
    with pytest.raises(FluxtrueError, match=r"some\.bin: the mark of a version was found [012] times, allowed: once"):
        image.version(path)


def test_a_header_without_a_number_is_refused(tmp_path: Path) -> None:
    header = tmp_path / "version.h"
    header.write_text("#define FLUXTRUE_VERSION_MAJOR 1\n#define FLUXTRUE_VERSION_MINOR two\n", encoding="utf-8")
    with pytest.raises(FluxtrueError, match=r"version\.h: no line '#define FLUXTRUE_VERSION_MINOR <number>'"):
        read(header)
