# SPDX-License-Identifier: Apache-2.0
"""Programs, libraries and images with a fault in the motor data that they carry."""

import shutil
from pathlib import Path

from fluxtrue_tools.target.image import Image

BAD_FLUX = ("table_l_q", 0, bytes(2))  # an inductance of zero
BAD_REFERENCE = ("table_ref_i_d", 0, b"\x01\x00")  # a positive i_d


def damaged(elf: Path, out: Path, symbol: str, at: int, data: bytes) -> Path:
    """A copy of an ELF file in which the bytes at an offset from a symbol are replaced."""
    image = Image(elf)
    place = image.place(image.symbol(symbol) + at, len(data))
    assert image.content[place : place + len(data)] != data, "the file has these bytes already"
    image.content[place : place + len(data)] = data
    shutil.copy(elf, out)  # copies the permission to execute, too
    out.write_bytes(image.content)
    return out
