# SPDX-License-Identifier: Apache-2.0
"""Cycles by opcode: the tables of the Cortex-M4 Technical Reference Manual, one line for each class."""

from __future__ import annotations

import pytest

from fluxtrue_tools.bench import cycles
from fluxtrue_tools.bench.disassembly import Instruction, parse, words
from fluxtrue_tools.errors import FluxtrueError

MANUAL = [
    ("movs", "r0, #1", 1), ("movge.w", "r0, r1", 1), ("adds.w", "r0, r1, r2, lsl #3", 1), ("subs", "r3, #1", 1),
    ("cmp.w", "r0, #3", 1), ("bics", "r0, r1", 1), ("lsls", "r0, r1, #3", 1), ("teq", "r0, r1", 1),
    ("mul.w", "r0, r1, r2", 1), ("muls", "r0, r1", 1), ("mla", "r0, r1, r2, r3", 1), ("mls", "r0, r1, r2, r3", 1),
    ("smull", "r0, r1, r2, r3", 1), ("smlal", "r0, r1, r2, r3", 1), ("smmulr", "r0, r1, r2", 1),
    ("smlad", "r0, r1, r2, r3", 1), ("smmls", "r0, r1, r2, r3", 1),
    ("sdiv", "r0, r1, r2", 12), ("udivne", "r0, r1, r2", 12),
    ("ssat", "r0, #16, r1, asr #2", 1), ("qadd", "r0, r1, r2", 1), ("uxth", "r0, r1", 1), ("sbfx", "r0, r1, #2, #3", 1),
    ("clz", "r0, r1", 1), ("pkhbt", "r0, r1, r2, lsl #16", 1),
    ("ldr.w", "r0, [r1, #4]", 2), ("ldrsh.w", "r0, [r1, r2, lsl #1]", 2), ("ldrbeq", "r0, [r1]", 2),
    ("strh", "r0, [r1]", 2),
    ("strd", "r0, r1, [sp, #8]", 3), ("ldrd", "r0, r1, [sp]", 3),
    ("push", "{r4, r5, lr}", 4), ("pop", "{r4, pc}", 3), ("ldmia.w", "sp!, {r4, r5, r6, r7, r8, r9, sl, fp, pc}", 10),
    ("stmdb", "sp!, {r4, lr}", 3), ("vpush", "{d8-d9}", 5), ("vldmia", "r0!, {s0-s2}", 4),
    ("b.n", "41c <f>", 1), ("bls.n", "41c <f>", 1), ("bleq", "41c <f>", 1), ("bl", "41c <f>", 1), ("bx", "lr", 1),
    ("blx", "r3", 1), ("cbnz", "r0, 41c <f>", 1), ("tbh", "[pc, r3, lsl #1]", 2),
    ("it", "mi", 1), ("itte", "ne", 1), ("nop", "", 1), ("dsb", "sy", 1), ("isb", "sy", 4),
    ("cpsid", "i", 2), ("mrs", "r0, PRIMASK", 2),
    ("vadd.f32", "s0, s1, s2", 1), ("vmulgt.f32", "s0, s1, s2", 1), ("vmov", "s0, r0", 1),
    ("vmov", "r0, r1, s0, s1", 2),
    ("vcvt.s32.f32", "s0, s1", 1),
    ("vmla.f32", "s0, s1, s2", 3), ("vfma.f32", "s0, s1, s2", 3), ("vdiv.f32", "s0, s1, s2", 14),
    ("vsqrt.f32", "s0, s1", 14),
    ("vldr", "s0, [r0]", 2), ("vldr", "d8, [r0]", 3), ("vstr", "s0, [sp, #4]", 2), ("vmrs", "APSR_nzcv, fpscr", 1),
]  # fmt: skip


# Each opcode is executed by tests/target/emulator/test_opcodes.py, which needs the cross compiler.
@pytest.mark.parametrize(("mnemonic", "operands", "expected"), MANUAL, ids=str)
def test_an_opcode_costs_what_the_manual_says(mnemonic: str, operands: str, expected: int) -> None:
    assert cycles.cycles(Instruction(0, 2, mnemonic, operands)) == expected


def test_an_unknown_instruction_is_an_error_that_names_it() -> None:
    with pytest.raises(FluxtrueError, match="'vsel.f32'"):
        cycles.cycles(Instruction(0, 4, "vsel.f32", "s0, s1, s2"))
    with pytest.raises(FluxtrueError, match="'wfi'"):  # not counted: how long it waits is unknown
        cycles.image_costs(parse("00000410 <f>:\n 410:\tbf30      \twfi\n"), [(0, 0x420)])


@pytest.mark.parametrize(
    ("name", "expected"),
    [("bls.n", ("b", True)), ("bl", ("bl", False)), ("mls", ("mls", False)), ("muls", ("mul", False)),
     ("movls", ("mov", True)), ("addsne", ("add", True))],
)  # fmt: skip
def test_conditions_and_flag_suffixes_are_told_from_names(name: str, expected: tuple[str, bool]) -> None:
    assert cycles.base(name) == expected


def test_a_register_list_is_counted_in_words() -> None:
    assert words("sp!, {r4, r5, lr}") == 3
    assert words("{d8-d11}") == 8
    assert words("{s16-s18, s20}") == 4


def test_every_instruction_of_a_listing_gets_its_cost_and_constants_none() -> None:
    listing = "00000410 <f>:\n 410:\tb510      \tpush\t{r4, lr}\n 412:\tf000 f801 \tbl\t418 <g>\n"
    listing += " 416:\tbd10      \tpop\t{r4, pc}\n\n00000418 <g>:\n 418:\t4770      \tbx\tlr\n"
    listing += " 41a:\tbf00      \tnop\n 41c:\t00001234 \t.word\t0x00001234\n"
    costs = cycles.image_costs(parse(listing), [(0, 0x420)])
    assert list(costs[0x410 // 2 :]) == [3, 1, 0, 3, 1, 1, 0, 0]
    assert cycles.image_costs(parse(listing), [(0, 0x414), (0x418, 4)])[0x410 // 2 :] == bytes([3, 1, 1, 1])
