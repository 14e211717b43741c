# SPDX-License-Identifier: Apache-2.0
"""The runs of a campaign: every line of the table at every operating point to which it applies."""

import hashlib
import json
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools.campaign.envelope import NOTHING_WRONG, Envelope, make_envelope
from fluxtrue_tools.campaign.machine import Machine, data_sheet
from fluxtrue_tools.campaign.spec import Nominal
from fluxtrue_tools.emulate.ecu_loop import EmulatedEcuLoop
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign import fmea
from fluxtrue_tools.fault_campaign.fmea import MET, OPEN, RECORDED, Point, Row
from fluxtrue_tools.fault_campaign.oracle import Reruns
from fluxtrue_tools.fault_campaign.run_point import Imposed, LoopOf, Trace, run_point
from fluxtrue_tools.fault_campaign.spec import Faults
from fluxtrue_tools.fault_campaign.verdict import evaluate
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.ecu_loop import EcuLoop
from fluxtrue_tools.sim.library import LoopError

STRIDE = 7  # from a line's first point of the slice to its next one: prime to the number of points


@dataclass(frozen=True, eq=False)
class Plan:
    """A campaign with everything it needs, as text that a worker process can be given."""

    campaign: Faults
    rows: tuple[Row, ...]
    folders: tuple[tuple[str, str], ...]  # name and built folder, as the campaign's machines
    is_slice: bool
    images: tuple[tuple[str, str], ...] = ()  # image and layout of its data, likewise; empty: not emulated

    def loop_of(self, index: int) -> LoopOf:
        """What drives this machine."""
        return partial(EmulatedEcuLoop, *map(Path, self.images[index])) if self.campaign.is_emulated else EcuLoop

    @property
    def cases(self) -> range:
        """One for each line and machine."""
        return range(len(self.rows) * len(self.folders))

    def of_case(self, case: int) -> tuple[Row, int]:
        """Line and index of the machine."""
        return self.rows[case // len(self.folders)], case % len(self.folders)

    def digest(self) -> str:
        """Changes with every value of campaign and table, but not with what --record writes."""
        cells = [{k: v for k, v in row.text.items() if k not in RECORDED or self.is_slice} for row in self.rows]
        text = self.campaign.model_dump_json() + json.dumps(cells) + str(self.is_slice)
        return hashlib.sha256(text.encode()).hexdigest()


@lru_cache(maxsize=8)
def machine_of(name: str, folder: str) -> Machine:
    """Once per worker process."""
    return data_sheet(MotorFolder(name, Path(folder)), Nominal())


@lru_cache(maxsize=8)
def envelope_of(name: str, folder: str) -> Envelope:
    """The largest torque over speed, likewise."""
    return make_envelope(machine_of(name, folder), NOTHING_WRONG)


def points_of(plan: Plan, index: int) -> tuple[Point, ...]:
    """Every operating point of a machine, both signs."""
    machine = machine_of(*plan.folders[index])
    envelope = envelope_of(*plan.folders[index])
    found = []
    for k, (speed, torque) in enumerate(plan.campaign.points):
        rpm = speed * machine.speed_max_rpm
        torque_Nm = torque * envelope.at(rpm)
        found += [Point(k, sign, machine.motor.name, speed, torque, sign * rpm, sign * torque_Nm)
                  for sign in plan.campaign.signs]  # fmt: skip
    return tuple(found)


def chosen(plan: Plan, row: Row, number: int, index: int) -> list[Point]:
    """The points of a case; in the slice a few of them and the witness of a line of status physics, of an open one the
    witness alone. On the emulated processor a few of each line: the table's status is that of the host's runs."""
    held = [point for point in points_of(plan, index) if row.holds_at(point)]
    if not plan.is_slice:
        return held
    count = min(plan.campaign.slice_points, len(held))
    some = [held[(5 * number + STRIDE * index + k * len(held) // count) % len(held)] for k in range(count)]
    if row.status != MET and not plan.campaign.is_emulated:
        witness = [point for point in held if point.name == row.witness]
        some = witness if row.status == OPEN else some + witness
    return sorted(set(some), key=lambda point: (point.index, -point.sign))


def run_one(plan: Plan, row: Row, index: int, point: Point) -> dict[str, Any]:
    """A run and its verdict."""
    machine = machine_of(*plan.folders[index])
    run = partial(run_point, plan.campaign, machine.motor, loop_of=plan.loop_of(index))
    try:
        trace, healthy = run(row, point), replace(row, injection=())

        def imposed(bridge: int, at_ms: float) -> Trace:
            other = run(row, point, Imposed(bridge, at_ms))
            same = trace.time_ms <= at_ms
            if not np.array_equal(trace.rows[same], other.rows[same], equal_nan=True):
                raise FluxtrueError("the run does not repeat itself up to the imposed state")
            return other

        return evaluate(row, plan.campaign.machine[index], machine.rated_Nm, point, trace,
                        Reruns(imposed, partial(run, healthy, point)))  # fmt: skip
    except (FluxtrueError, LoopError) as error:
        raise FluxtrueError(f"{row.id} at {point.name}: {error}") from error


def run_case(plan: Plan, case: int) -> list[dict[str, Any]]:
    """All runs of one line on one machine."""
    row, index = plan.of_case(case)
    points = chosen(plan, row, case // len(plan.folders), index)
    return [{"case": case} | run_one(plan, row, index, point) for point in points]


def read_rows(campaign: Faults, folder: Path) -> tuple[Path, list[Row]]:
    """The campaign's table, and where it is."""
    path = folder / campaign.fmea
    return path, fmea.read(path)
