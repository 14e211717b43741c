# SPDX-License-Identifier: Apache-2.0
"""The S32K144's image as it would be flashed: memory layout, instructions of the interrupts, size."""

from __future__ import annotations

import os
import re
import struct
import subprocess
import zlib
from pathlib import Path

import pytest

from fluxtrue_tools.bench import disassembly
from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.figures import budget, stack_use
from fluxtrue_tools.bench.page import STACK_MAX
from fluxtrue_tools.target import image
from fluxtrue_tools.target.build import image as build_image

BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"]).parent
PRESETS = ("s32k144", "s32k144-resolver")
# Slot of the vector table: handler. The slot is 16 + the number of the interrupt in the manufacturer's list.
VECTORS = {1: "reset_handler", 3: "fault_handler", 15: "fault_handler", 16 + 39: "adc_handler", 16 + 48: "tick_handler",
           16 + 69: "mrai_handler", 16 + 78: "can_bus_off_handler", 16 + 81: "can_message_handler",
           16 + 52: "sampling_error_handler", 16 + 68: "sampling_error_handler",
           16 + 103: "gate_fault_handler", 16 + 40: "fault_handler"}  # fmt: skip
FLOAT = re.compile(r"^\s+[0-9a-f]+:\s+(?:[0-9a-f]{4} ?)+\s+(v[a-z0-9.]+)", re.MULTILINE)


@pytest.fixture(scope="module", params=PRESETS)
def elf(request: pytest.FixtureRequest) -> Path:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build_image(request.param, BUILD / request.param)


def _read(elf: Path, address: int, size: int) -> bytes:
    found = image.Image(elf)
    at = found.place(address, size)
    return bytes(found.content[at : at + size])


def test_the_image_fits_its_bounds_with_the_stack(elf: Path) -> None:
    bounds = budget()
    print(image.size(elf, image.Size(*(bounds[f"{name}_bytes"] for name in ("flash", "ram", "ram_code")))))


def test_the_vectors_name_the_handlers_and_every_other_entry_is_a_fault(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    table = struct.unpack("<139I", _read(elf, 0, 4 * 139))
    for slot, name in VECTORS.items():
        assert table[slot] == symbols[name] | 1, name
    others = {entry for slot, entry in enumerate(table) if slot and slot not in VECTORS}
    assert others == {symbols["fault_handler"] | 1}


def test_the_stack_begins_at_its_top_and_ends_at_the_first_byte_of_the_ram(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    assert struct.unpack("<I", _read(elf, 0, 4))[0] == symbols["stack_top"]
    assert symbols["stack_bottom"] == 0x1FFF_8000  # an access below this address is a fault


def test_the_deepest_nesting_takes_at_most_half_of_the_stack(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    uses, problems = stack_use(disassembly.read(elf), budget())
    assert problems == []
    assert sum(use.frame + use.stack for use in uses) <= STACK_MAX * (symbols["stack_top"] - symbols["stack_bottom"])


def test_the_flash_configuration_leaves_the_processor_unsecured(elf: Path) -> None:
    assert _read(elf, 0x400, 16) == bytes([0xFF] * 12 + [0xFE, 0x7F, 0xFF, 0xFF])


def test_configuration_and_tables_are_sealed(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    start, end = symbols["protected_start"], symbols["protected_end"]
    assert start <= symbols["motor"] < symbols["cal_end"] <= end
    assert symbols["cal_end"] <= symbols["table_g"] < end
    stored = struct.unpack("<I", _read(elf, symbols["protected_crc"], 4))[0]
    assert stored == zlib.crc32(_read(elf, start, end - start))


@pytest.mark.parametrize("handler", ["adc_handler", "sampling_error_handler", "mrai_handler", "gate_fault_handler"])
def test_no_interrupt_of_the_control_uses_floating_point(elf: Path, handler: str) -> None:
    """Link-time optimisation inlines most called functions; those that remain calls are followed."""
    todo, seen = [handler], set()
    while todo:
        name = todo.pop()
        seen.add(name)
        command = ["arm-none-eabi-objdump", "-d", f"--disassemble={name}", str(elf)]
        text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        assert f"<{name}>:" in text
        assert not FLOAT.findall(text), f"{name}: {FLOAT.findall(text)[:3]}"
        called = set(re.findall(r"\bb(?:l|\.w|\.n)?\s+[0-9a-f]+ <([^>+]+)>", text))
        todo += sorted(called - seen - set(todo))
    assert "panic" not in seen


def test_reserved_memory_keeps_its_sectors(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    assert symbols["nvm_start"] == 0x1000_0000
    assert symbols["nvm_end"] - symbols["nvm_start"] == 32 * 2048


def test_the_usual_route_of_the_fast_isr_does_not_wait_for_the_flash(elf: Path) -> None:
    found = image.Image(elf).symbols
    symbols = {disassembly.plain(name): address for name, address in found.items()}
    assert "fast_isr" not in symbols  # compiled into adc_handler
    for name in ("adc_handler", "current_control_step", "modulate_step", "flux_table_step"):
        assert symbols["hot_start"] <= symbols[name] < symbols["hot_end"], name


def test_flash_commands_are_launched_in_sram(elf: Path) -> None:
    symbols = image.Image(elf).symbols
    assert 0x1FFF_8000 <= symbols["run_command"] < 0x2000_7000
    assert symbols["hot_start"] <= symbols["run_command"] < symbols["hot_end"]  # copied there at start-up


def test_no_heap_function_is_linked(elf: Path) -> None:
    heap = re.compile(r"_*(malloc|calloc|realloc|free|sbrk|morecore)(_r)?")
    assert not [name for name in image.Image(elf).symbols if heap.fullmatch(name)]
