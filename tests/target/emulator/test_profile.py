# SPDX-License-Identifier: Apache-2.0
"""The profile of each handler's runs, compared with the emulator's own counters."""

import ctypes
from collections.abc import Iterator

import pytest

from fluxtrue_tools.bench import image
from fluxtrue_tools.emulate import library as emulation
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop

VECTORS = (image.FAST, image.MRAI, image.TASK)


@pytest.fixture
def stand(parts: Parts) -> Iterator[image.Stand]:
    motor = parts.emulated(emulation.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 100.0, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("identification_mode", 0)  # the paper's: it has an interrupt of its own
        loop.set("enable", 1)
        loop.run(300)
        yield image.Stand(loop)


def start(stand: image.Stand, cost: int, taken: int) -> None:
    costs = bytes([cost]) * (image.CODE_SIZE // 2)
    assert stand.library.emu_profile_start(stand.handle, costs, len(costs), taken)


def test_the_runs_add_up_to_the_emulators_counters_plus_skipped_instructions(stand: image.Stand) -> None:
    start(stand, 1, 0)
    stand.library.emu_counts_clear(stand.handle)
    stand.loop.run(200)
    spans = list(stand.take())
    for vector in VECTORS:
        issued = [instructions for v, instructions, _ in spans if v == vector]
        counts = stand.core.counts(vector)
        assert len(issued) == counts.runs
        assert min(issued) >= counts.least
        # The counters do not include the instructions that an IT skips: some per cent of a handler.
        assert counts.sum <= sum(issued) < 1.05 * counts.sum


def test_a_run_costs_the_sum_over_its_instructions_and_its_taken_branches(stand: image.Stand) -> None:
    start(stand, 1, 0)
    stand.loop.run(50)
    assert all(cost == instructions for _, instructions, cost in stand.take())
    start(stand, 3, 0)
    stand.loop.run(50)
    assert all(cost == 3 * instructions for _, instructions, cost in stand.take())
    start(stand, 1, 1)
    stand.loop.run(50)
    # After some instructions, but never after all, another one runs than the next in memory. An interrupt without
    # branches may have none (its return is not counted as one); the task has some, because it calls functions.
    spans = list(stand.take())
    assert {vector for vector, _, _ in spans} == set(VECTORS)
    assert [span for span in spans if not span[1] + (span[0] == image.TASK) <= span[2] < 1.5 * span[1]] == []


def test_an_instruction_without_a_cost_is_an_error_with_its_address(stand: image.Stand) -> None:
    start(stand, 0, 0)
    with pytest.raises(FluxtrueError, match="the instruction at 0x0000.* ran, but no cost was given for it"):
        stand.loop.run(1)


def test_each_run_is_returned_only_once(stand: image.Stand) -> None:
    start(stand, 1, 0)
    stand.loop.run(20)
    assert len(list(stand.take())) >= 40
    assert list(stand.take()) == []


def test_nothing_is_profiled_where_instructions_are_not_counted_one_by_one(parts: Parts) -> None:
    motor = parts.emulated(emulation.FAST)
    with Loop(motor.library, motor.plant, motor.flux_map) as loop:
        stand = image.Stand(loop)
        assert not stand.library.emu_profile_start(stand.handle, b"\1" * 2, 2, 0)
        assert ctypes.sizeof(image._Span) == 20
