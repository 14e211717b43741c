# SPDX-License-Identifier: Apache-2.0
"""Which bytes of an image's variables belong to no member."""

import subprocess
from pathlib import Path

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate.padding import padding
from fluxtrue_tools.errors import FluxtrueError

# A row: a declaration, and the offsets of its padding.
VARIABLES = (
    ("unsigned char x[3] = {1}", []),
    ("struct { int a; _Bool b; } x = {1}", [5, 6, 7]),
    ("volatile struct { char a; short b; } x = {1}", [1]),
    ("struct { struct { short a; char b; } inner; int c; } x[2] = {{{1}}}", [3, 11]),
    ("union { struct { char a; int b; } both; char two[2]; } x = {{1}}", [2, 3]),
    ("struct { unsigned a : 3, b : 4; int c; } x = {1}", [1, 2, 3]),
    ("struct { int c; unsigned char a : 3, b : 7; short d; } x = {1}", []),
    ("struct { int c; unsigned a : 3; } x = {1}", [5, 6, 7]),
)


def linked(folder: Path, declaration: str, *options: str) -> Path:
    source, image = folder / "x.c", folder / "x.elf"
    source.write_text(f"{declaration};\nconst volatile void *entry(void);\n"
                      "const volatile void *entry(void) { return &x; }\n", encoding="utf-8")  # fmt: skip
    sections = "-Wl,-e,entry,-Ttext=0x1000,--section-start=.data=0"
    compiler = ["arm-none-eabi-gcc", "-mcpu=cortex-m4", "-nostdlib", sections, *options]
    subprocess.run([*compiler, str(source), "-o", str(image)], check=True)
    return image


@pytest.mark.skipif(not have_arm_compiler(), reason="no cross compiler")
@pytest.mark.parametrize(("declaration", "expected"), VARIABLES)
def test_padding_is_what_no_member_covers(tmp_path: Path, declaration: str, expected: list[int]) -> None:
    assert sorted(padding(linked(tmp_path, declaration, "-g"))) == expected


@pytest.mark.skipif(not have_arm_compiler(), reason="no cross compiler")
def test_an_image_without_debug_information_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FluxtrueError, match="no debug information"):
        padding(linked(tmp_path, "int x = 1"))
