# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md from the figures: every number of the page is measured or a named peer's."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fluxtrue_tools.bench import cycles
from fluxtrue_tools.bench.drive import TITLES
from fluxtrue_tools.bench.peers import LOOPS
from fluxtrue_tools.bench.sizes import STATE

Figures = dict[str, Any]
CODE_MOST, STATE_MOST, FLASH_MOST, RAM_MOST = 12288, 1536, 65536, 12288
UTILISATION_MOST = 10.0
STACK_MOST = 0.5
# Bounds of a kernel: average and most; None: none is set.
BOUNDS: dict[str, tuple[float | None, float | None]] = {
    "current_tick": (180, 220), "current_core": (120, None), "flux_table": (70, 70), "mrai": (100, None),
    "torque_path": (40, None),
}  # fmt: skip
CONTAINS = {
    "current_tick": "converter counts and angle → compare values: offset and gain, Clarke, sum of the phases, angle tracker, sincos, Park, "
    "2 PI, decoupling from the flux tables, voltage limiter, dead-time compensation, dc-voltage normalisation, angle advance, SVPWM, all saturations",
    "current_core": "what the leanest peer's tick has: sincos, Clarke, Park, 2 PI, inverse Park, clamp, SVPWM",
    "flux_table": "i_d, i_q → both flux linkages, their slopes and cross terms",
    "mrai": "the paper's identification, one period",
    "torque_estimate": "torque from currents, tables and identified flux, and its mean",
    "torque_path": "torque estimate and one step of the torque loop",
    "fast_isr": "the interrupt on a hardware interface of variables",
}
WHOLE_MOST = 400
WORDS_OF_TASK = "1 kHz task"


def verdict(met: bool) -> str:
    return "met" if met else "**missed**"


def table(head: str, rows: Iterable[Iterable[object]]) -> list[str]:
    """A Markdown table; numbers to the right."""
    titles = head.split("|")
    lines = ["| " + " | ".join(t.strip() for t in titles) + " |"]
    lines.append("|" + "|".join("--:" if t.endswith(" ") and t.startswith("  ") else "---" for t in titles) + "|")
    lines += ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]
    return [*lines, ""]


def _bound(name: str, spread: list[float]) -> tuple[str, str]:
    average, most = BOUNDS.get(name, (None, None))
    parts = [f"avg ≤ {average}"] if average else []
    parts += [f"max ≤ {most}"] if most else []
    if not parts:
        return "", ""
    met = (average is None or spread[1] <= average) and (most is None or spread[2] <= most)
    return ", ".join(parts), verdict(met)


def _interrupts(figures: Figures) -> list[str]:
    rows = []
    for mode, drive in figures["drives"].items():
        for name, run in drive["runs"].items():
            whole = name == "10 kHz work"
            bound = f"avg ≤ {WHOLE_MOST}" if whole else ""
            met = verdict(run["instructions"][1] <= WHOLE_MOST) if whole else ""
            title = f"**{name}: fast + MRAI ISR, HAL included**" if whole else name
            rows.append((mode, title, run["runs"], *run["instructions"], *run["cycles"], bound, met))
    return table("identification|interrupt|  runs |  min |  avg |  max |  cycles min |  avg |  max |bound|", rows)


def _kernels(figures: Figures) -> list[str]:
    rows = []
    for name, spread in figures["kernels"]["stages"].items():
        if name in ("both", "tick"):
            continue
        rows.append((TITLES.get(name, name), CONTAINS.get(name, ""), *spread, *_bound(name, spread)))
    return table("kernel|contains|  min |  avg |  max |bound|", rows)


def _peers(figures: Figures) -> list[str]:
    tick = figures["kernels"]["stages"]["current_tick"]
    ours = [("**Fluxtrue, current control**", CONTAINS["current_tick"] + "; fixed", tick[1], tick[2])]
    both = figures["kernels"]["stages"].get("current_core")
    if both:
        ours.append(("**Fluxtrue, the leanest peer's subset**", CONTAINS["current_core"] + "; fixed", both[1], both[2]))
    ours += [(p.source, p.content, p.average, p.maximum) for p in LOOPS]
    return table("control tick|contains|  avg |  max ", sorted(ours, key=lambda row: float(row[2])))


def _memory(figures: Figures) -> list[str]:
    image, library = figures["image"], figures["control library"]
    state = sum(figures["state"][name] for name in STATE)
    code = library["code"] + library["constants"]
    rows = [
        ("image, flash", image["flash"], FLASH_MOST, verdict(image["flash"] <= FLASH_MOST)),
        ("image, RAM with the stack", image["RAM"], RAM_MOST, verdict(image["RAM"] <= RAM_MOST)),
        ("control library (`fx`, `signal`, `control`), flash without tables", code, CODE_MOST, verdict(code <= CODE_MOST)),
        ("control library, RAM: state of a drive", state, STATE_MOST, verdict(state <= STATE_MOST)),
    ]
    lines = table("| bytes | bound |".strip("|").join(["what|", "|"]), rows)
    lines += [
        f"The library is compiled by itself for this row (-O2, nothing inlined across files, every function kept); its tables of functions take another {library['tables']} bytes. "
        f"The drive also keeps a copy of the motor's data that calibration may change ({figures['state']['motor']} bytes).",
        "",
        "By module, in the image; a function that the optimiser has compiled into another one counts with that one (the stages of a period are part of `app` and `hal`):",
        "",
    ]
    rows2 = [(name, *(b or "" for b in both)) for name, both in figures["modules"].items() if any(both)]
    return lines + table("module|  flash |  RAM ", rows2)


def _stack(figures: Figures) -> list[str]:
    found, reserved = figures["stack"], figures["image"]["stack reserved"]
    rows = [(x["level"], x["frame"] or "", x["stack"], " → ".join(f"`{f}`" for f in x["path"])) for x in found["levels"]]
    share = found["total"] / reserved
    lines = table("priority, lowest first|  exception frame |  stack |deepest path", rows)
    return [
        *lines,
        f"Sum, every priority preempted at its deepest point by the next: **{found['total']} of {reserved} bytes, {100 * share:.0f} %** "
        f"(bound 50 %: {verdict(share <= STACK_MOST)}). The emulated drive touched {found['seen in emulation']}.",
    ]


def _utilisation(figures: Figures) -> list[str]:
    rows = []
    for mode, share in figures["utilisation"].items():
        average = share["10 kHz work, average"]
        rows.append((mode, f"{average} %", f"{share['10 kHz work, most']} %", f"≤ {UTILISATION_MOST:g} %",
                     verdict(average <= UTILISATION_MOST), f"{share['with task and CAN, average']} %",
                     f"{share['highest PWM frequency at 50 %'] / 1000:.1f} kHz"))  # fmt: skip
    return table("identification|  ISRs, average |  ISRs, most |bound of the average||  with task and CAN |  highest PWM frequency at 50 %", rows)


def page(figures: Figures) -> str:
    """The whole document."""
    met = figures["drives"]["robust"]["met"]
    head = [
        "# What it costs",
        "",
        "Written by `tools/fluxtrue bench --update`; `tools/fluxtrue bench --check` (test `target-performance`) measures everything again and compares it exactly with `performance.json`.",
        "",
        f"Compiler: `{figures['compiler']}`, `-O2`, optimised across files; what runs at 1 kHz `-Os`. Another compiler gives other figures: the comparison is then left out, and says so.",
        "",
        "**Emulation, not silicon.** Instructions are counted, one by one, on an emulated Cortex-M4; instructions skipped in an IT block count. Cycles are an **estimate**: the sum of what the "
        f"Cortex-M4 Technical Reference Manual (Arm DDI 0439) says of each executed instruction, at the expensive end of every span: pipeline refill {cycles.PIPELINE}, "
        f"division {cycles.DIVIDE}, no overlap of loads and stores; {cycles.ENTRY} + {cycles.RETURN} for exception entry and return. "
        "**Not included: wait states of the flash** (28 MHz behind a 112 MHz core; prefetch and the code cache hide an unknown part) **and of the peripheral bridges.**",
        "",
        "## The image",
        "",
        "`fluxtrue.elf` for the S32K144 as it would be flashed (hsm1, encoder), in closed loop with the simulated drive; commanded over CAN. Torque of both signs at 3000 rpm, up to the torque limit, "
        f"8000 rpm in field weakening, falling dc voltage: {met['periods']} periods per identification, {met['voltage limited']} of them voltage limited, {met['field weakening']} with i_d below −100 A, "
        f"{met['beyond the tables']} beyond the tables' edge (robust). An interrupt is not charged with what interrupts it.",
        "",
        "Instructions, then estimated cycles with exception entry and return:",
        "",
    ]
    middle = [
        "## Share of the processor",
        "",
        "Estimated, 112 MHz, PWM 10 kHz; the ISRs are the 10 kHz work, both interrupts with entry and return. At the highest PWM frequency ISRs, task and CAN together take half of the processor.",
        "",
    ]
    kernels = [
        "## Stages as functions of their own",
        "",
        f"The same sources in a program of their own, -O2 across files, {figures['kernels']['periods']} periods with a map machine, {figures['kernels']['limited']} of them voltage limited "
        "(torque steps at 3000 rpm, run-up to 6500 rpm). The call's return is left out, saving registers is not.",
        "",
    ]
    peers = [
        "## Beside others",
        "",
        "Control ticks of other projects, measured by us in the same way: gcc 12.2, Cortex-M4 hard float, emulated, 1000 ticks in closed loop, the commit named, compiled with the project's own options or -O2. "
        "The contents differ; none of them identifies anything or looks up flux tables.",
        "",
    ]
    stack = [
        "## Stack",
        "",
        "From the instructions of the linked image, because across-file optimisation leaves no call graph of the sources that holds: along all paths of each function with the movements of the stack pointer, "
        "calls, tail calls and tables of jumps. Calls through pointers are resolved by the list in `hal/s32k144/budget.toml`; one that is not listed, recursion, a stack of unknown size or a function of a heap "
        "is an error of the bench. Exception frames: 26 words where the interrupted priority uses the floating-point unit's registers, else 8, one more for alignment.",
        "",
    ]
    parts = [
        head, _interrupts(figures), middle, _utilisation(figures), kernels, _kernels(figures), peers, _peers(figures),
        ["## Flash and RAM", ""], _memory(figures), stack, _stack(figures),
    ]  # fmt: skip
    return "\n".join(line for part in parts for line in part).rstrip() + "\n"
