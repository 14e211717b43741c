# SPDX-License-Identifier: Apache-2.0
"""hal/template defines every function that the headers of hal/ declare; each file says what the porter has to write."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HAL = Path(__file__).resolve().parents[3] / "hal"
HEADERS = sorted(HAL.glob("*.h"))
FUNCTION = re.compile(r"^[a-z]\w*(?: \w+)*[ *]+(hal_\w+)\([^;{]*\)\s*(;|\{)", re.MULTILINE)


def functions(path: Path, end: str) -> set[str]:
    """The functions that a file declares (end ';') or defines (end '{')."""
    return {name for name, sign in FUNCTION.findall(path.read_text(encoding="utf-8")) if sign == end}


def test_the_pattern_finds_every_prototype_in_the_headers() -> None:
    # Otherwise a prototype that FUNCTION does not match would be left out without a message.
    for header in HEADERS:
        code = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.DOTALL)
        assert functions(header, ";") == set(re.findall(r"\b(hal_\w+)\(", code)), header.name
    assert sum(len(functions(header, ";")) for header in HEADERS) >= 20


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.stem)
def test_the_template_defines_what_the_header_declares(header: Path) -> None:
    source = HAL / "template" / f"{header.stem}.c"
    assert source.is_file(), f"{source} is missing: hal/{header.name} declares {sorted(functions(header, ';'))}"
    assert functions(source, "{") == functions(header, ";")
    assert "/* Write" in source.read_text(encoding="utf-8")


def test_the_library_for_a_computer_takes_the_functions_of_a_port_without_a_dma_from_the_template() -> None:
    ports = {path.parent.name for path in HAL.glob("*/*.c") if "hal_gather_is_idle" in functions(path, "{")}
    assert ports == {"template", "s32k144"}


def test_the_howto_lists_every_header() -> None:
    page = (HAL.parent / "docs" / "howto" / "port.md").read_text(encoding="utf-8")
    assert [header.name for header in HEADERS if f"`hal/{header.name}`" not in page] == []
