# SPDX-License-Identifier: Apache-2.0
"""How busy bus and processor are: from the DBC's cycle times, and from what the firmware costs on the emulated S32K144.

Source   ISO 11898-1: a frame of n data bytes has 47 + 8 n bits, between frames included, and at most (34 + 8 n - 1)/4
         stuff bits
"""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.motor.motor import Motor

PERFORMANCE: Final = Path(__file__).resolve().parents[3] / "docs" / "performance.json"
CLOCK_HZ: Final = 112e6
BUS_BITS_PER_S: Final = 500e3


def frame_bits(length: int) -> int:
    """The longest frame with an 11-bit identifier."""
    return 47 + 8 * length + (34 + 8 * length - 1) // 4


@cache
def bus_load(sender: str | None = None) -> float:
    """Share of the bus that all cyclic frames take at most, or those of one sender."""
    import cantools.database

    database: Any = cantools.database.load_file(DBC)
    cyclic = [m for m in database.messages if m.cycle_time and (sender is None or sender in m.senders)]
    return sum(frame_bits(m.length) / (1e-3 * m.cycle_time) for m in cyclic) / BUS_BITS_PER_S


@dataclass(frozen=True)
class Cycles:
    """Mean cycles of the emulated image with the robust identification."""

    fast_isr: float
    task: float


@cache
def cycles() -> Cycles | None:
    """As the bench has written them down; None in an installation without its results."""
    try:
        runs = json.loads(PERFORMANCE.read_text(encoding="utf-8"))["drives"]["robust"]["runs"]
    except OSError:
        return None
    return Cycles(runs["fast ISR"]["cycles"][1], runs["1 kHz task"]["cycles"][1])


def load_lines(motor: Motor) -> list[str]:
    """The report's lines."""
    lines = [
        f"bus load: at most {100 * bus_load():.1f} % of {BUS_BITS_PER_S / 1e3:g} kbit/s, "
        f"{100 * bus_load('INV'):.1f} % by the inverter's frames"
    ]
    used, pwm_hz = cycles(), motor.config.inverter.pwm_hz
    if used is None:
        return lines
    isr, task = used.fast_isr * pwm_hz / CLOCK_HZ, used.task / motor.bases.step_s / CLOCK_HZ
    lines += [
        f"processor load: {100 * (isr + task):.1f} % of an S32K144 at {CLOCK_HZ / 1e6:g} MHz (emulated cycles, without "
        "the wait states of its flash)",
        f"  fast ISR           {100 * isr:.1f} % at {pwm_hz:g} Hz",
        f"  1 kHz task         {100 * task:.1f} % at {1.0 / motor.bases.step_s:.4g} Hz",
    ]
    if motor.config.is_turning:
        lines.append("  note               the usual current control; the one for a field that turns far takes longer")
    return lines
