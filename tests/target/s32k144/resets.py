# SPDX-License-Identifier: Apache-2.0
"""Resets of the processor in a drive at 9500 rpm: the dc link's voltage, and how long the bridge is without its gates.

    source tools/common.sh
    build/venv/bin/python tests/target/s32k144/resets.py [--points 60] [--csv FILE]

The flashed image on the emulated processor, the vehicle's commands on the bus, the simulated machine, dc link (500 uF),
contactor and gate supply that obey the pins. A reset releases every line: the contactor opens at once, which is earlier
than any real one, and the diodes rectify. Each point runs twice from the same state: with the board's hardware path of
the safe state, and without it.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path

from fluxtrue_tools.bench.image import RPM, Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop

BATTERY_V = 350.0
SPEED_RPM = 9500.0
HARDWARE_V = 1.1 * BATTERY_V
PLANT = {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": BATTERY_V, "dc_link_F": 500e-6,
         "avalanche_V": 3.0 * BATTERY_V, "hardware_safe_V": HARDWARE_V}  # fmt: skip
# Bits of RCM_SRS.
KINDS = {"watchdog": 0x20, "lockup": 0x200, "software": 0x400, "pin": 0x40, "power-on": 0x82}
TORQUES_NM = (60.0, 0.0, -60.0)
SPACING_PERIODS = 7  # a third of an electrical turn, and a little more
AFTER_PERIODS = 1000
MAIN_CONTACTOR = 1  # of port C, hal/s32k144/pins.h


@dataclass(frozen=True)
class Outcome:
    """A reset. without_gates_ms: until the short circuit; NaN: the processor does not apply it. held: from
    then on without interruption, with the supply of the gates, for 0.1 s, and with the contactor closed at its end."""

    kind: str
    torque_Nm: float
    share: float
    hardware: bool
    vdc_share: float
    without_gates_ms: float
    held: bool
    peak_A: float


def powered_up(parts: Parts, plant: dict[str, float] | None = None) -> tuple[Loop, Stand]:
    """The drive at speed with its contactor closed, without torque."""
    motor = parts.emulated()
    loop = Loop(motor.library, motor.plant | PLANT | (plant or {}), motor.flux_map)
    stand = Stand(loop)
    loop.set("emulator.board", 1)
    stand.run(100)
    stand.run(400, Mode="torque")
    stand.run(30, Enable=1)
    steps = 400
    for k in range(steps):
        at = [SPEED_RPM * RPM * (k + j) / steps for j in (0, 1)]
        stand.run_ms({"plant.speed_rad_s": (at[0], at[1])})
    stand.run(20)
    if loop.get("emulator.gates") != 1 or loop.get("fault_word") != 0:
        raise FluxtrueError(
            f"the drive does not run: faults {int(loop.get('fault_word')):#x}, {loop.get('truth.vdc_V')} V"
        )
    return loop, stand


def reset(loop: Loop, stand: Stand, kind: str, torque: float, share: float, hardware: bool) -> Outcome:
    """One reset, and the time after it."""
    if not hardware:
        loop.set("plant.hardware_safe_V", 0.0)
    loop.record(("truth.vdc_V", "emulator.gates", "truth.i_d_A", "truth.i_q_A", "emulator.gate_supply"), 1)
    loop.set("emulator.reset_share", share)
    loop.set("emulator.reset", KINDS[kind])
    rows = [row for _ in range(AFTER_PERIODS // stand.periods_per_ms) for row in stand.run_ms()]
    gates = [row[1] for row in rows]
    without = (gates.index(1.0) + 1 - share) * 0.1 if 1.0 in gates else float("nan")
    contactor = stand.core.register("PTC.PDOR") >> MAIN_CONTACTOR & 1 == 1
    after = rows[gates.index(1.0) :] if 1.0 in gates else []
    held = contactor and bool(after) and all(row[1] == 1.0 and row[4] == 1.0 for row in after)
    peak = max((row[2] ** 2 + row[3] ** 2) ** 0.5 for row in rows)
    return Outcome(kind, torque, share, hardware, max(row[0] for row in rows) / BATTERY_V, without, held, peak)


# The end of each part of the start: register, bits, value.
STEPS = (
    ("RAM written, watchdog set, .data copied", "PCC.PCC_PORTA", 1 << 30, 1 << 30),
    ("pins and PWM set up", "FTM0.SC", 0x3F << 16, 0x3F << 16),
    ("speed and dc voltage measured, short circuit", "FTM0.SWOCTRL", 0xFFFF, 0x2A3F),
    ("motor data checked, drive and bus state initialised", "SCG.SOSCCSR", 1, 1),
    ("crystal, PLL, 112 MHz", "SMC.PMCTRL", 0x60, 0x60),
    ("drivers, memory recalled, interrupts", "FTM0.SC", 0x18, 0x08),
)


def start_up(parts: Parts) -> list[tuple[str, float]]:
    """Milliseconds from a watchdog reset at speed until each part of the start is over, to 2 us."""
    loop, stand = powered_up(parts)
    with loop:
        core, passed = stand.core, []
        core.reset(KINDS["watchdog"])
        begin_s = core.now_s
        for name, register, mask, value in STEPS:
            while core.register(register) & mask != value:
                core.run(2e-6)
            passed.append((name, 1e3 * (core.now_s - begin_s)))
    return passed


def in_a_copy(work: Callable[[], Outcome]) -> Outcome:
    """Run `work` in a copy of this process: the drive here stays as it is."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(writing, json.dumps(asdict(work())).encode())
        finally:
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        text = stream.read()
    os.waitpid(child, 0)
    if not text:
        raise FluxtrueError("a point failed; its message is above")
    return Outcome(**json.loads(text))


def campaign(parts: Parts, points: int, both: bool = True) -> Iterator[Outcome]:
    """The points: torque by torque, the kinds of reset in turn, at different angles and times in a period."""
    loop, stand = powered_up(parts)
    with loop:
        kinds = list(KINDS)
        for k in range(points):
            torque = TORQUES_NM[k * len(TORQUES_NM) // points]
            if stand.command.values["TorqueRequested"] != torque or k == 0:
                stand.run(60, TorqueRequested=torque)
            loop.run(SPACING_PERIODS)
            kind, share = kinds[k % len(kinds)], (k * 0.37 + 0.05) % 1.0
            for hardware in (True, False) if both else (True,):
                yield in_a_copy(partial(reset, loop, stand, kind, torque, share, hardware))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=60)
    parser.add_argument("--csv", type=Path)
    parser.add_argument("--times", action="store_true", help="where the time of the start goes, and nothing else")
    parser.add_argument("--angle", choices=build.FLASHED, default="encoder")
    arguments = parser.parse_args()
    parts = build.prepare("hsm1", angle=arguments.angle, flashed=True)
    if arguments.times:
        for name, milliseconds in start_up(parts):
            print(f"{milliseconds:8.3f} ms  {name}")
        return 0
    outcomes = []
    for outcome in campaign(parts, arguments.points):
        print(outcome, flush=True)
        outcomes.append(outcome)
    if arguments.csv:
        with arguments.csv.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            writer.writerow([field.name for field in fields(Outcome)])
            writer.writerows(asdict(outcome).values() for outcome in outcomes)
    for hardware in (True, False):
        mine = [outcome for outcome in outcomes if outcome.hardware == hardware]
        kept = [outcome for outcome in mine if outcome.kind != "power-on"]
        print(f"{'with' if hardware else 'without'} the hardware path: dc link at most "
              f"{max(outcome.vdc_share for outcome in mine):.3f} of the battery "
              f"({max(outcome.vdc_share for outcome in kept):.3f} without the power-on resets); short circuit after at "
              f"most {max(outcome.without_gates_ms for outcome in kept):.1f} ms")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
