# SPDX-License-Identifier: Apache-2.0
"""Worst-case execution times of small programs, compared with hand calculation; what is missing is named."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from fluxtrue_tools.bench.build import ARM_CC, ARM_FLAGS
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet import lines
from fluxtrue_tools.wcet.bound import CYCLES, INSTRUCTIONS, Cost, Handlers, Image
from fluxtrue_tools.wcet.facts import Facts, Passes

pytestmark = pytest.mark.skipif(not shutil.which(ARM_CC), reason="no Arm compiler")

HEAD = ".syntax unified\n.thumb\n.text\n"


def image(folder: Path, source: str, suffix: str = ".s") -> Image:
    code = folder / f"a{suffix}"
    code.write_text((HEAD if suffix == ".s" else "") + source)
    link = ("-nostdlib", "-nostartfiles", "-Wl,-e,start,-Ttext=0x400")
    flags = (*ARM_FLAGS, "-g", "-O1", "-fno-inline", "-ffreestanding", *link)
    command = [ARM_CC, *flags, str(code), "-o", str(folder / "a.elf")]
    subprocess.run(command, check=True, capture_output=True)
    return Image.read(folder / "a.elf")


def function(name: str, body: str) -> str:
    lines = "\n".join(f"    {line.strip()}" for line in body.split(";"))
    return f".global {name}\n.type {name}, %function\n.thumb_func\n{name}:\n{lines}\n"


def handlers(of: Image, loops: dict[str, int] | None = None, cost: Cost = INSTRUCTIONS, **more: list[str]) -> Handlers:
    known = {key: Passes(most) for key, most in (loops or {}).items()}
    return Handlers(of, "test", Facts(known, {}), more, cost)


def worst(of: Image, loops: dict[str, int] | None = None, **more: list[str]) -> int | None:
    found = handlers(of, loops, **more)
    result = found.worst("start")
    assert found.problems == set()
    return result


def test_the_longer_branch_counts(tmp_path: Path) -> None:
    body = "cmp r0, #0; beq 1f; adds r0, #1; adds r0, #1; adds r0, #1; bx lr; 1: adds r0, #2; bx lr"
    of = image(tmp_path, function("start", body))
    assert worst(of) == 6
    # CMP, BEQ, three ADDS and BX with its refilled pipeline: 6 + 3; the other way: 2 + 3 + 2 + 3.
    assert handlers(of, cost=CYCLES).worst("start") == 10


def test_skipped_instructions_of_an_it_block_count(tmp_path: Path) -> None:
    body = "cmp r0, #0; ite eq; moveq r0, #1; movne r0, #2; bx lr"
    assert worst(image(tmp_path, function("start", body))) == 5


def test_a_loop_counts_as_often_as_it_may_run(tmp_path: Path) -> None:
    body = "movs r1, #0; 1: adds r1, #1; cmp r1, r0; bne 1b; bx lr"
    of = image(tmp_path, function("start", body))
    line = of.lines.at(of.loops("start")[0].loop.header)
    assert line is not None
    assert worst(of, {f"start: {line.number}": 7}) == 1 + 7 * 3 + 1


def test_a_loop_that_tests_first_runs_its_test_once_more(tmp_path: Path) -> None:
    body = "1: cmp r0, #0; beq 2f; subs r0, #1; b 1b; 2: bx lr"
    assert worst(image(tmp_path, function("start", body)), {"start": 5}) == 5 * 4 + 2 + 1


def test_an_inner_loop_counts_for_each_pass_of_the_outer_one(tmp_path: Path) -> None:
    body = "1: movs r1, #9; 2: subs r1, #1; bne 2b; subs r0, #1; bne 1b; bx lr"
    of = image(tmp_path, function("start", body))
    inner, outer = sorted(of.loops("start"), key=lambda one: len(one.loop.blocks))
    keys = [of.lines.at(one.loop.header) for one in (inner, outer)]
    bounds = {f"start: {key.number}": most for key, most in zip(keys, (9, 3), strict=True) if key}
    assert worst(of, bounds) == 3 * (1 + 9 * 2 + 2) + 1


def test_each_way_of_a_jump_table_is_followed(tmp_path: Path) -> None:
    table = "tbb [pc, r0]; 9: .byte (1f - 9b)/2; .byte (2f - 9b)/2; .byte (3f - 9b)/2; .align 1"
    body = f"{table}; 1: bx lr; 2: nop; nop; nop; bx lr; 3: nop; bx lr"
    assert worst(image(tmp_path, function("start", body))) == 5


def test_calls_tail_calls_and_listed_pointers_cost_what_they_call(tmp_path: Path) -> None:
    source = function("start", "push {r4, lr}; bl small; blx r3; pop {r4, lr}; b.w large")
    source += function("small", "nop; bx lr") + function("large", "nop; nop; nop; bx lr")
    of = image(tmp_path, source)
    assert worst(of, start=["small", "large"]) == 5 + 2 + 4 + 4
    unlisted = handlers(of)
    unlisted.worst("start")
    assert unlisted.problems == {"start: a call through a pointer is not listed"}


def test_a_jump_to_the_constant_behind_it_is_followed(tmp_path: Path) -> None:
    """As the linker leads from the flash to code in the RAM."""
    source = function("start", "push {r4, lr}; bl far; pop {r4, pc}; .balign 4")
    source += function("far", "ldr.w pc, [pc]; .word large") + function("large", "nop; nop; nop; bx lr")
    assert worst(image(tmp_path, source)) == 2 + 1 + 4 + 1


def test_what_never_returns_is_on_no_path(tmp_path: Path) -> None:
    source = function("start", "cmp r0, #0; bne 1f; bx lr; 1: nop; nop; nop; bl halt") + function("halt", "1: b 1b")
    assert worst(image(tmp_path, source)) == 3


def test_a_loop_without_a_bound_is_named_with_its_line(tmp_path: Path) -> None:
    source = "int start(const int *x, int n)\n{\n    int s = 0;\n    for (int k = 0; k < n; k++) {\n"
    source += "        s += x[k];\n    }\n    return s;\n}\n"
    of = image(tmp_path, source, ".c")
    found = handlers(of)
    found.worst("start")
    assert found.problems == {"no bound for the loop of start, a.c:4: for (int k = 0; k < n; k++) {"}
    assert worst(of, {"start: for (int k": 10}) is not None


def test_a_loop_that_is_entered_in_two_places_is_refused(tmp_path: Path) -> None:
    body = "cmp r0, #0; beq 2f; 1: subs r1, #1; 2: subs r2, #1; bne 1b; bx lr"
    of = image(tmp_path, function("start", body))
    with pytest.raises(FluxtrueError, match=r"start: the loop at 0x.* can be entered at two places"):
        worst(of, {"start": 1})


def test_an_instruction_that_nothing_leads_to_is_refused(tmp_path: Path) -> None:
    of = image(tmp_path, function("start", "b 1f; adds r0, #1; 1: bx lr"))
    with pytest.raises(FluxtrueError, match=r"start: nothing leads to the instruction at 0x402"):
        worst(of)


def test_the_length_of_a_copy_is_its_constant(tmp_path: Path) -> None:
    source = function("start", "push {lr}; movs r2, #64; bl memset; pop {pc}")
    source += function("memset", "1: str r1, [r0], #4; subs r2, #4; bne 1b; bx lr")
    of = image(tmp_path, source)
    found = Handlers(of, "test", Facts({"memset": Passes(each_bytes=4)}, {}), {}, INSTRUCTIONS)
    assert found.worst("start") == 4 + 16 * 3 + 1
    assert found.problems == set()


def test_the_most_waiting_fetches_each_line_and_charges_each_access_by_its_memory(tmp_path: Path) -> None:
    # At 0x400, with twelve bytes ahead: BX at 0x404 is the first to reach the next line of 16 bytes.
    of = image(tmp_path, function("start", "nop; nop; bx lr"))
    assert of.waits("start").blocks == {0x400: 2 * 12}
    source = function(
        "start", "push {r4}; ldr r0, =0x40001234; ldr r1, [r0, #4]; ldr r2, [r1]; str r2, [r0]; pop {r4}; bx lr"
    )
    of = image(tmp_path, source)
    # Fetched are 14 bytes and 12 ahead, two lines. Stack 2 + 2, literal 1 + 2 * 12, peripheral 8, unknown 25, 8.
    stack = (1 + 1) + 1
    assert of.waits("start").blocks == {0x400: 2 * 12 + stack + 25 + 8 + 25 + 8}


def test_an_argument_points_into_the_memory_that_all_callers_pass(tmp_path: Path) -> None:
    source = function("start", "push {lr}; ldr r0, =0x40001234; bl both; ldr r0, =0x40002345; bl both; pop {pc}")
    source += ".ltorg\n" + function("both", "ldr r1, [r0]; bx lr")
    of = image(tmp_path, source)
    of.enter(["start"], {})
    fetched = of.waits("both")
    again = image(tmp_path, source)
    assert sum(again.waits("both").blocks.values()) - sum(fetched.blocks.values()) == 25 - 8


def test_of_several_lengths_of_a_copy_the_largest_counts(tmp_path: Path) -> None:
    source = function("start", "push {lr}; movs r2, #64; cmp r0, #0; it ne; movne r2, #32; bl memset; pop {pc}")
    source += function("memset", "1: str r1, [r0], #4; subs r2, #4; bne 1b; bx lr")
    found = Handlers(image(tmp_path, source), "test", Facts({"memset": Passes(each_bytes=4)}, {}), {}, INSTRUCTIONS)
    assert found.worst("start") == 7 + 16 * 3 + 1


def test_a_length_that_is_computed_must_be_annotated(tmp_path: Path) -> None:
    source = function("start", "push {lr}; movs r2, #64; adds r2, r0; bl memset; pop {pc}")
    source += function("memset", "1: str r1, [r0], #4; subs r2, #4; bne 1b; bx lr")
    found = Handlers(image(tmp_path, source), "test", Facts({"memset": Passes(each_bytes=4)}, {}), {}, INSTRUCTIONS)
    found.worst("start")
    assert any(problem.startswith("no length for the copy in") for problem in found.problems)


def test_the_loop_statements_of_a_source_are_found_with_their_extent() -> None:
    source = """static int first(int n)
{
    for (int k = 0; k < n; k++) { /* for (;;) */
        while (n > 3)
            n--;
    }
    return n;
}
static inline __attribute__((always_inline)) void second(int *x, int n)
{
    do {
        x[n] = 0;
    } while (n-- > 0);
}
"""
    found = [(s.function, s.first, s.last, s.head, s.text) for s in lines.statements("a.c", source)]
    assert found == [
        ("first", 3, 6, 3, "for (int k = 0; k < n; k++) { /* for (;;) */"),
        ("first", 4, 5, 4, "while (n > 3)"),
        ("second", 11, 13, 13, "} while (n-- > 0);"),
    ]
