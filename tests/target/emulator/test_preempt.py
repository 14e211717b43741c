# SPDX-License-Identifier: Apache-2.0
"""No activity ever sees half of a value: it is interrupted at each of its instructions."""

from collections.abc import Iterator

import pytest
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import library, preempt
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop


PAPER, ROBUST = 0, 1
STEPS, PERIODS = 10, 10


@pytest.fixture(scope="module", params=[PAPER, ROBUST], ids=["paper", "robust"])
def loop(parts: Parts, request: pytest.FixtureRequest) -> Iterator[Loop]:
    """Identifying a weak magnet at 3000 rpm in either way, counted instruction by instruction."""
    motor = parts.emulated(library.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0, "current_noise_A_rms": 0.5,
                           "magnet_scale": 0.9}  # fmt: skip
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("identification_mode", request.param)
        for name, value in (("torque_loop", 1), ("identification", 1), ("enable", 1), ("torque_command_Nm", 80)):
            loop.set(name, value)
        loop.run(2000)
        assert loop.get("fault_word") == 0
        yield loop


def longest_step_next(loop: Loop) -> None:
    """To just before the longest of the ten kinds of steps: the robust identification learns in every tenth."""
    core = Stand(loop).core
    lengths = []
    for _ in range(STEPS):
        core.clear_counts()
        loop.run(PERIODS)
        lengths.append(core.counts(preempt.TASK).most)
    loop.run(PERIODS * lengths.index(max(lengths)))


def check(report: preempt.Report) -> None:
    assert report.mixed == 0, report
    # Every boundary was tried, and both the old inputs and the new ones were seen.
    assert report.points == report.instructions > 50
    assert report.outcomes == 2


@pytest.mark.parametrize("periods", [1, 7, 9])
def test_the_identification_sees_the_old_sample_or_the_new_one_wherever_it_is_interrupted(
    loop: Loop, periods: int
) -> None:
    if loop.get("identification_mode") == ROBUST:
        pytest.skip("the robust identification has no interrupt of its own: the fast ISR sums its windows")
    loop.run(periods)
    check(preempt.interrupt_everywhere(loop, preempt.MRAI))


# Two rounds at one place overwrite the slot that the task may be copying from.
@pytest.mark.parametrize("rounds", [1, 2])
@pytest.mark.parametrize("longest", [False, True], ids=["next", "longest"])
def test_the_task_sees_one_moment_wherever_both_interrupts_come(loop: Loop, longest: bool, rounds: int) -> None:
    if longest:
        longest_step_next(loop)
    report = preempt.interrupt_everywhere(loop, preempt.TASK, rounds)
    check(report)
    assert report.choices >= 2  # interrupts before and after something was handed over to them


def test_the_drive_goes_on_as_if_nothing_had_been_tried(parts: Parts, loop: Loop) -> None:
    before = loop.get("truth.time_s")
    loop.run(100)
    assert loop.get("truth.time_s") == pytest.approx(before + 0.01)
    assert loop.get("fault_word") == 0
    assert loop.get("truth.torque_Nm") == pytest.approx(80, abs=3)
