# SPDX-License-Identifier: Apache-2.0
"""Conditions after every test: no fault, no error counted, no cyclic frame missing, reserve of stack and time.

A test that provokes errors declares them in rig.expected.faults, .counters, .load and .frames.
"""

from itertools import pairwise
from typing import Any

from rig import MS, Rig

from fluxtrue_tools import faults

FAULTS = (("INV_Faults", "DriveFaults"), ("INV_Faults", "EcuFaults"))
COUNTERS = {
    "INV_DiagProtection": ("CrcErrors", "Repeated", "Jumps", "LengthErrors"),
    "INV_DiagReceive": ("RangeErrors", "IdErrors", "TimeOuts"),
    "INV_DiagBus": ("LostFrames", "NotSent", "Ignored", "BusOff", "SkippedCommands"),
    "INV_DiagTask": ("IsrOverruns", "TaskOverruns", "WatchdogHeld"),
}
# Two frames of the ECU and one of another node may delay it, and a cycle is kept within a step: 3 x 0.27 ms + 1 ms.
JITTER_S = 2 * MS
JITTER_BENCH_S = 20 * MS  # time stamps of an adapter and of an operating system
STACK_RESERVE_BYTES = 256
LATE_S = 25 * MS  # longest time between two commands; beyond it a time-out of 30 ms is caused by this computer
DIAGNOSTICS_S = 0.12  # the cycle of the diagnostic messages and a margin


def note(rig: Rig) -> dict[str, Any]:
    """Record the counters before a test, because a bench keeps them from test to test."""
    rig.advance(DIAGNOSTICS_S)
    return {
        "counters": {(m, s): rig.signal(m, s) for m, signals in COUNTERS.items() for s in signals},
        "hub": rig.stand.counters() if rig.has_stand else {},
    }


def _counters(rig: Rig, before: dict[str, Any]) -> list[str]:
    found = []
    for (message, signal), was in before["counters"].items():
        now = rig.signal(message, signal)
        if now != was and signal not in rig.expected.counters:
            found.append(f"{message}.{signal} counted {now - was:g}")
    if found and rig.longest_gap_s > LATE_S:
        found.append(f"(this computer let {1e3 * rig.longest_gap_s:.0f} ms pass between two commands)")
    return found


def _faults(rig: Rig) -> list[str]:
    words = {signal: int(rig.signal(message, signal)) for message, signal in FAULTS}
    if rig.expected.faults:
        return []
    found = [f"{signal}: {', '.join(_named(f'INV_Faults.{signal}', word))}" for signal, word in words.items() if word]
    check = int(rig.signal("INV_Configuration", "MotorCheck")) if found else 0
    return [*found, *([f"motor data refused: {faults.refused_data(check)}"] if check else [])]


def _named(signal: str, word: int) -> list[str]:
    """The bits of a fault word by name."""
    known = faults.explained(signal)
    return [known[bit][0] if bit in known else f"bit {bit}" for bit in range(word.bit_length()) if word >> bit & 1]


def missed(rig: Rig, name: str, jitter_s: float) -> list[str]:
    """Gaps in a cyclic message."""
    times = [frame.time_s for frame in rig.frames[name]]
    cycle_s = rig.cycle_s(name)
    gaps = [b - a for a, b in pairwise(times)]
    bad = [gap for gap in gaps if abs(gap - cycle_s) > jitter_s]
    if not bad:
        return []
    return [f"{name}: {len(bad)} of {len(gaps)} periods are not {1e3 * cycle_s:g} ms, e.g. {1e3 * bad[0]:.2f} ms"]


def _frames(rig: Rig) -> list[str]:
    found = []
    jitter_s = JITTER_S if rig.has_stand else JITTER_BENCH_S
    for name, message in rig.by_name.items():
        if "INV" in message.senders and message.cycle_time:
            found += missed(rig, name, jitter_s)
    if rig.status_protection.wrong:
        found.append(f"{rig.status_protection.wrong} status frames with a wrong CRC or counter")
    return found


def _bus(rig: Rig, before: dict[str, Any]) -> list[str]:
    if not rig.has_stand:
        return []
    now = rig.stand.counters()
    found = [
        f"hub: {name} counted {now[name] - before['hub'][name]:g}"
        for name in ("malformed", "dropped", "ecu_lost", "bus_lost", "slow_clients", "bench_refused")
        if now[name] != before["hub"][name]
    ]
    if now["windows_over"] != before["hub"]["windows_over"]:
        found.append(f"bus load up to {100 * now['load_peak']:.0f} %, allowed 70 %")
    return found


def stack_unused(rig: Rig) -> int:
    """Bytes of stack never used since start-up; 0 on a target that cannot measure them, such as the virtual ECU."""
    return int(rig.signal("INV_DiagTask", "StackUnused"))


def problems(rig: Rig, before: dict[str, Any]) -> list[str]:
    """All violated conditions, in words."""
    rig.is_sending = True
    rig.advance(DIAGNOSTICS_S)
    found = _faults(rig) + _counters(rig, before)
    stack = stack_unused(rig)
    if 0 < stack < STACK_RESERVE_BYTES:
        found.append(f"{stack:g} bytes of stack were never used, wanted {STACK_RESERVE_BYTES}")
    if not rig.expected.frames:
        found += _frames(rig)
    if not rig.expected.load:
        found += _bus(rig, before)
    return found
