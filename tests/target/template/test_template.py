# SPDX-License-Identifier: Apache-2.0
"""The image of hal/template links, and its memory layout is that of a port."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.target.build import image as build_image
from fluxtrue_tools.target.image import Image

BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"]).parent
# Slot of the vector table: handler.
VECTORS = {1: "reset_handler", 14: "mrai_handler", 16: "period_handler", 17: "task_handler"}


@pytest.fixture(scope="module")
def image() -> Image:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return Image(build_image("template", BUILD / "template"))


def test_the_vectors_name_the_handlers_of_the_three_priorities(image: Image) -> None:
    at = image.place(0, 4 * 18)
    table = struct.unpack_from("<18I", image.content, at)
    assert table[0] == image.symbol("stack_top")
    assert {slot: table[slot] for slot in VECTORS} == {slot: image.symbol(name) | 1 for slot, name in VECTORS.items()}


def test_the_motors_data_are_sealed_in_flash(image: Image) -> None:
    start, end = image.symbol("protected_start"), image.symbol("protected_end")
    assert start <= image.symbol("motor") < end
    at = image.place(start, end - start)
    (stored,) = struct.unpack_from("<I", image.content, image.place(image.symbol("protected_crc"), 4))
    assert stored == zlib.crc32(image.content[at : at + end - start])


def test_the_image_has_the_symbols_that_tools_need(image: Image) -> None:
    assert image.symbol("ecu") >= 0x2000_0000
    assert image.symbol("firmware_version") < 0x2000_0000
