# SPDX-License-Identifier: Apache-2.0
"""The register header agrees with the maker's file; names that the file does not have are refused."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from port_samples import SVD

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target import registers
from fluxtrue_tools.target.svd import Device

PORT = Path(__file__).resolve().parents[3] / "hal" / "s32k144"

LIST = """
device = "CHIP"
guard = "CHIP_REGISTERS_H"
[blocks.tim]
instances = ["TIM"]
interrupts = ["TIM_Overflow"]
[blocks.tim.registers]
SC = ["CLK", "EN"]
"R*" = []
"C*" = []
"""


@pytest.fixture
def device(tmp_path: Path) -> Device:
    path = tmp_path / "CHIP.svd"
    path.write_text(SVD)
    return Device(path)


def _header(device: Device, tmp_path: Path, text: str = LIST) -> str:
    path = tmp_path / "list.toml"
    path.write_text(text)
    wanted = registers.load(path)
    return registers.header(wanted, device, registers.choose(wanted, device, path), path)


def test_the_header_compiles_and_puts_bits_and_registers_where_the_file_says(device: Device, tmp_path: Path) -> None:
    (tmp_path / "registers.h").write_text(_header(device, tmp_path))
    program = """#include "registers.h"
    _Static_assert(TIM_SC_CLK(3) == 0x18 && TIM_SC_CLK(4) == 0 && TIM_SC_CLK_MASK == 0x18, "CLK");
    _Static_assert(TIM_SC_EN == 0x20 && IRQ_TIM_OVERFLOW == 7, "EN");
    _Static_assert(offsetof(tim_t, SC) == 4 && offsetof(tim_t, R[3]) == 0x1C, "place");
    _Static_assert(offsetof(tim_t, C[1]) == 0x34 && sizeof(tim_t) == 0x38, "arrays");
    uint32_t read(void) { return TIM->R[2]; }
    """
    (tmp_path / "use.c").write_text(program)
    command = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", "-Wno-int-to-pointer-cast", "-fsyntax-only", "use.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


def test_a_register_that_is_read_only_cannot_be_written(device: Device, tmp_path: Path) -> None:
    (tmp_path / "registers.h").write_text(_header(device, tmp_path))
    (tmp_path / "use.c").write_text('#include "registers.h"\nvoid w(tim_t *t) { t->R[0] = 1; }\n')
    done = subprocess.run(["gcc", "-std=c11", "-fsyntax-only", "use.c"], cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode != 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("SC =", "SX ="), "tim: no register 'SX' in CHIP"),
        (('"EN"', '"ON"'), "tim.SC: no field 'ON', allowed: CLK, EN"),
        (('["TIM"]', '["TOM"]'), "no peripheral 'TOM'"),
        (('device = "CHIP"', 'device = "CHOP"'), "describes CHIP"),
        (("guard =", "gurad ="), "guard: Field required"),
    ],
)
def test_a_name_that_is_not_known_is_one_message(
    change: tuple[str, str], message: str, device: Device, tmp_path: Path
) -> None:
    with pytest.raises(FluxtrueError, match=re.escape(message)):
        _header(device, tmp_path, LIST.replace(*change))


def test_a_file_that_is_no_svd_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.svd"
    path.write_text("no XML")
    with pytest.raises(FluxtrueError, match="not an SVD file"):
        Device(path)
    with pytest.raises(FluxtrueError, match="missing.svd: cannot be read"):
        Device(tmp_path / "missing.svd")


def test_the_committed_header_has_every_register_and_field_of_its_list_and_no_other() -> None:
    """The maker's file is not in the repository: only names are compared. A field not in the list was added by hand."""
    text = (PORT / "registers.h").read_text(encoding="utf-8")
    macros = set(re.findall(r"#define (\w+?)(?:_MASK)?(?:\(x\))? ", text))
    with (PORT / "registers.toml").open("rb") as stream:
        wanted = tomllib.load(stream)
    expected = set()
    for name, block in wanted["blocks"].items():
        expected |= set(block["instances"])
        for register, fields in block["registers"].items():
            stem = register.rstrip("*")
            assert f"offsetof({name}_t, {stem}) ==" in text
            prefix = stem if stem.upper().startswith(f"{name}_".upper()) else f"{name}_{stem}"
            expected |= {f"{prefix}_{field}".upper() for field in fields}
    interrupts = {macro for macro in macros if macro.startswith("IRQ_")}
    assert macros - interrupts - {"HAL_S32K144_REGISTERS_H"} == expected
