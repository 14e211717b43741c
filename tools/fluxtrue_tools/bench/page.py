# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md from the figures: every number of the page is measured or a named peer's."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from pathlib import Path
from string import Template
from typing import Any

from fluxtrue_tools.bench import cycles, memory
from fluxtrue_tools.bench.build import SMALL
from fluxtrue_tools.bench.drive import PERIODS, TASK_TITLES, TITLES, WARM_UP
from fluxtrue_tools.bench.figures import budget
from fluxtrue_tools.bench.peers import LOOPS
from fluxtrue_tools.bench.sizes import STATE

Figures = dict[str, Any]
TASK_PERIODS = 10
COLUMNS = 120
CODE_MAX, STATE_MAX = 11776, 1792
FLASH_MAX, RAM_MAX, RAM_CODE_MAX = (budget()[bound] for bound in ("flash_bytes", "ram_bytes", "ram_code_bytes"))
UTILISATION_MAX = 10.0
STACK_MAX = 0.5
# Bounds of a kernel, average and maximum; None where there is no bound.
BOUNDS: dict[str, tuple[float | None, float | None]] = {
    "current_tick": (160, 214), "current_core": (120, None), "flux_table": (70, 70), "mrai": (100, None),
    "torque_path": (40, None),
}  # fmt: skip
CONTAINS = {
    "current_tick_tables": "from converter counts and angle to duties: offset and gain, Clarke, angle tracker, sincos, "
    "Park, look-up of both fluxes, two PI controllers, decoupling with those fluxes, voltage limiter, dead-time "
    "compensation, dc-voltage normalisation, angle advance, SVPWM, all saturations",
    "current_tick": "the same with the fluxes already found: the look-up, which is the row *flux tables*, runs before "
    "the counted region. The bounds were set for this row",
    "current_core": "what the tick of the leanest peer has: sincos, Clarke, Park, two PI controllers, inverse Park, "
    "clamp, SVPWM. These are the firmware's stages with the rest switched off at compile time",
    "measure": "offset and gain of four converter counts, Clarke, sum of the phases",
    "angle_tracker": "from angle to angle, speed and step",
    "current_control": "two PI controllers, decoupling, dc-voltage normalisation, voltage limiter",
    "modulate": "sincos, inverse Park, dead-time compensation, SVPWM, shortest pulses",
    "flux_table": "from i_d and i_q to both flux linkages, their slopes and cross terms",
    "window": "currents, voltages, fluxes and angle are added to the window of the robust identification; in every "
    "tenth period the window is handed over",
    "mrai": "the paper's identification, one period",
    "torque_estimate": "torque from currents, tables and identified flux, and its mean",
    "torque_path": "torque estimate and one step of the torque loop; in the drive only every tenth period has one",
    "fast_isr": "the interrupt on a hardware interface made of variables",
    "mrai_isr_paper": "MRAI, torque estimate, exchange",
    "task": "the drive's 1 kHz task without the bus",
}
TASK_CONTAINS = {
    "identify": "from the window to the operating point, tables and slopes there, torque and the rows of the robust "
    "identification; in every tenth step the update of the filter",
    "trim": "from the identified voltage error to the dead-time compensation",
    "angle_harmonics": "errors of the encoder once and twice per turn; one part of its table per step",
    "slow_monitors": "phases, sensors, current control, speed, angle offset, temperatures, torque",
    "torque_limit": "from the requested torque to the torque that reach, battery power, dc voltage, speed and "
    "temperatures allow",
    "torque_loop": "slew, one step of the torque loop",
    "reference": "from torque, speed and dc voltage to i_d and i_q (MTPA, field weakening), with the voltage that the "
    "limiter has left and the demagnetisation limit, plus the current of the iron loss",
    "target": "flux tables at the reference, set point of the current control, hand-over",
    "safe_state": "which safe state a fault would need now",
    "schedule": "gains and gates of the paper's identification, hand-over; with the paper's identification only",
    "supervisor": "state machine while torque is made",
    "arbitrate": "limits, dead band, slew and jerk of the torque that the bus requests",
    "second_level": "permitted torque, torque from the currents by its own table, comparison",
    "second_level_frame": "its own check and decoding of a torque command, which comes every 10 ms",
}
# Instructions of the fast ISR on average: what is demanded of the image with the resolver, and what the encoder's may
# not exceed again.
RESOLVER_MAX, ENCODER_MAX, WHOLE_MAX = 345, 360, 400
# Of a step of the second level: at 10 kHz 60 for each PWM period.
TASK_BOUNDS: dict[str, tuple[float | None, float | None]] = {"second_level": (None, 600)}
TASK_AVERAGE, TASK_MAXIMUM = 4000, 7000  # instructions with the robust identification
SHARE_MAX = 40
TEMPLATE = Path(__file__).with_name("performance.md.in")


def verdict(met: bool) -> str:
    return "met" if met else "**missed**"


def table(head: str, rows: Iterable[Iterable[object]]) -> list[str]:
    """A Markdown table; numbers to the right."""
    titles = head.split("|")
    lines = ["| " + " | ".join(t.strip() for t in titles) + " |"]
    lines.append("|" + "|".join("--:" if t.endswith(" ") and t.startswith("  ") else "---" for t in titles) + "|")
    lines += ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]
    return [*lines, ""]


def _wrapped(line: str) -> str:
    """A line of prose at the width of the other pages; rows of tables and headings as they are."""
    if line.startswith(("|", "#")) or not line:
        return line
    indent = "  " if line.startswith("- ") else ""
    return textwrap.fill(line, COLUMNS, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def _within(spread: list[float], average: float | None, maximum: float | None) -> str:
    """The text of both bounds, each met or missed."""
    parts = [f"avg ≤ {average} {verdict(spread[1] <= average)}"] if average is not None else []
    parts += [f"max ≤ {maximum} {verdict(spread[2] <= maximum)}"] if maximum is not None else []
    return ", ".join(parts)


def _interrupts(figures: Figures) -> list[str]:
    rows = []
    for mode, drive in figures["drives"].items():
        for name, run in drive["runs"].items():
            whole = name == "10 kHz work"
            bound = _within(run["instructions"], WHOLE_MAX if whole else None, None)
            if name == "fast ISR":
                bound = "no regression: " + _within(run["instructions"], ENCODER_MAX, None)
            if (name, mode) == ("1 kHz task", "robust"):
                bound = _within(run["instructions"], TASK_AVERAGE, TASK_MAXIMUM)
            title = f"**{name}: fast + MRAI ISR, HAL included**" if whole else name
            rows.append((mode, title, run["runs"], *run["instructions"], *run["cycles"], bound))
    return table("identification|interrupt|  runs |  min |  avg |  max |  cycles min |  avg |  max |bound", rows)


SENSORS = {"encoder": "incremental encoder with index", "resolver": "**resolver, AD2S1210**",
           "as5047": "absolute encoder, AS5047P", "sincos": "sine and cosine at the converters",
           "windings": "resolver at the converters"}  # fmt: skip


def _sensors(figures: Figures) -> list[str]:
    """The fast ISR by angle sensor and identification; the resolver's has the demanded bounds."""
    encoder = {mode: drive["runs"] for mode, drive in figures["drives"].items()}
    images = {"encoder": encoder} | {angle: sensor["runs"] for angle, sensor in figures["sensors"].items()}
    rows = []
    for angle, title in SENSORS.items():
        for mode, runs in images[angle].items():
            run, bound = runs["fast ISR"], ""
            if angle == "resolver":
                bound = _within(run["instructions"], RESOLVER_MAX, None)
            if (angle, mode) == ("resolver", "robust"):
                bound += "; most waiting: " + _within(run["most"], MOST_AVERAGE, MOST_MAXIMUM)
            rows.append((title, mode, *run["instructions"], *run["cycles"][1:], *run["most"][1:], bound))
    head = "angle sensor|identification|  min |  avg |  max |  cycles avg |  max |  most waiting avg |  max "
    return table(head + "|bound of the image with the resolver", rows)


def _sensor_bounds(figures: Figures) -> list[str]:
    """The fast ISR of each sensor's image: what was executed at most, and the upper bound."""
    drives = figures["drives"], figures["worst case"]["bounds"]["driving"]
    images = {"encoder": ({name: drive["runs"] for name, drive in drives[0].items()}, drives[1])}
    images |= {angle: (sensor["runs"], sensor["bounds"]) for angle, sensor in figures["sensors"].items()}
    rows = []
    for angle, title in SENSORS.items():
        runs, bounds = images[angle]
        row: list[object] = [title]
        for column in ("instructions", "cycles", "most"):
            row += [max(run["fast ISR"][column][2] for run in runs.values()), bounds["fast ISR"][column]]
        rows.append(row)
    head = "angle sensor|  instructions executed |  bound |  cycles executed |  bound |"
    return table(head + "  most waiting, executed |  bound ", rows)


def _sensor_shares(figures: Figures) -> str:
    """The processor's load with the resolver beside the encoder's, in a sentence."""
    name = "with task and CAN, average"
    ours, other = figures["sensors"]["resolver"]["utilisation"], figures["utilisation"]["robust"]
    parts = (f"{ours[column][name]:.1f} % in place of {other[column][name]:.1f} % ({title})"
             for column, title in ESTIMATES.items())  # fmt: skip
    begin = "With the AD2S1210 and the robust identification, ISRs, task and CAN take this share of the processor"
    return f"{begin}: {', '.join(parts)}"


def _kernels(figures: Figures) -> list[str]:
    rows = []
    for name, spread in figures["kernels"]["stages"].items():
        if name in ("both", "tick"):
            continue
        rows.append((TITLES.get(name, name), *spread, _within(spread, *BOUNDS.get(name, (None, None)))))
    return table("kernel|  min |  avg |  max |bound", rows)


LAWS = {"usual": "current_control.c, hsm1 at 10 kHz", "turning": "current_control_turning.c, hsm1 at 5 kHz"}


def _laws(figures: Figures) -> list[str]:
    """The fast ISR by the law of current control."""
    laws = figures["kernels"]["laws"]
    rows = ((title, *laws[name]["instructions"], *laws[name]["cycles"]) for name, title in LAWS.items())
    return table("law of current control|  min |  avg |  max |  cycles min |  avg |  max ", rows)


def _contents(rows: Iterable[str], titles: dict[str, str], contains: dict[str, str]) -> list[str]:
    """What the rows of a table stand for, as a list below it."""
    return [*(f"- *{titles.get(name, name)}*: {contains[name]}." for name in rows if name in contains), ""]


def _task_stages(figures: Figures) -> list[str]:
    stages = figures["kernels"]["task stages"]
    rows = ((TASK_TITLES[name], *spread, _within(spread, *TASK_BOUNDS.get(name, (None, None))))
            for name, spread in stages.items())  # fmt: skip
    return table("stage|  min |  avg |  max |bound", rows)


def _peers(figures: Figures) -> list[str]:
    stages = figures["kernels"]["stages"]
    tick, core = stages["current_tick_tables"], stages["current_core"]
    ours = [
        ("**Fluxtrue, current control with its flux tables**", f"fixed: *{TITLES['current_tick_tables']}*",
         tick[1], tick[2]),
        ("**Fluxtrue, the leanest peer's subset**", f"fixed: *{TITLES['current_core']}*", core[1], core[2]),
    ]  # fmt: skip
    ours += [(p.source, p.content, p.average, p.maximum) for p in LOOPS]
    return table("control tick|contains|  avg |  max ", sorted(ours, key=lambda row: float(row[2])))


def _memory(figures: Figures) -> list[str]:
    image, library = figures["image"], figures["control library"]
    state = sum(figures["state"][name] for name in STATE)
    rows = [
        ("image, flash", image["flash"], FLASH_MAX),
        ("image, RAM with the stack", image["RAM"], RAM_MAX),
        ("image, code that is copied to the RAM", image["code in RAM"], RAM_CODE_MAX),
        ("control library (`fx`, `signal`, `control`), flash without tables",
         library["code"] + library["constants"], CODE_MAX),
        ("control library, RAM: state of a drive, without the scope's history", state, STATE_MAX),
    ]  # fmt: skip
    return table("what|  bytes |  bound |", ((*row, verdict(row[1] <= row[2])) for row in rows))


def _modules(figures: Figures) -> list[str]:
    rows = ((name, *(b or "" for b in both)) for name, both in figures["modules"].items() if any(both))
    return table("module|  flash |  RAM ", rows)


def _call_path(names: list[str]) -> str:
    """Without its middle if it is too long for a cell."""
    shown = " → ".join(names)
    return shown if len(shown) <= COLUMNS else " → ".join([*names[:2], "…", *names[-4:]])


def _stack(figures: Figures) -> list[str]:
    rows = ((x["level"], x["frame"] or "", x["stack"], f"`{_call_path(x['path'])}`")
            for x in figures["stack"]["levels"])  # fmt: skip
    return table("priority, lowest first|  exception frame |  stack |deepest path", rows)


def _stack_sum(figures: Figures) -> str:
    found, reserved = figures["stack"], figures["image"]["stack reserved"]
    share = found["total"] / reserved
    return (
        f"Sum, every priority preempted at its deepest point by the next: **{found['total']} of {reserved} bytes, "
        f"{100 * share:.0f} %** (bound 50 %: {verdict(share <= STACK_MAX)}). "
        f"The emulated drive touched {found['seen in emulation']}."
    )


ESTIMATES = {"cycles": "manual", "least": "least waiting", "most": "most waiting"}
# Of the most waiting, robust identification: fast ISR, average and maximum; share with task and CAN; PWM in Hz.
MOST_AVERAGE, MOST_MAXIMUM, MOST_SHARE, MOST_PWM_HZ = 760, 900, 14.0, 45_000


def _waiting(figures: Figures) -> list[str]:
    """Cycles of each interrupt by the three estimates."""
    rows = []
    for mode, drive in figures["drives"].items():
        for name, run in drive["runs"].items():
            spreads = [value for column in ESTIMATES for value in run[column][1:]]
            bound = ""
            if (name, mode) == ("fast ISR", "robust"):
                bound = _within(run["most"], MOST_AVERAGE, MOST_MAXIMUM)
            title = "fast + MRAI ISR" if name == "10 kHz work" else name
            rows.append((mode, title, *spreads, bound))
    head = "identification|interrupt|  manual avg |  max |  least avg |  max |  most avg |  max |bound of the most"
    return table(head, rows)


def _worst(figures: Figures) -> list[str]:
    """What each handler executed at most, and the bounds of both modes of operation."""
    rows = []
    bounds = figures["worst case"]["bounds"]
    for title in bounds["driving"]:
        row: list[object] = [title]
        for column in ("instructions", *ESTIMATES):
            if column == "least":
                continue
            seen = [drive["runs"][title][column][2] for drive in figures["drives"].values() if title in drive["runs"]]
            row += [max(seen, default=""), *(f"{bounds[mode][title][column]}" for mode in ("driving", "anything"))]
        rows.append(row)
    head = "interrupt|  instructions executed |  driving |  anything |  cycles executed |  driving |  anything |"
    return table(head + "  most waiting, executed |  driving |  anything ", rows)


LIMITS_US = {"fast ISR": 100, "1 kHz task": 1000}  # a PWM period, a step


def _ends_in_time(figures: Figures) -> str:
    """Whether each handler ends before it is due again, by its own bound in the mode driving."""
    bounds, core_mhz = figures["worst case"]["bounds"]["driving"], budget()["core_Hz"] / 1e6
    parts = []
    for title, limit in LIMITS_US.items():
        times = {name: bounds[title][column] / core_mhz for column, name in ESTIMATES.items() if column != "least"}
        shown = " and ".join(f"{time:.0f} µs ({name}: {'within' if time <= limit else '**beyond**'})"
                             for name, time in times.items())  # fmt: skip
        parts.append(f"the {title} takes at most {shown} of its {limit} µs")
    return "; ".join(parts)


def _goal(mode: str, column: str, share: dict[str, float]) -> str:
    """The verdicts that stand beside the most waiting."""
    if (mode, column) != ("robust", "most"):
        return ""
    together, frequency = share["with task and CAN, average"], share["highest PWM frequency at 50 %"]
    return (f"together ≤ {MOST_SHARE:g} % {verdict(together <= MOST_SHARE)}, "
            f"≥ {MOST_PWM_HZ // 1000} kHz {verdict(frequency >= MOST_PWM_HZ)}")  # fmt: skip


def _utilisation(figures: Figures) -> list[str]:
    rows = []
    for mode, estimates in figures["utilisation"].items():
        for column, share in estimates.items():
            average = share["10 kHz work, average"]
            bounds = [f"average ≤ {UTILISATION_MAX:g} % {verdict(average <= UTILISATION_MAX)}"]
            bounds += filter(None, [_goal(mode, column, share)])
            rows.append((mode, ESTIMATES[column], f"{average} %", f"{share['10 kHz work, maximum']} %",
                         f"{share['with task and CAN, average']} %",
                         f"{share['highest PWM frequency at 50 %'] / 1000:.1f} kHz", ", ".join(bounds)))  # fmt: skip
    head = "identification|estimate|  ISRs, average |  ISRs, maximum |  with task and CAN |"
    return table(head + "  highest PWM frequency at 50 % |bounds", rows)


def _assumptions() -> list[str]:
    rows = table("memory|least|most|origin", (row[:4] for row in memory.ASSUMPTIONS))
    return [*rows, "Sources:", "", *(f"- *{row[0]}*: {row[4]}." for row in memory.ASSUMPTIONS), ""]


def _torque_share(stages: dict[str, list[float]]) -> float:
    """Instructions of a period: each has an estimate, every tenth a step of the loop."""
    estimate, path = stages["torque_estimate"][1], stages["torque_path"][1]
    return round(estimate + (path - estimate) / 10, 1)


def page(figures: Figures) -> str:
    """The whole document."""
    met, kernels = figures["drives"]["robust"]["met"], figures["kernels"]
    stages = kernels["stages"]
    share = _torque_share(stages)
    tables: dict[str, list[str]] = {
        "kernel_contents": _contents(stages, TITLES, CONTAINS),
        "task_contents": _contents(kernels["task stages"], TASK_TITLES, TASK_CONTAINS),
        "waiting": _waiting(figures), "worst": _worst(figures), "assumptions": _assumptions(),
        "interrupts": _interrupts(figures), "utilisation": _utilisation(figures), "kernels": _kernels(figures),
        "sensors": _sensors(figures), "sensor_bounds": _sensor_bounds(figures),
        "laws": _laws(figures), "task_stages": _task_stages(figures),
        "peers": _peers(figures), "memory": _memory(figures), "modules": _modules(figures), "stack": _stack(figures),
    }  # fmt: skip
    text = Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        {name: "\n".join(lines) for name, lines in tables.items()},
        compiler=figures["compiler"], pipeline=cycles.PIPELINE, divide=cycles.DIVIDE, entry=cycles.ENTRY,
        periods=met["periods"], limited=met["voltage limited"], weakened=met["field weakening"],
        clamped=met["beyond the tables"], reacting=met["reacting"], kernel_periods=kernels["periods"],
        kernel_limited=kernels["limited"],
        task_steps=(PERIODS - WARM_UP) // TASK_PERIODS,
        small=" ".join(SMALL), tables=figures["control library"]["tables"], period_copy=figures["state"]["period"],
        # An image without the paper's law has none of its parameters.
        parameters=figures["state"]["parameters"] + figures["state"].get("mrai_parameters", 0),
        loops=figures["worst case"]["loops"], loops_entered=figures["worst case"]["loops entered"],
        in_time=_ends_in_time(figures),
        sensor_shares=_sensor_shares(figures), stack_sum=_stack_sum(figures),
        torque_share=share, torque_share_verdict=verdict(share <= SHARE_MAX),
        **{"return": cycles.RETURN},
    )  # fmt: skip
    return "\n".join(_wrapped(line) for line in text.split("\n"))
