# SPDX-License-Identifier: Apache-2.0
"""The deepest stack of small programs, compared with hand calculation; planted violations are found."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from fluxtrue_tools.bench import disassembly, stack
from fluxtrue_tools.bench.build import ARM_CC, ARM_FLAGS

pytestmark = pytest.mark.skipif(not shutil.which(ARM_CC), reason="no Arm compiler")

HEAD = ".syntax unified\n.thumb\n.text\n"


def nodes(folder: Path, source: str, suffix: str = ".s") -> dict[str, stack.Node]:
    code = folder / f"a{suffix}"
    code.write_text((HEAD if suffix == ".s" else "") + source)
    link = ("-nostdlib", "-nostartfiles", "-Wl,-e,start,-Ttext=0x400,--unresolved-symbols=ignore-all")
    flags = (*ARM_FLAGS, "-O1", "-fno-inline", "-ffreestanding", *link)
    command = [ARM_CC, *flags, str(code), "-o", str(folder / "a.elf")]
    subprocess.run(command, check=True, capture_output=True)
    return stack.graph(disassembly.read(folder / "a.elf"))


def function(name: str, body: str) -> str:
    lines = "\n".join(f"    {line.strip()}" for line in body.split(";"))
    return f".global {name}\n.type {name}, %function\n.thumb_func\n{name}:\n{lines}\n"


def worst(found: dict[str, stack.Node], name: str, **pointers: list[str]) -> tuple[int, tuple[str, ...], list[str]]:
    depths = stack.Depths(found, pointers)
    deepest, path, _ = depths.worst(name)
    return deepest, path, depths.problems


def test_frames_add_up_along_the_deepest_path(tmp_path: Path) -> None:
    source = function("start", "push {r4, lr}; sub sp, #24; bl shallow; bl deep; add sp, #24; pop {r4, pc}")
    source += function("shallow", "push {r4, r5, r6, lr}; pop {r4, r5, r6, pc}")
    saved = "sp!, {r4, r5, r6, r7, r8"
    source += function("deep", f"stmdb {saved}, lr}}; vpush {{d8-d9}}; vpop {{d8-d9}}; ldmia {saved}, pc}}")
    # 8 + 24, then 24 + 16 below.
    assert worst(nodes(tmp_path, source), "start") == (72, ("start", "deep"), [])


def test_a_jump_to_the_constant_behind_it_is_followed(tmp_path: Path) -> None:
    """As the linker leads from the flash to code in the RAM."""
    source = function("start", "push {r4, lr}; bl far; pop {r4, pc}; .balign 4")
    source += function("far", "ldr.w pc, [pc]; .word deep") + function("deep", "sub sp, #64; add sp, #64; bx lr")
    assert worst(nodes(tmp_path, source), "start") == (72, ("start", "far", "deep"), [])


def test_a_call_counts_at_the_depth_it_is_made_at(tmp_path: Path) -> None:
    source = function("start", "push {lr}; bl deep; sub sp, #100; add sp, #100; pop {pc}")
    source += function("deep", "sub sp, #64; add sp, #64; bx lr")
    assert worst(nodes(tmp_path, source), "start")[0] == 104


def test_stores_to_where_the_stack_is_do_not_move_it(tmp_path: Path) -> None:
    body = "push {r4, lr}; sub sp, #16; stmia.w sp, {r0, r1}; str r0, [sp, #8]; "
    body += "strd r0, r1, [sp, #-8]!; ldrd r0, r1, [sp], #8"
    source = function("start", f"{body}; add sp, #16; pop {{r4, pc}}")
    assert worst(nodes(tmp_path, source), "start") == (32, ("start",), [])


def test_a_tail_call_has_the_callers_frame_no_more(tmp_path: Path) -> None:
    source = function("start", "push {r4, r5, r6, lr}; pop {r4, r5, r6, lr}; b.w last")
    source += function("last", "sub sp, #12; add sp, #12; bx lr")
    assert worst(nodes(tmp_path, source), "start")[0] == 16


def test_a_conditional_return_leaves_the_other_path_its_frame(tmp_path: Path) -> None:
    source = function("start", "push {r4, lr}; cmp r0, #0; it eq; popeq {r4, pc}; bl more; pop {r4, pc}")
    source += function("more", "sub sp, #40; add sp, #40; bx lr")
    assert worst(nodes(tmp_path, source), "start")[0] == 48


def test_what_only_a_table_of_jumps_reaches_is_followed(tmp_path: Path) -> None:
    body = "push {r4, lr}; tbb [pc, r0]; .byte 1, 2; nop; bl more; pop {r4, pc}"
    source = function("start", body) + function("more", "sub sp, #32; add sp, #32; bx lr")
    assert worst(nodes(tmp_path, source), "start")[0] == 40


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("int start(int n) { volatile int x = n; return n ? x + start(n - 1) : 0; }", "recursion: start > start"),
        ("int b(int); int a(int n) { return n ? 1 + b(n - 1) : 0; } int b(int n) { return n ? 2 + a(n - 2) : 1; }"
         "int start(int n) { return 3 + a(n); }", "recursion: a > b > a"),
        ("int start(int (*f)(void)) { return 1 + f(); }", "start: calls through a pointer"),
        ("int start(int (*f)(void)) { return f(); }", "start: calls through a pointer"),
        ("void use(int *); void use(int *x) { *x = 1; } int start(int n) { int x[n]; use(x); return x[0]; }",
         "start: stack not known"),
        ("int start(void) { __asm__ volatile(\"msr msp, r0\"); return 0; }", "sets the stack pointer"),
    ],
)  # fmt: skip
def test_what_makes_the_stack_unbounded_is_found(tmp_path: Path, source: str, message: str) -> None:
    problems = worst(nodes(tmp_path, source, ".c"), "start")[2]
    assert any(message in problem for problem in problems), problems


def test_a_listed_pointer_is_followed_and_a_wrong_list_is_an_error(tmp_path: Path) -> None:
    source = function("start", "push {r4, lr}; blx r3; pop {r4, pc}")
    source += function("by_pointer", "sub sp, #16; add sp, #16; bx lr")
    found = nodes(tmp_path, source)
    assert worst(found, "start", start=["by_pointer"]) == (24, ("start", "by_pointer"), [])
    assert "'missing'" in worst(found, "start", start=["missing"])[2][0]


def test_functions_of_a_heap_are_found() -> None:
    assert len(stack.heap(["main", "malloc", "_sbrk", "_free_r", "freeze", "calloc"])) == 4


def test_levels_add_the_frame_of_what_they_interrupt(tmp_path: Path) -> None:
    source = function("start", "push {r4, lr}; vadd.f32 s0, s0, s1; pop {r4, pc}")
    source += function("middle", "push {lr}; pop {pc}") + function("top", "sub sp, #8; add sp, #8; bx lr")
    depths = stack.Depths(nodes(tmp_path, source), {})
    wanted = [stack.Level(name, (name,)) for name in ("start", "middle", "top")]
    uses = stack.levels(depths, wanted)
    # An exception pushes 26 words above a context with floating point, 8 above one without, and one to align the stack.
    assert [(u.frame, u.stack) for u in uses] == [(0, 8), (108, 4), (36, 8)]
    assert depths.problems == []
    stack.levels(depths, [stack.Level("gone", ("vanished",))])
    assert "no function 'vanished'" in depths.problems[-1]
