# SPDX-License-Identifier: Apache-2.0
"""An estimate of cycles: what the Arm Cortex-M4 Technical Reference Manual (DDI 0439) says of each instruction.

Facts of its tables 3-1 (instruction set) and 7-1 (floating point), nothing measured. Where the manual gives a span the
larger end is taken: a refilled pipeline P = 3, a division 12, neighbouring loads and stores never overlapped, an
instruction skipped in an IT block as if it had run. Wait states of flash and peripheral bridges are not included.
tests/target/emulator/test_opcodes.py executes each entry; what cannot be given a number (WFI, BKPT, UDF) has none.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fluxtrue_tools.bench.disassembly import CONDITIONS, Function, Instruction, words
from fluxtrue_tools.errors import FluxtrueError

PIPELINE = 3  # P: 1 to 3
DIVIDE = 12  # 2 to 12
ENTRY, RETURN = 12, 10  # exception entry and return without wait states

# Cycles by mnemonic; None stands for one cycle and another one for each word of the register list.
COSTS: dict[str, int | None] = {}


def _same(cycles: int | None, names: str) -> None:
    COSTS.update(dict.fromkeys(names.split(), cycles))


_same(1, "mov movw movt mvn add addw adc sub subw sbc rsb neg cmp cmn tst teq and orr orn eor bic lsl lsr asr ror")
_same(
    1,
    "sxtb sxth uxtb uxth sxtb16 uxtb16 sxtab sxtah uxtab uxtah ubfx sbfx bfi bfc clz rbit rev rev16 revsh "
    "pkhbt pkhtb sel",
)
_same(1, "mul mla mls smull umull smlal umlal umaal smmul smmulr smmla smmlar smmls smmlsr")
_same(
    1,
    "smulbb smulbt smultb smultt smulwb smulwt smlabb smlabt smlatb smlatt smlawb smlawt smlalbb smlalbt "
    "smlaltb smlaltt",
)
_same(1, "smuad smuadx smusd smusdx smlad smladx smlsd smlsdx smlald smlaldx smlsld smlsldx")
_same(
    1,
    "ssat usat ssat16 usat16 qadd qsub qdadd qdsub qadd16 qsub16 qasx qsax sadd16 ssub16 shadd16 shsub16 "
    "sasx ssax uadd16 usub16 uadd8 usub8",
)
_same(DIVIDE, "sdiv udiv")
_same(2, "ldr ldrb ldrh ldrsb ldrsh ldrex ldrexb ldrexh str strb strh strex strexb strexh")
_same(3, "ldrd strd")
_same(None, "ldmia ldmdb stmia stmdb push pop vpush vpop vldmia vstmia vldmdb vstmdb")
# Branches: P is added when they are taken; a table branch reads first.
_same(1, "b bl bx blx cbz cbnz")
_same(2, "tbb tbh")
_same(1, "nop it dsb dmb")
_same(1 + PIPELINE, "isb")
_same(2, "mrs msr cpsid cpsie")
_same(1, "vadd vsub vmul vnmul vneg vabs vcmp vcmpe vcvt vcvtr vmov vmrs vmsr")
_same(3, "vmla vmls vnmla vnmls vfma vfms vfnma vfnms")
_same(14, "vdiv vsqrt")
_same(2, "vldr vstr")

DOUBLE = 1  # in addition, for a double register or for two words moved between the core and the floating-point unit


def base(mnemonic: str) -> tuple[str, bool]:
    """The instruction's name without condition and flag suffix, and whether it is conditional."""
    bare = mnemonic.partition(".")[0]
    if bare[:2] == "it" and set(bare[2:]) <= {"t", "e"}:
        return "it", False
    conditional = bare[-2:] in CONDITIONS
    for name, under in ((bare, False), (bare[:-2] if conditional else bare, conditional)):
        if name in COSTS:
            return name, under
    for name, under in ((bare, False), (bare[:-2] if conditional else bare, conditional)):
        if name.endswith("s") and name[:-1] in COSTS:
            return name[:-1], under
    raise FluxtrueError(f"no cycles are known for the instruction '{mnemonic}'")


def cycles(instruction: Instruction) -> int:
    """Cycles if the next instruction in memory follows; another one takes PIPELINE more."""
    name, _ = base(instruction.mnemonic)
    cost = COSTS[name]
    if cost is None:
        return 1 + words(instruction.operands)
    registers = instruction.operands.split(", ")
    if (name in ("vldr", "vstr") and registers[0].startswith("d")) or (name == "vmov" and len(registers) > 2):
        return cost + DOUBLE
    return cost


def image_costs(functions: Iterable[Function], regions: Sequence[tuple[int, int]]) -> bytes:
    """The cycles of each half word of the regions (start, bytes), one byte each, for the emulator's profile, which
    refuses other code."""
    costs = bytearray(sum(size for _, size in regions) // 2)
    for function in functions:
        for instruction in function.instructions:
            begin = 0
            for start, size in regions:
                if start <= instruction.address < start + size:
                    costs[(begin + instruction.address - start) // 2] = cycles(instruction)
                begin += size
    return bytes(costs)
