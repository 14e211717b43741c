# SPDX-License-Identifier: Apache-2.0
"""Sealing and sizing a linked image."""

from __future__ import annotations

import shutil
import subprocess
import zlib
from pathlib import Path

import pytest
from port_samples import SCRIPT, SOURCE

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target import image
from fluxtrue_tools.target.build import ARM_CC


@pytest.fixture
def elf(tmp_path: Path) -> Path:
    if shutil.which(ARM_CC) is None:
        pytest.skip(f"{ARM_CC} is not installed")
    (tmp_path / "a.c").write_text(SOURCE)
    (tmp_path / "a.ld").write_text(SCRIPT)
    command = [ARM_CC, "-mcpu=cortex-m4", "-nostdlib", "-T", "a.ld", "a.c", "-o", "a.elf"]
    subprocess.run(command, cwd=tmp_path, check=True)
    return tmp_path / "a.elf"


def test_the_seal_is_the_checksum_of_what_lies_between_the_marks(elf: Path) -> None:
    assert "over 6 bytes at 0x1000" in image.seal(elf)
    content = elf.read_bytes()
    at = content.index(bytes([1, 2, 3, 4, 5, 6]))
    assert content[at + 8 : at + 12] == zlib.crc32(bytes([1, 2, 3, 4, 5, 6])).to_bytes(4, "little")


def test_sealing_twice_changes_nothing(elf: Path) -> None:
    image.seal(elf)
    once = elf.read_bytes()
    image.seal(elf)
    assert elf.read_bytes() == once


def test_initialised_data_count_in_flash_and_in_ram(elf: Path) -> None:
    found = image.Size.of(image.Image(elf))
    assert (found.ram, found.ram_code) == (1000, 0)
    flash = found.flash
    assert 1012 < flash < 1100  # data, guarded bytes with their checksum, and a few instructions


def test_an_image_beyond_its_bounds_is_an_error(elf: Path) -> None:
    with pytest.raises(FluxtrueError, match=r"RAM 1000 of 999 bytes"):
        image.size(elf, image.Size(4096, 999, 0))
    with pytest.raises(FluxtrueError, match=r"of 1000 bytes, RAM"):
        image.size(elf, image.Size(1000, 1000, 0))


def test_code_in_the_ram_is_counted_apart(elf: Path) -> None:
    (elf.parent / "a.c").write_text(SOURCE + '__attribute__((section(".hot"), used)) void in_ram(void) {}\n')
    (elf.parent / "a.ld").write_text(SCRIPT.replace("/DISC", ".hot 0x20001000 : AT(0x3000) { *(.hot) }\n  /DISC"))
    command = [ARM_CC, "-mcpu=cortex-m4", "-nostdlib", "-T", "a.ld", "a.c", "-o", "b.elf"]
    subprocess.run(command, cwd=elf.parent, check=True)
    found = image.Size.of(image.Image(elf.parent / "b.elf"))
    assert found.ram_code > 0
    with pytest.raises(FluxtrueError, match=rf"code in the RAM {found.ram_code} of 0 bytes"):
        image.size(elf.parent / "b.elf", image.Size(4096, 4096, 0))


def test_what_is_no_image_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "x.elf"
    path.write_bytes(b"something else")
    with pytest.raises(FluxtrueError, match="not an ELF file"):
        image.seal(path)
    assert path.read_bytes() == b"something else"
    with pytest.raises(FluxtrueError, match="No such file"):
        image.seal(tmp_path / "missing.elf")


def test_an_elf_without_the_marks_is_refused(elf: Path, tmp_path: Path) -> None:
    (tmp_path / "b.c").write_text("void start(void) {}\n")
    command = [ARM_CC, "-mcpu=cortex-m4", "-nostdlib", "-e", "start", "b.c", "-o", "b.elf"]
    subprocess.run(command, cwd=tmp_path, check=True)
    with pytest.raises(FluxtrueError, match="no symbol 'protected_start'"):
        image.seal(tmp_path / "b.elf")
