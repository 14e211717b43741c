# SPDX-License-Identifier: Apache-2.0
"""What a period costs with the current control of a field that turns far, beside the usual one.

The same program, machine, torques and speeds, with the motor data of hsm1 as it is and at half of its PWM frequency.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fluxtrue_tools.bench import disassembly
from fluxtrue_tools.bench.build import build_constants
from fluxtrue_tools.bench.drive import HSM1, ROBUST, WARM_UP, Given, Target, periods
from fluxtrue_tools.bench.machine import SECOND
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.emit_c import motor_tables_c
from fluxtrue_tools.motor.motor import Motor, load_motor, resolve

USUAL, TURNING = "usual", "turning"
TURNING_HZ = 5000.0
GATES, FAULTS = 3, 13  # among the outputs
Spread = dict[str, list[float]]


def turning_motor() -> Motor:
    """hsm1 with so low a PWM frequency that its field turns far in a period."""
    known = load_motor(HSM1)
    config = known.config.model_copy(
        update={"inverter": known.config.inverter.model_copy(update={"pwm_hz": TURNING_HZ})}
    )
    assert config.is_turning
    return resolve(config, known.flux_map, known.model)


def _given(target: Target, folder: Path) -> Given:
    motor = turning_motor()
    source = folder / "turning_motor.c"
    source.write_text(motor_tables_c(motor), encoding="utf-8")
    constants = target.machine.add(build_constants(folder / "turning_motor.elf", source, SECOND))
    return Given(motor, constants.symbols["motor"])


def _spread(target: Target, given: Given | None) -> Spread:
    """Instructions and cycles of the fast ISR, without its return."""
    machine = target.machine
    _, overhead = machine.count("bench_nothing")
    overhead_cycles = machine.cycles
    seen = []
    for k in periods(target, ROBUST, given=given):
        _, issued = machine.count("bench_fast_isr")
        if k >= WARM_UP:
            seen.append((issued - overhead, machine.cycles - overhead_cycles))
    state = target.outputs()
    if not state[GATES] or state[FAULTS]:
        raise FluxtrueError(f"the measured drive ended with fault word {state[FAULTS]:#x}")
    columns = np.array(seen).T
    return {name: [int(x.min()), round(float(x.mean()), 1), int(x.max())]
            for name, x in zip(("instructions", "cycles"), columns, strict=True)}  # fmt: skip


def measure_laws(path: Path) -> dict[str, Spread]:
    """The figures of the laws in the program that build_drive() makes."""
    target = Target(path)
    target.machine.charge(disassembly.read(path))
    return {USUAL: _spread(target, None), TURNING: _spread(target, _given(target, path.parent))}
