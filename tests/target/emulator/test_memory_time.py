# SPDX-License-Identifier: Apache-2.0
"""What the core waits for its memories: traces small enough to be computed by hand, then a program of the emulator."""

import ctypes
import subprocess
from itertools import accumulate
from pathlib import Path

import pytest

from fluxtrue_tools.bench import image, memory
from fluxtrue_tools.bench.build import ARM_CC, ARM_FLAGS
from fluxtrue_tools.emulate.core import Core

# 128 sets of lines of 16 bytes: addresses 2048 apart share a set.
A, B, C = 0x1000, 0x1800, 0x2000
SRAM_L, SRAM_U, DATA_FLASH, PERIPHERAL, NVIC = 0x1FFF_8000, 0x2000_0000, 0x1000_0000, 0x4003_8000, 0xE000_E100


class Model:
    """One memory."""

    def __init__(self, library: ctypes.CDLL, costs: memory.Costs) -> None:
        self._library = library
        library.memory_time_create.restype = ctypes.c_void_p
        library.memory_time_create.argtypes = [ctypes.POINTER(memory.Costs)]
        library.memory_time_destroy.argtypes = [ctypes.c_void_p]
        library.memory_time_fetch.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32]
        library.memory_time_access.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_bool]
        library.memory_time_entry.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32]
        library.memory_time_return.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32]
        self.handle = library.memory_time_create(ctypes.byref(costs))

    def fetch(self, *addresses: int, size: int = 2) -> list[int]:
        return [self._library.memory_time_fetch(self.handle, address, size) for address in addresses]

    def access(self, address: int, size: int = 4, store: bool = False) -> int:
        return int(self._library.memory_time_access(self.handle, address, size, store))

    def entry(self, vector: int, stack: int, words: int = 8) -> int:
        return int(self._library.memory_time_entry(self.handle, vector, stack, words))

    def leave(self, stack: int, words: int = 8) -> int:
        return int(self._library.memory_time_return(self.handle, stack, words))


def costs(**changed: int) -> memory.Costs:
    """Two ways, a fill of 5, everything else free."""
    made = memory.Costs(128, 2, 16, 5, 5)
    for name, value in changed.items():
        setattr(made, name, value)
    return made


def test_a_line_is_filled_once_and_an_instruction_across_two_lines_fills_both(library: ctypes.CDLL) -> None:
    model = Model(library, costs())
    assert model.fetch(A, A + 2, A + 14) == [5, 0, 0]
    assert model.fetch(A + 14, size=4) == [5]
    assert model.fetch(B + 30, B + 16, size=4) == [10, 0]


def test_the_least_recently_used_line_of_a_full_set_is_replaced(library: ctypes.CDLL) -> None:
    """A is used again before C comes, so C replaces B; the oldest line would be A."""
    assert Model(library, costs()).fetch(A, B, A, C, A, B) == [5, 5, 0, 5, 0, 5]
    assert Model(library, costs(ways=1)).fetch(A, A, B, A, C, A, B) == [5, 0, 5, 5, 5, 5, 5]


def test_four_kibibytes_fit_and_one_line_more_displaces_only_its_own_set(library: ctypes.CDLL) -> None:
    model = Model(library, costs())
    lines = range(0x4000, 0x5000, 16)
    assert sum(model.fetch(*lines)) == 5 * len(lines) == 5 * 256
    assert sum(model.fetch(*lines)) == 0
    assert model.fetch(0x5000) == [5]
    assert model.fetch(0x4800, 0x4010, 0x4000) == [0, 0, 5]


def test_the_line_after_the_last_one_read_may_have_been_read_ahead(library: ctypes.CDLL) -> None:
    model = Model(library, costs(fill_ahead=1))
    assert model.fetch(A, A + 16, A + 32, A + 64, A + 80, A + 48) == [5, 1, 1, 5, 1, 5]


def test_the_core_waits_for_what_it_fetches_ahead(library: ctypes.CDLL) -> None:
    model = Model(library, costs(fetch_ahead_bytes=12))
    assert model.fetch(A, A + 2, A + 4, A + 6) == [5, 0, 5, 0]


def test_data_and_instructions_share_the_cache(library: ctypes.CDLL) -> None:
    model = Model(library, costs(code_bus=1))
    assert model.access(A + 4) == 1 + 5
    assert model.fetch(A) == [0]
    assert model.access(A + 12) == 1


def test_each_memory_has_its_own_waits(library: ctypes.CDLL) -> None:
    model = Model(library, costs(code_bus=1, narrow_store=20, peripheral=300))
    assert [model.access(SRAM_L + 0x7FFC), model.access(SRAM_L, 1), model.access(SRAM_L, 2, True)] == [1, 1, 21]
    assert [model.access(SRAM_U), model.access(SRAM_U, 4, True), model.access(SRAM_U, 1, True)] == [0, 0, 20]
    assert [model.access(PERIPHERAL), model.access(PERIPHERAL, 4, True)] == [300, 300]
    assert [model.access(DATA_FLASH), model.access(DATA_FLASH)] == [6, 6]  # not cached
    assert model.access(NVIC, 4, True) == 0
    assert model.fetch(SRAM_L, SRAM_L, size=4) == [0, 0]


def test_an_exception_reads_its_vector_and_moves_its_frame(library: ctypes.CDLL) -> None:
    assert Model(library, costs(code_bus=1)).entry(0xDC, SRAM_U) == 1 + 5
    assert Model(library, costs(code_bus=1)).entry(0xDC, SRAM_L) == 1 + 5 + 8
    assert Model(library, costs(code_bus=1, hidden_at_entry=12)).entry(0xDC, SRAM_L) == 2
    assert Model(library, costs(code_bus=1, hidden_at_entry=12)).entry(0xDC, SRAM_U) == 0
    assert Model(library, costs(code_bus=1)).leave(SRAM_L, 26) == 26
    assert Model(library, costs(code_bus=1)).leave(SRAM_U, 26) == 0


@pytest.mark.parametrize("wrong", [{"sets": 96}, {"sets": 2048}, {"ways": 0}, {"ways": 5}, {"line_bytes": 12}])
def test_an_impossible_cache_is_refused(library: ctypes.CDLL, wrong: dict[str, int]) -> None:
    assert Model(library, costs(**wrong)).handle is None


def test_the_most_is_never_less_than_the_least(library: ctypes.CDLL) -> None:
    least, most = (Model(library, both) for both in memory.BOTH)
    trace = [A, A + 4, B, A + 8, C, A + 12, A + 16, B + 4, A + 20, C + 2]
    sums = [list(accumulate(model.fetch(*trace))) for model in (least, most)]
    assert all(a <= b for a, b in zip(*sums, strict=True))
    for address in (A, SRAM_L, SRAM_U, PERIPHERAL, DATA_FLASH):
        assert least.access(address, 2, store=address >= SRAM_L) <= most.access(address, 2, store=address >= SRAM_L)


# The handler of interrupt 12 runs twice. It lies in two lines and a part of a third, which is that of a literal.
PROGRAM = """
.syntax unified
.thumb
.section .vectors, "a"
.word 0x20001000, reset
.fill 26, 4, 0
.word handler
.text
.thumb_func
reset:
    ldr r0, =0x40052000; ldr r1, =0xD928C520; str r1, [r0, #4]
    ldr r1, =0xFFFF; str r1, [r0, #8]; ldr r1, =0x2120; str r1, [r0]
    ldr r0, =0xE000E100; ldr r1, =0x1000; str r1, [r0]
    ldr r6, =0xE000E200
    str r1, [r6]; dsb; isb
    str r1, [r6]; dsb; isb
end: b end
.ltorg
.balign 16
.thumb_func
handler:
    ldr r0, =0x20000100
    str r1, [r0]
    strb r1, [r0]
    ldr r2, =0x1FFF8800
    ldr r3, [r2]
    strh r3, [r2]
    ldm.w r2, {r3, r12}
    ldr r0, =0x40052000
    ldr r1, [r0]
    bx lr
.ltorg
"""
HANDLER = 16 + 12


def test_every_fetch_and_access_of_a_run_is_charged_to_it(library: ctypes.CDLL, tmp_path: Path) -> None:
    source, elf = tmp_path / "waits.s", tmp_path / "waits.elf"
    source.write_text(PROGRAM)
    link = ("-nostartfiles", "-nostdlib", "-Wl,-e,0,-Ttext=0x410,-Tbss=0x1FFF8800", "-Wl,--section-start=.vectors=0")
    subprocess.run([ARM_CC, *ARM_FLAGS, str(source), *link, "-o", str(elf)], check=True, capture_output=True)
    image.declare(library)
    first = costs(fill=1, fill_ahead=1, code_bus=100, narrow_store=10_000, peripheral=1_000_000)
    second = costs(fill=0, fill_ahead=0, peripheral=7)
    with Core.of_program(library, elf, counting=True) as core:
        ones = b"\1" * (image.CODE_SIZE // 2)
        assert not library.emu_profile_memories(core._handle, (memory.Costs * 2)(first, second))  # no profile yet
        assert library.emu_profile_start(core._handle, ones, len(ones), 0)
        assert library.emu_profile_memories(core._handle, (memory.Costs * 2)(first, second))
        assert not library.emu_profile_memories(core._handle, (memory.Costs * 2)(first, second))
        core.run(1e-3)
        runs = [span[3:] for span in image.take_waits(library, core._handle) if span[0] == HANDLER]
    # On the bus of the instructions: the vector, three literals, and four words of SRAM_L.
    waits = 8 * 100 + 2 * 10_000 + 1_000_000
    assert runs == [(waits + 4, 7), (waits, 7)]
