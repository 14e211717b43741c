# SPDX-License-Identifier: Apache-2.0
"""The drive's own cost: fast ISR, MRAI ISR and their stages on the emulated Cortex-M4.

The firmware runs in closed loop with the machine of hsm1's map, sampled once per
period: torque steps in both directions at constant speed, then a run-up into the voltage limit.
The inverter is an average one; what is measured keeps currents and duties where a drive's are.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from fluxtrue_tools.bench.build import FIRMWARE, ROOT, build_host, build_target
from fluxtrue_tools.bench.gather import Gather
from fluxtrue_tools.bench.machine import Machine
from fluxtrue_tools.motor.build import build as build_motor
from fluxtrue_tools.motor.flux_model import FluxModel
from fluxtrue_tools.motor.motor import Motor, load_motor

LTO = ("-flto",)
OUTPUTS = 24
SUB_STEPS = 4
TORQUE = 13653  # q15 of the base: about 100 N·m of hsm1
TORQUES = (TORQUE, -TORQUE // 2, TORQUE // 3, TORQUE)
PERIODS, RUN_UP_FROM, WARM_UP, STEP_PERIODS = 2400, 1600, 100, 200
RPM, RPM_TOP = 3000.0, 6500.0
PAPER, ROBUST = 0, 1  # identification_mode
HSM1 = FIRMWARE / "motors" / "hsm1"


class Processor(Protocol):
    """The processor on which the program runs."""

    def call(self, symbol: str, *arguments: int) -> int: ...

    def outputs(self) -> list[int]: ...


class Target:
    """The emulated core."""

    def __init__(self, path: Path) -> None:
        self.machine = Machine(path)

    def call(self, symbol: str, *arguments: int) -> int:
        return self.machine.call(symbol, *arguments)

    def outputs(self) -> list[int]:
        address = self.machine.call("drive_outputs") & 0xFFFF_FFFF
        return np.frombuffer(self.machine.read(address, 4 * OUTPUTS), dtype="<i4").tolist()


class Host:
    """This computer, from the same sources."""

    def __init__(self, path: Path) -> None:
        self.library = ctypes.CDLL(str(path))
        self.library.drive_outputs.restype = ctypes.POINTER(ctypes.c_int32)

    def call(self, symbol: str, *arguments: int) -> int:
        getattr(self.library, symbol)(*(ctypes.c_uint32(a & 0xFFFF_FFFF) for a in arguments))
        return 0

    def outputs(self) -> list[int]:
        return list(self.library.drive_outputs()[:OUTPUTS])


def sources(folder: Path) -> list[Path]:
    """All of the firmware with the tables of hsm1, which are generated into the folder."""
    build_motor(HSM1, folder, report=False)
    layers = ("fx", "types", "signal", "control", "safety", "drive")
    firmware = [path for layer in layers for path in (FIRMWARE / layer).rglob("*.c")]
    return [Path(__file__).with_name("drive_kernels.c"), *sorted(firmware), folder / "motor_tables.c"]


def build_drive(folder: Path) -> Path:
    """The program for the target, optimised across files as the m4f preset does."""
    return build_target(folder / "drive.elf", sources(folder), (*LTO, f"-I{ROOT}"))


def build_task(folder: Path) -> Path:
    """The stages of the 1 kHz task, in a program of their own: called from two places they would be compiled apart."""
    stages = Path(__file__).with_name("task_kernels.c")
    ecu = [FIRMWARE / "ecu" / f"{name}.c" for name in ("arbitration", "supervisor", "supervisor_table")]
    ecu += sorted(path for layer in ("second_level", "scope") for path in (FIRMWARE / layer).glob("*.c"))
    port = ROOT / "hal" / "s32k144" / "gather.c"
    return build_target(folder / "task.elf", [*sources(folder), stages, port, *ecu], (*LTO, f"-I{ROOT}"), [stages])


def build_drive_host(folder: Path, flags: tuple[str, ...] = ()) -> Path:
    """The same program as a shared library."""
    return build_host(folder / "drive.so", sources(folder), (f"-I{ROOT}", *flags))


@dataclass
class Load:
    """The machine of the tables, hsm1's map, on an average-value inverter: what the monitors expect to see."""

    model: FluxModel
    r: float = 0.018
    pole_pairs: int = 3
    v_dc: float = 350.0
    period_s: float = 1e-4
    theta: float = 0.0
    i: list[float] = field(default_factory=lambda: [0.0, 0.0])
    psi: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.psi = [float(self.model.psi_d(0.0, 0.0)), 0.0]

    def currents(self) -> tuple[float, float]:
        return self.i[0], self.i[1]

    def _solve(self) -> None:
        """The currents that belong to psi, by Newton's method from those of the step before."""
        for _ in range(2):
            d, q = self.i
            sign, q = (1.0 if q >= 0 else -1.0), abs(q)
            a, b = float(self.model.psi_d(d, q, nd=1)), sign * float(self.model.psi_d(d, q, nq=1))
            c, e = sign * float(self.model.psi_q(d, q, nd=1)), float(self.model.psi_q(d, q, nq=1))
            x = self.psi[0] - float(self.model.psi_d(d, q))
            y = self.psi[1] - sign * float(self.model.psi_q(d, q))
            det = a * e - b * c
            self.i = [self.i[0] + (e * x - b * y) / det, self.i[1] + (a * y - c * x) / det]

    def phases(self) -> list[float]:
        i_d, i_q = self.currents()
        return [i_d * math.cos(self.theta - x) - i_q * math.sin(self.theta - x)
                for x in (0.0, 2 * math.pi / 3, -2 * math.pi / 3)]  # fmt: skip

    def theta_m(self) -> int:
        return int(self.theta / (2 * math.pi * self.pole_pairs) * 2**32) & 0xFFFF_FFFF

    def run(self, duty: list[int], gates: bool, omega: float) -> None:
        """One period; with switching disabled the rotor turns and no current flows."""
        a, b, c = (d / 32768.0 * self.v_dc for d in duty)
        alpha, beta = (2 * a - b - c) / 3, (b - c) / math.sqrt(3)
        step = self.period_s / SUB_STEPS
        for _ in range(SUB_STEPS):
            cos, sin = math.cos(self.theta), math.sin(self.theta)
            if gates:
                i_d, i_q = self.currents()
                u_d, u_q = alpha * cos + beta * sin, beta * cos - alpha * sin
                rate_d = u_d - self.r * i_d + omega * self.psi[1]
                rate_q = u_q - self.r * i_q - omega * self.psi[0]
                self.psi = [self.psi[0] + step * rate_d, self.psi[1] + step * rate_q]
                self._solve()
            self.theta += step * omega


def _counts(amperes: float, noise: float) -> int:
    return min(max(round(((amperes + noise) / 800.0 + 0.5) * 4096), 0), 4095)


@dataclass(frozen=True)
class Given:
    """Other data for the drive than those of hsm1 in its program: hsm1's machine at another PWM frequency."""

    motor: Motor
    address: int


def periods(
    drive: Processor, mode: int = ROBUST, task: Callable[[], object] | None = None, given: Given | None = None
) -> Iterator[int]:
    """Run the drive against the machine: after each yield the ISRs of that period are wanted. task: the 1 kHz task."""
    rng = np.random.default_rng(1)
    hsm1 = load_motor(HSM1)
    motor = hsm1 if given is None else given.motor
    torques = [round(t * hsm1.bases.torque_Nm / motor.bases.torque_Nm) for t in TORQUES]
    load = Load(motor.model, period_s=1.0 / motor.config.inverter.pwm_hz)
    duty, gates = [16384] * 3, False
    if given is None:
        drive.call("drive_start", mode)
    else:
        drive.call("drive_start_for", mode, given.address)
    for k in range(PERIODS):
        rpm = RPM + (RPM_TOP - RPM) * max(k - RUN_UP_FROM, 0) / (PERIODS - RUN_UP_FROM)
        a, b, c = (_counts(i, rng.normal(0.0, 0.5)) for i in load.phases())
        drive.call("drive_request", torques[(k // STEP_PERIODS) % len(torques)], 1)
        drive.call("drive_sample", a | b << 16, c | int(load.v_dc / 525.0 * 4096) << 16, load.theta_m())
        yield k
        acting = duty, gates
        if (k + 1) % motor.bases.periods_per_step == 0:
            (task or (lambda: drive.call("bench_task")))()
        state = drive.outputs()
        duty, gates = state[:3], bool(state[3])
        load.run(*acting, rpm * math.pi / 30 * load.pole_pairs)


@dataclass(frozen=True)
class Stage:
    """Instructions of one stage over the run."""

    name: str  # bench_<name>
    title: str
    minimum: int
    average: float
    maximum: int


TITLES = {
    "current_tick_tables": "current control with the flux tables, counts to duties",
    "current_tick": "the same without the look-up of the tables",
    "current_core": "of it what the leanest peer has",
    "measure": "measure: counts to currents and dc voltage",
    "angle_tracker": "angle tracker",
    "current_control": "current control, both axes and limiter",
    "modulate": "modulation, with the rotation ahead",
    "flux_table": "flux tables, all outputs",
    "window": "identification, a period's sums",
    "mrai": "MRAI",
    "torque_estimate": "torque estimate",
    "torque_path": "torque estimate and loop",
    "fast_isr": "fast ISR, with monitors and exchange",
    "mrai_isr_paper": "MRAI ISR, the paper's identification",
    "both": "the whole 10 kHz work",
    "task": "1 kHz task, robust identification included",
    "tick": "10 kHz work and a tenth of the task",
}


# In this order: the tables' answer and the controller's voltage are used by those after them.
STAGES = (
    "flux_table", "current_tick_tables", "current_tick", "current_core", "measure", "angle_tracker", "current_control",
    "modulate", "window",
)  # fmt: skip

TASK_TITLES = {
    "identify": "identification filter",
    "trim": "dead-time trim",
    "angle_harmonics": "angle correction",
    "slow_monitors": "monitors",
    "torque_limit": "torque limit",
    "torque_loop": "slew and torque loop",
    "reference": "current reference",
    "target": "tables at the reference",
    "safe_state": "safe state",
    "schedule": "the paper's schedule",
    "supervisor": "state machine of the bus",
    "arbitrate": "torque arbitration",
    "second_level": "second level",
    "second_level_frame": "second level, a frame",
    "scope_idle": "scope, nothing armed",
    "scope_armed": "scope, armed: eight values of ten periods, and the search",
    "scope_mixed": "scope, armed: two of the period and six of the task, and the search",
    "scope_seldom": "scope, armed: eight values of each tenth period, and the search",
    "scope_value": "scope, armed: eight values of ten periods, and the search in a value of the task",
    "scope_edge": "scope, armed: eight values of ten periods, and the search for the other side of an edge",
    "scope_triggered": "scope, triggered: eight values of ten periods",
}
PAPERS = ("schedule",)


def measure_task(path: Path) -> list[Stage]:
    """The stages of the 1 kHz task, each on a copy of the drive just before the task runs."""
    target = Target(path)
    machine = target.machine
    gather = Gather(machine.uc)
    overhead = machine.count("task_nothing")[1]
    seen: dict[str, list[int]] = {name: [] for name in TASK_TITLES}

    def task(names: Iterable[str], warm: list[int]) -> None:
        for name in names:
            machine.call("task_copy")
            gather.end_step()
            issued = machine.count(f"task_{name}")[1] - overhead
            if warm:
                seen[name].append(issued)
        machine.call("bench_task")

    for mode, names in ((ROBUST, [n for n in TASK_TITLES if n not in PAPERS]), (PAPER, PAPERS)):
        warm: list[int] = []
        for k in periods(target, mode, task=lambda names=names, warm=warm: task(names, warm)):  # type: ignore[misc]
            if k == WARM_UP:
                warm.append(k)
            machine.call("bench_fast_isr")
            if mode == PAPER:
                machine.call("bench_mrai_isr")
    return [Stage(name, title, min(seen[name]), float(np.mean(seen[name])), max(seen[name]))
            for name, title in TASK_TITLES.items()]  # fmt: skip


def measure_drive(path: Path) -> tuple[list[Stage], int, int]:
    """Stages, counted periods, and how many of them had the voltage limited."""
    target = Target(path)
    machine = target.machine
    overhead = machine.count("bench_nothing")[1]
    seen: dict[str, list[int]] = {name: [] for name in TITLES}
    limited = 0

    def count(*names: str) -> dict[str, int]:
        return {name: machine.count(f"bench_{name}")[1] - overhead for name in names}

    def stages_of(*names: str) -> dict[str, int]:
        issued = {}
        for name in names:
            machine.call("drive_copy")
            issued |= count(name)
        return issued

    for k in periods(target, PAPER):
        issued = stages_of("mrai", "torque_estimate", "torque_path") | count("fast_isr", "mrai_isr")
        if k >= WARM_UP:
            issued["mrai_isr_paper"] = issued["mrai_isr"]
            for name in ("mrai", "torque_estimate", "torque_path", "mrai_isr_paper"):
                seen[name].append(issued[name])
    for k in periods(target, ROBUST, task=lambda: seen["task"].append(count("task")["task"])):
        issued = stages_of(*STAGES) | count("fast_isr")
        issued["both"] = issued["fast_isr"]  # the robust identification has no interrupt of its own
        if k < WARM_UP:
            continue
        limited += machine.call("drive_limited") & 1
        for name, number in issued.items():
            seen[name].append(number)
    seen["tick"] = [n + int(np.mean(seen["task"])) // 10 for n in seen["both"]]
    stages = [Stage(name, title, min(seen[name]), float(np.mean(seen[name])), max(seen[name]))
              for name, title in TITLES.items()]  # fmt: skip
    return stages, PERIODS - WARM_UP, limited
