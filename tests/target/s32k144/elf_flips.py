# SPDX-License-Identifier: Apache-2.0
"""Single bit flips in the RAM and the flash of the image on the bus, on the emulated processor in closed loop.

Each flip is a copy of this process (fork): it flips one bit at a random moment and drives on. The shaft torque of the
simulated machine, in means of a millisecond, is compared with that of a copy without a flip. A flip in code or data is
late, too, if the checksums have not found it 50 ms after it happened, whatever the torque did.

    source tools/common.sh
    build/venv/bin/python tests/target/s32k144/elf_flips.py 2000 [--seed 1]
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

from fluxtrue_tools.bench.image import RPM, Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import EmulationStoppedError
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.target.image import Image

APART_NM, APART_MS, RUN_MS, HANG_S = 5.0, 50, 350, 120
CHECKSUM_MS: Final = 50  # from a flip in the flash to its fault; two passes over the whole flash take less
RAMP_RPM_PER_MS: Final = 30.0
POINTS: Final = ((300.0, 90.0), (3000.0, 70.0), (9000.0, -25.0))  # rpm, N·m
SHARES: Final = {"RAM": 0.45, "code in RAM": 0.1, "code": 0.25, "data": 0.2}


class Place(NamedTuple):
    """Where and when a bit flips."""

    area: str
    address: int
    bit: int
    moment_ms: int


@dataclass
class Trace:
    """What one copy did."""

    torque_Nm: list[float]
    detected_ms: int | None = None  # the drive reports a fault, or has been reset
    stopped: str = ""  # the emulator refuses what no program may do; on silicon an exception, which resets


def areas(parts: Parts) -> dict[str, tuple[int, int]]:
    """First address and the one behind the last."""
    symbols = Image(parts.image).symbols
    return {
        "RAM": (symbols["stack_bottom"], symbols["bss_end"]),
        "code in RAM": (symbols["hot_start"], symbols["hot_end"]),
        "code": (symbols["program_start"], symbols["program_end"]),
        "data": (symbols["protected_start"], symbols["protected_end"]),
    }


def draw(dice: random.Random, where: dict[str, tuple[int, int]]) -> Place:
    area = dice.choices(list(SHARES), list(SHARES.values()))[0]
    return Place(area, dice.randrange(*where[area]), dice.randrange(8), dice.randrange(10))


def drive_to(stand: Stand, rpm: float, torque_Nm: float) -> None:
    stand.power_up()
    stand.command.values["TorqueRequested"] = torque_Nm
    ramp_ms = max(round(rpm / RAMP_RPM_PER_MS), 40)
    for k in range(ramp_ms + 20):
        speed = [rpm * RPM * min((k + j) / ramp_ms, 1.0) for j in (0, 1)]
        stand.run_ms({"plant.speed_rad_s": (speed[0], speed[1])})


def requested_Nm(torque_Nm: float, ms: int) -> float:
    """Other torques during the run, so that what nothing reads at a constant one acts, too."""
    return torque_Nm if ms < RUN_MS // 2 else -0.6 * torque_Nm


def drive_on(stand: Stand, torque_Nm: float, place: Place | None) -> Trace:
    trace = Trace([])
    resets = stand.core.resets
    for ms in range(RUN_MS):
        stand.command.values["TorqueRequested"] = requested_Nm(torque_Nm, ms)
        if place is not None and ms == place.moment_ms:
            old = stand.core.read(place.address, 1)[0]
            stand.core.write(place.address, bytes([old ^ 1 << place.bit]))
        try:
            trace.torque_Nm.append(float(stand.run_ms()[:, 0].mean()))
        except (EmulationStoppedError, FluxtrueError) as error:
            trace.stopped = str(error)
            return trace
        detected = stand.core.resets != resets or stand.loop.get("fault_word") != 0 or stand.core.outputs == 0
        if detected and trace.detected_ms is None:
            trace.detected_ms = ms
            break
    return trace


def in_a_copy(run: Callable[[], Trace]) -> Trace:
    """What `run` returns in a copy of this process."""
    sys.stdout.flush()
    from_child, to_parent = os.pipe()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (HANG_S, HANG_S))
        os.close(from_child)
        with os.fdopen(to_parent, "w") as pipe:
            json.dump(run().__dict__, pipe)
            pipe.flush()
            os._exit(0)
    os.close(to_parent)
    with os.fdopen(from_child) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    return Trace(**json.loads(text)) if status == 0 else Trace([], stopped=f"process ended with {status}")


def verdict(golden: Trace, trace: Trace, place: Place) -> str:
    """The verdict, one of those of tests/memory/verdict.h."""
    if trace.stopped:
        return "stopped"
    if place.area != "RAM" and trace.detected_ms is not None and trace.detected_ms - place.moment_ms > CHECKSUM_MS:
        return "late"
    apart = [ms for ms, torque in enumerate(trace.torque_Nm) if abs(torque - golden.torque_Nm[ms]) > APART_NM]
    if trace.detected_ms is not None:
        return "late" if apart and trace.detected_ms - apart[0] > APART_MS else "detected"
    return "silent" if len(apart) > APART_MS else "passed" if apart else "masked"


def campaign(parts: Parts, flips: int, seed: int) -> dict[str, Counter[str]]:
    """Number of verdicts in each area; what is silent or late is printed."""
    dice, found = random.Random(seed), {area: Counter[str]() for area in SHARES}
    where, motor = areas(parts), parts.emulated()
    for k, (rpm, torque) in enumerate(POINTS):
        plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 1.0}
        with Loop(motor.library, plant, motor.flux_map) as loop:
            loop.record(("truth.torque_shaft_mean_Nm",), 1)
            stand = Stand(loop)
            drive_to(stand, rpm, torque)
            golden = in_a_copy(lambda s=stand, t=torque: drive_on(s, t, None))
            assert golden.detected_ms is None and not golden.stopped, golden
            assert abs(golden.torque_Nm[50] - torque) < 15.0, golden.torque_Nm[50]
            for _ in range(flips * (k + 1) // len(POINTS) - flips * k // len(POINTS)):
                place = draw(dice, where)
                trace = in_a_copy(lambda s=stand, t=torque, p=place: drive_on(s, t, p))
                result = verdict(golden, trace, place)
                found[place.area][result] += 1
                if result in ("silent", "late", "passed"):
                    print(f"{result}: {place.area} {place.address:#x} bit {place.bit} at {rpm:.0f} rpm", flush=True)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flips", type=int)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    table = campaign(build.prepare("hsm1", flashed=True), arguments.flips, arguments.seed)
    for name, counts in table.items():
        print(name, dict(counts))
    return 1 if any(counts["silent"] + counts["late"] for counts in table.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
