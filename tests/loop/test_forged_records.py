# SPDX-License-Identifier: Apache-2.0
"""Stored records with a good checksum and wrong content: none may move the torque of the plant."""

import math
import random
import struct
import zlib
from collections.abc import Iterator
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from fluxtrue_tools.sim.library import MEMORY_SIZE, Loop
from fluxtrue_tools.sim.motor import Motor

RPM: Final = 2.0 * math.pi / 60.0
HEADER: Final = struct.Struct("<4I")  # layout, size, sequence, CRC: firmware/storage/slot.h
STATES: Final = 7  # of the filter: control/identify/config.h
RECORD: Final = struct.Struct(f"<I{STATES}i{STATES}i4i")  # firmware/storage/memory.c
ONE_X, X_MAX, ONE_P = 1 << 27, 4 << 27, 1 << 30
MOVED_NM: Final = 2.0
POINTS: Final = ((600, 60, 0.7), (1500, -50, 0.5), (3000, 100, 0.6), (1200, 80, 0.4), (6000, 40, 0.5))  # rpm, N·m, s
DRIVEN: Final = ((1500, 50), (2500, 20), (600, -40), (3000, 70), (4500, 30), (1200, -60), (5000, 60), (2000, 90))

BRIDGE, KNEE = 749, 1 << 26  # dead time with device drop, Q15, and knee, Q17, of hsm1: its motor_tables.c

Record = tuple[list[int], list[int], list[int]]  # states, variances, compensation and trim


def power_on(motor: Motor, memory: bytes | None, **plant: float) -> Loop:
    machine = motor.plant | {"imposed_speed": 1.0, "magnet_scale": 0.92} | plant
    loop = Loop(motor.library, machine, motor.flux_map)
    if memory is not None:
        loop.remember(memory)
    loop.record(("truth.torque_mean_Nm", "torque_command_Nm", "fault_word"), 10)
    return loop


def memory_after(motor: Motor, **plant: float) -> bytes:
    """The flash after a drive of a machine and a stop."""
    with power_on(motor, None, **plant) as loop:
        loop.set("enable", 1.0)
        at = (0.0, 0.0)
        for rpm, torque in (*DRIVEN, (0.0, 0.0)):
            ramps = {"plant.speed_rad_s": (at[0] * RPM, rpm * RPM), "torque_requested_Nm": (at[1], torque)}
            loop.run(10000, ramps)
            at = (rpm, torque)
        loop.set("enable", 0.0)
        loop.run(2000)
        assert loop.get("memory_saves") == 1.0
        return loop.memory()


def content(memory: bytes) -> Record:
    values = list(RECORD.unpack_from(memory, HEADER.size))
    return values[1 : 1 + STATES], values[1 + STATES : 1 + 2 * STATES], values[1 + 2 * STATES :]


def forged(memory: bytes, record: Record) -> bytes:
    """The memory with this content and a checksum that fits."""
    layout, size, sequence, _ = HEADER.unpack_from(memory)
    body = RECORD.pack(1, *record[0], *record[1], *record[2])
    head = struct.pack("<3I", layout, size, sequence)
    cells = head + struct.pack("<I", zlib.crc32(head + body)) + body
    return cells + b"\xff" * (MEMORY_SIZE - len(cells))


def forgeries(dice: random.Random, honest: Record, other: Record) -> Iterator[tuple[str, Record]]:
    """One of each kind."""
    x, p, c = honest
    trust = [dice.randrange(1, ONE_P) >> dice.randrange(24) or 1 for _ in p]
    yield "in range", ([dice.randint(-X_MAX, X_MAX) for _ in x], trust, c)
    yield "plausible and trusted", ([round(dice.gauss(0, 1) * ONE_X) for _ in x], [ONE_P >> 12] * STATES, c)
    yield "beyond", ([dice.randint(-(1 << 31), (1 << 31) - 1) for _ in x], trust, c)
    one = dice.randrange(STATES)
    yield "one value", ([dice.randint(-X_MAX, X_MAX) if k == one else v for k, v in enumerate(x)], p, c)
    mixed = [dice.choice(pair) for pair in zip(zip(x, p, strict=True), zip(*other[:2], strict=True), strict=True)]
    yield "mixed generations", ([m[0] for m in mixed], [m[1] for m in mixed], dice.choice((c, other[2])))
    shift = dice.uniform(-2.0, 2.0) * ONE_X  # magnet against d axis, q axis against angle
    opposed = [v + round(w * shift) for v, w in zip(x, (0, 0, 1, 1, -1, 1, 0), strict=True)]
    yield "opposed", ([max(-X_MAX, min(X_MAX, v)) for v in opposed], [ONE_P >> 14] * STATES, c)
    # At 600 rpm and 60 N·m, the first point, the voltages of drop, magnet and q axis cancel.
    shift = dice.uniform(-1.2, 1.2) * ONE_X
    hidden = [v + round(w * shift) for v, w in zip(x, (0.0, -1.56, 1.0, 1.3, 0.0, 0.0, 0.0), strict=True)]
    yield "hidden by the drop", (hidden, [ONE_P >> 12] * STATES, c)
    inverter = [dice.randint(0, 4096), dice.randint(1, (1 << 30) - 1), 1, dice.randint(-1000, 1000)]
    yield "inverter", (x, p, inverter)


def torques(motor: Motor, memory: bytes | None, loops: float = 1.0) -> tuple[bool, NDArray[np.float64]]:
    """Whether the start recalled it, and the error of the plant's torque at each point, a mean over each 50 ms."""
    with power_on(motor, memory) as loop:
        recalled = loop.get("memory_recalled") == 1.0
        if memory is not None and not recalled:
            return False, np.zeros(0)
        loop.set("torque_loop", loops)
        loop.set("enable", 1.0)
        at, rows = (0.0, 0.0), []
        for rpm, torque, seconds in POINTS:
            ramps = {"plant.speed_rad_s": (at[0] * RPM, rpm * RPM), "torque_requested_Nm": (at[1], torque)}
            rows.append(loop.run(2000, ramps))
            at = (rpm, torque)
            hold = {"plant.speed_rad_s": (rpm * RPM, rpm * RPM), "torque_requested_Nm": (torque, torque)}
            rows.append(loop.run(round(seconds * 1e4), hold))
        recorded = np.vstack(rows)
    if recorded[:, 2].max() != 0:
        print(f"fault 0x{int(recorded[-1, 2]):x} after {int(np.argmax(recorded[:, 2] != 0))} ms")
        return True, np.full(len(recorded) // 50, np.inf)
    error = np.abs(recorded[:, 0] - recorded[:, 1])
    return True, error[: len(error) // 50 * 50].reshape(-1, 50).mean(axis=1)


def without_record(motor: Motor) -> NDArray[np.float64]:
    """The error that a drive without a record may have: with or without the torque loop."""
    _, fresh = torques(motor, None)
    _, tables = torques(motor, None, loops=0.0)
    print("tables", tables.round(1), "fresh", fresh.round(1))
    return np.maximum(fresh, tables)


def campaign(motor: Motor, memory: bytes, legal: NDArray[np.float64], rounds: int,
             seed: int) -> list[tuple[str, bool, float]]:  # fmt: skip
    """Kind, recalled, and by how much the error was larger than without a record, at most; N·m."""
    older = memory_after(motor, magnet_scale=1.03, lq_scale=1.06, ld_slope_scale=0.94, r_ohm_20=0.0190)
    _, kept = torques(motor, memory)
    print("kept", kept.round(1))
    dice = random.Random(seed)
    found = []
    for _ in range(rounds):
        for kind, record in forgeries(dice, content(memory), content(older)):
            try:
                body = forged(memory, record)
            except struct.error:
                continue
            recalled, error = torques(motor, body)
            found.append((kind, recalled, float((error - legal).max()) if recalled else 0.0))
    return found


@pytest.fixture(scope="module")
def honest(hsm1: Motor) -> bytes:
    return memory_after(hsm1)


@pytest.fixture(scope="module")
def legal(hsm1: Motor) -> NDArray[np.float64]:
    return without_record(hsm1)


@pytest.fixture(scope="module")
def found(hsm1: Motor, honest: bytes, legal: NDArray[np.float64]) -> list[tuple[str, bool, float]]:
    return campaign(hsm1, honest, legal, 44, 1)


def test_no_forged_record_moves_the_torque(found: list[tuple[str, bool, float]]) -> None:
    assert len(found) >= 300
    assert [row for row in found if row[2] > MOVED_NM] == []


@pytest.mark.parametrize("share", [0.4, 0.51, 1.49, 2.0])
@pytest.mark.parametrize("trim", [-1000, 0, 1000])
def test_a_compensation_near_the_ends_of_its_range_is_refused_or_moves_no_torque(
        hsm1: Motor, honest: bytes, legal: NDArray[np.float64], share: float, trim: int) -> None:  # fmt: skip
    x, p, _ = content(honest)
    recalled, error = torques(hsm1, forged(honest, (x, p, [round(share * BRIDGE), KNEE, 1, trim])))
    assert recalled == (0.5 < share < 1.5)
    if recalled:
        assert (error - legal).max() <= MOVED_NM
