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
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.loop_report import law_of
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
    turning: float | None  # what the fast ISR takes longer with the law for a field that turns far
    task: float

    def of_fast_isr(self, motor: Motor) -> float:
        """The load of the fast ISR with the motor's law of current control."""
        if not motor.config.is_turning:
            return self.fast_isr
        if self.turning is None:
            raise FluxtrueError(
                f"{PERFORMANCE}: kernels, laws: the cycles of {law_of(motor)} are missing, from which the processor "
                "load follows; write them with: tools/fluxtrue bench --update"
            )
        return self.fast_isr + self.turning


@cache
def cycles() -> Cycles | None:
    """As the bench has written them down; None in an installation without its results."""
    try:
        figures = json.loads(PERFORMANCE.read_text(encoding="utf-8"))
    except OSError:
        return None
    runs, laws = figures["drives"]["robust"]["runs"], figures["kernels"].get("laws")
    turning = laws["turning"]["cycles"][1] - laws["usual"]["cycles"][1] if laws else None
    return Cycles(runs["fast ISR"]["cycles"][1], turning, runs["1 kHz task"]["cycles"][1])


def load_lines(motor: Motor) -> list[str]:
    """The report's lines."""
    lines = [
        f"bus load: at most {100 * bus_load():.1f} % of {BUS_BITS_PER_S / 1e3:g} kbit/s, "
        f"{100 * bus_load('INV'):.1f} % by the inverter's frames"
    ]
    used, pwm_hz = cycles(), motor.config.inverter.pwm_hz
    if used is None:
        return lines
    isr, task = used.of_fast_isr(motor) * pwm_hz / CLOCK_HZ, used.task / motor.bases.step_s / CLOCK_HZ
    lines += [
        f"processor load: {100 * (isr + task):.1f} % of an S32K144 at {CLOCK_HZ / 1e6:g} MHz (emulated cycles, without "
        "the wait states of its flash)",
        f"  fast ISR           {100 * isr:.1f} % at {pwm_hz:g} Hz, with {law_of(motor)}",
        f"  1 kHz task         {100 * task:.1f} % at {1.0 / motor.bases.step_s:.4g} Hz",
    ]
    return lines
