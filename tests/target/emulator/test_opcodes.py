# SPDX-License-Identifier: Apache-2.0
"""The estimate of cycles for each opcode: it is assembled, executed, and its cost compared with the manual's number.

The numbers were entered by hand from the instruction timings of the Cortex-M4 Technical Reference Manual (Arm DDI 0439,
table 3-1 and, for floating point, 7-1). Where the manual gives a range, it is the upper end: P = 3, divisions 12, MRS,
MSR and CPS 2, ISB 1 + P. A case lists one number for each executed instruction.
"""

import ctypes
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from fluxtrue_tools.bench import cycles, disassembly, image
from fluxtrue_tools.bench.build import ARM_CC, ARM_FLAGS
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim import library as lib

P = 3
LINK = ("-nostartfiles", "-nostdlib", "-Wl,-e,0,-Ttext=0x410,-Tbss=0x1FFF8800", "-Wl,--section-start=.vectors=0")
HANDLER = 16 + 12

# On entry: r0 a word-aligned address in RAM, r1 = 7, r2 = 3, r3 = 1, s0 = s1 = 1.0, Z and C set, N and V clear.
ONE_CYCLE = """
mov r4, r1|movw r4, #40000|movt r4, #1|mvn r4, r1|add r4, r1, r2|addw r4, r1, #4000|adc r4, r1, r2|sub r4, r1, r2
subw r4, r1, #4000|sbc r4, r1, r2|rsb r4, r1, #5|negs r4, r1|cmp r1, r2|cmn r1, r2|tst r1, r2|teq r1, r2
and r4, r1, r2|orr r4, r1, r2|orn r4, r1, r2|eor r4, r1, r2|bic r4, r1, r2|lsl r4, r1, r2|lsr r4, r1, r2
asr r4, r1, r2
asrs r4, r1, #2|mov r4, r1, asr #2|ror r4, r1, r2|rrx r4, r1|add r4, r1, r2, lsl #3|movs r4, #9|adds r4, r1, r2
sxtb r4, r1|sxth r4, r1|uxtb r4, r1|uxth r4, r1|sxtb16 r4, r1|uxtb16 r4, r1|sxtab r4, r1, r2|sxtah r4, r1, r2
uxtab r4, r1, r2|uxtah r4, r1, r2|ubfx r4, r1, #1, #5|sbfx r4, r1, #1, #5|bfi r4, r1, #1, #5|bfc r4, #1, #5
clz r4, r1|rbit r4, r1|rev r4, r1|rev16 r4, r1|revsh r4, r1|pkhbt r4, r1, r2, lsl #4|pkhtb r4, r1, r2, asr #4
sel r4, r1, r2|mul r4, r1, r2|muls r2, r1, r2|mla r4, r1, r2, r3|mls r4, r1, r2, r3|smull r4, r5, r1, r2
umull r4, r5, r1, r2|smlal r4, r5, r1, r2|umlal r4, r5, r1, r2|umaal r4, r5, r1, r2|smmul r4, r1, r2
smmulr r4, r1, r2|smmla r4, r1, r2, r3|smmlar r4, r1, r2, r3|smmls r4, r1, r2, r3|smmlsr r4, r1, r2, r3
smulbb r4, r1, r2|smulbt r4, r1, r2|smultb r4, r1, r2|smultt r4, r1, r2|smulwb r4, r1, r2|smulwt r4, r1, r2
smlabb r4, r1, r2, r3|smlabt r4, r1, r2, r3|smlatb r4, r1, r2, r3|smlatt r4, r1, r2, r3|smlawb r4, r1, r2, r3
smlawt r4, r1, r2, r3|smlalbb r4, r5, r1, r2|smlalbt r4, r5, r1, r2|smlaltb r4, r5, r1, r2|smlaltt r4, r5, r1, r2
smuad r4, r1, r2|smuadx r4, r1, r2|smusd r4, r1, r2|smusdx r4, r1, r2|smlad r4, r1, r2, r3|smladx r4, r1, r2, r3
smlsd r4, r1, r2, r3|smlsdx r4, r1, r2, r3|smlald r4, r5, r1, r2|smlaldx r4, r5, r1, r2|smlsld r4, r5, r1, r2
smlsldx r4, r5, r1, r2|ssat r4, #9, r1, lsl #2|usat r4, #9, r1|ssat16 r4, #9, r1|usat16 r4, #9, r1|qadd r4, r1, r2
qsub r4, r1, r2|qdadd r4, r1, r2|qdsub r4, r1, r2|qadd16 r4, r1, r2|qsub16 r4, r1, r2|qasx r4, r1, r2
qsax r4, r1, r2|sadd16 r4, r1, r2|ssub16 r4, r1, r2|shadd16 r4, r1, r2|shsub16 r4, r1, r2|sasx r4, r1, r2
ssax r4, r1, r2|uadd16 r4, r1, r2|usub16 r4, r1, r2|uadd8 r4, r1, r2|usub8 r4, r1, r2|nop|dsb|dmb
vadd.f32 s2, s0, s1|vsub.f32 s2, s0, s1|vmul.f32 s2, s0, s1|vnmul.f32 s2, s0, s1|vneg.f32 s2, s0|vabs.f32 s2, s0
vcmp.f32 s0, s1|vcmpe.f32 s0, #0.0|vcvt.s32.f32 s2, s0|vcvt.f32.u32 s2, s0|vcvtr.s32.f32 s2, s0|vmov.f32 s2, s0
vmov.f32 s2, #2.0|vmov s2, r1|vmov r4, s0|vmrs apsr_nzcv, fpscr|vmrs r4, fpscr|vmsr fpscr, r5
"""
TWO_CYCLES = """
ldr r4, [r0, #4]|ldr.w r4, [r0, r3, lsl #2]|ldr r4, [r0], #4|ldrb r4, [r0]|ldrh r4, [r0]|ldrsb r4, [r0]|ldrsh r4, [r0]
ldrex r4, [r0]|ldrexb r4, [r0]|ldrexh r4, [r0]|str r1, [r0, #4]|str r1, [r0, #4]!|strb r1, [r0]|strh r1, [r0]
strex r4, r1, [r0]|strexb r4, r1, [r0]|strexh r4, r1, [r0]|vldr s2, [r0]|vstr s0, [r0]|mrs r4, primask
msr basepri, r5|vmov r4, r5, s0, s1|vmov s2, s3, r1, r2|vmov r4, r5, d0|vmov d1, r1, r2
"""
# Cases with other costs, with several instructions, register lists, branches or IT blocks.
OTHER: dict[str, tuple[int, ...]] = {
    "sdiv r4, r1, r2": (12,), "udiv r4, r1, r2": (12,), "vdiv.f32 s2, s0, s1": (14,), "vsqrt.f32 s2, s0": (14,),
    "vmla.f32 s2, s0, s1": (3,), "vmls.f32 s2, s0, s1": (3,), "vnmla.f32 s2, s0, s1": (3,),
    "vnmls.f32 s2, s0, s1": (3,), "vfma.f32 s2, s0, s1": (3,), "vfms.f32 s2, s0, s1": (3,),
    "vfnma.f32 s2, s0, s1": (3,), "vfnms.f32 s2, s0, s1": (3,),
    "vldr d1, [r0]": (3,), "vstr d0, [r0]": (3,), "ldrd r4, r5, [r0]": (3,), "strd r1, r2, [r0, #8]": (3,),
    "isb": (1 + P,), "cpsid i; cpsie i": (2, 2),
    # 1, and 1 more for each word; P more if the program counter is loaded.
    "ldmia r0, {r4}": (1 + 1,), "ldmia r0, {r4, r5, r6, r7}": (1 + 4,), "ldmdb r0!, {r4, r5, r6}": (1 + 3,),
    "stmia r0!, {r1, r2}": (1 + 2,), "stmdb r0, {r1, r2, r3}": (1 + 3,),
    "push {r1}; pop {r4}": (1 + 1, 1 + 1), "push {r1, r2, lr}; pop {r4, r5, r6}": (1 + 3, 1 + 3),
    "vpush {s0}; vpop {s2}": (1 + 1, 1 + 1), "vpush {d0-d1}; vpop {d2-d3}": (1 + 4, 1 + 4),
    "vstmia r0, {s0-s2}": (1 + 3,), "vldmia r0!, {s2-s6}": (1 + 5,), "vldmdb r0!, {d1}": (1 + 2,),
    "vstmdb r0!, {d0-d1}": (1 + 4,),
    "adr r4, 1f; adds r4, #1; push {r3, r4}; pop {r4, pc}; nop; .balign 4; 1:": (1, 1, 1 + 2, 1 + 2 + P),
    "adr r4, 1f; adds r4, #1; str r4, [r0]; ldmia r0!, {pc}; nop; .balign 4; 1:": (1, 1, 2, 2 + P),
    "adr r4, 1f; adds r4, #1; str r4, [r0]; ldr pc, [r0]; nop; .balign 4; 1:": (1, 1, 2, 2 + P),
    "adr r4, 1f; mov pc, r4; nop; .balign 4; 1:": (1, 1 + P),
    # Branches: P when taken.
    "b 1f; nop; 1:": (1 + P,), "b.w 1f; nop; 1:": (1 + P,), "beq 1f; nop; 1:": (1 + P,), "bne 1f; 1: nop": (1, 1),
    "bhi.w 1f; 1: nop": (1, 1), "movs r4, #0; cbz r4, 1f; nop; 1:": (1, 1 + P), "cbz r1, 1f; nop; 1:": (1, 1),
    "cbnz r1, 1f; nop; 1:": (1 + P,), "movs r4, #0; cbnz r4, 1f; nop; 1:": (1, 1, 1),
    "bl 1f; nop; 1:": (1 + P,), "adr r4, 1f; adds r4, #1; bx r4; nop; .balign 4; 1:": (1, 1, 1 + P),
    "adr r4, 1f; adds r4, #1; blx r4; nop; .balign 4; 1:": (1, 1, 1 + P),
    "bl 1f; b 2f; 1: bx lr; 2:": (1 + P, 1 + P, 1 + P),
    "movs r4, #0; tbb [pc, r4]; 2: .byte (1f - 2b)/2, 0; nop; 1:": (1, 2 + P),
    "movs r4, #0; tbh [pc, r4, lsl #1]; 2: .short (1f - 2b)/2, 0; nop; 1:": (1, 2 + P),
    # After an IT: executed and skipped instructions cost the same.
    "it eq; moveq r4, r1": (1, 1), "it ne; movne r4, r1": (1, 1), "it ne; ldrne r4, [r0]": (1, 2),
    "ite eq; addeq r4, r1; ldrne r4, [r0]": (1, 1, 2), "itttt ne; movne r4, r1; addne r4, #1; strne r4, [r0]; "
    "ldrne r5, [r0]": (1, 1, 1, 2, 2), "it eq; beq 1f; nop; 1:": (1, 1 + P), "it ne; bne 1f; 1: nop": (1, 1, 1),
    "it ne; popne {r4, pc}": (1, 1 + 2), "it ne; udivne r4, r1, r2": (1, 12),
}  # fmt: skip


def _lines(text: str) -> list[str]:
    return [case for line in text.strip().splitlines() for case in line.split("|")]


CASES = dict.fromkeys(_lines(ONE_CYCLE), (1,)) | dict.fromkeys(_lines(TWO_CYCLES), (2,)) | OTHER

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
    ldr r0, =0xE000ED88; ldr r1, =0xF00000; str r1, [r0]; dsb; isb
    ldr r4, =at; movs r5, #0; str r5, [r4]
    ldr r0, =0xE000E100; ldr r1, =0x1000; str r1, [r0]
    ldr r6, =0xE000E200; ldr r7, =count
again:
    str r1, [r6]; dsb; isb
    ldr r5, [r4]; cmp r5, r7; bne again
end: b end
.thumb_func
handler:
    push {r4-r11, lr}
    ldr r0, =at; ldr r1, [r0]; adds r2, r1, #1; str r2, [r0]
    ldr r2, =cases; ldr r12, [r2, r1, lsl #2]
    ldr r0, =scratch; movs r1, #7; movs r2, #3; movs r5, #0; vmov.f32 s0, #1.0; vmov.f32 s1, s0
    movs r3, #1; cmp r3, r3
    bx r12
.ltorg
.balign 4
done: pop {r4-r11, pc}
"""


@dataclass
class Measured:
    """The program's code, and the instructions and cost of each case minus those of an empty one."""

    functions: list[disassembly.Function]
    instructions: list[int]
    cost: list[int]


def _assemble(folder: Path) -> Path:
    bodies = ["", *CASES]
    table = "".join(f".word case_{k}\n" for k in range(len(bodies)))
    cases = "".join(f".balign 4\n.thumb_func\ncase_{k}:\n{body}\nb.w done\n" for k, body in enumerate(bodies))
    source = folder / "opcodes.s"
    data = ".bss\nat: .space 4\n.space 64\nscratch: .space 64\n"
    source.write_text(f"{PROGRAM}.balign 4\ncases:\n{table}{cases}.set count, {len(bodies)}\n{data}")
    elf = source.with_suffix(".elf")
    command = [ARM_CC, *ARM_FLAGS, str(source), *LINK, "-o", str(elf)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return elf


@pytest.fixture(scope="module")
def measured(parts: Parts, tmp_path_factory: pytest.TempPathFactory) -> Measured:
    elf = _assemble(tmp_path_factory.mktemp("opcodes"))
    library: ctypes.CDLL = lib.load(parts.motor.folder.folder / "libfluxtrue_emu.so")
    image.declare(library)
    functions = disassembly.read(elf)
    costs = cycles.image_costs(functions, image.CODE)
    with Core.of_program(library, elf, counting=True) as core:
        assert library.emu_profile_start(core._handle, costs, len(costs), cycles.PIPELINE)
        core.run(2e-3)
        spans = [span[1:] for span in image.take(library, core._handle) if span[0] == HANDLER]
    assert len(spans) == 1 + len(CASES)
    empty = spans[0]
    return Measured(functions, [n - empty[0] for n, _ in spans[1:]], [c - empty[1] for _, c in spans[1:]])


@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_opcode_costs_what_the_manual_says(measured: Measured, case: str) -> None:
    k = list(CASES).index(case)
    assert measured.instructions[k] == len(CASES[case])
    assert measured.cost[k] == sum(CASES[case])


def _names(functions: list[disassembly.Function]) -> set[str]:
    return {cycles.base(i.mnemonic)[0] for function in functions for i in function.instructions}


def _tested(measured: Measured) -> set[str]:
    return _names([function for function in measured.functions if function.name.startswith("case_")])


def test_each_entry_of_the_cost_table_is_tested(measured: Measured) -> None:
    assert set(cycles.COSTS) - _tested(measured) == set()


def test_each_opcode_of_the_flashed_image_is_tested(measured: Measured) -> None:
    assert _names(disassembly.read(build.prepare("hsm1", flashed=True).image)) - _tested(measured) == set()
