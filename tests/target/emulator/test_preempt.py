# SPDX-License-Identifier: Apache-2.0
"""No activity reads a half-written value: each is interrupted at every one of its instructions."""

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import build, library, preempt
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.emulate.padding import padding
from fluxtrue_tools.sim.library import Loop

PAPER, ROBUST = 0, 1
STEPS, PERIODS = 10, 10


@pytest.fixture(scope="module", params=[PAPER, ROBUST], ids=["paper", "robust"])
def loop(parts: Parts, request: pytest.FixtureRequest) -> Iterator[Loop]:
    """A drive at 3000 rpm that identifies a weak magnet, with the paper's and the robust identification; every
    instruction is counted."""
    motor = parts.emulated(library.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0, "current_noise_A_rms": 0.5,
                           "magnet_scale": 0.9}  # fmt: skip
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("identification_mode", request.param)
        for name, value in (("torque_loop", 1), ("identification", 1), ("enable", 1), ("torque_requested_Nm", 80)):
            loop.set(name, value)
        loop.run(2000)
        assert loop.get("fault_word") == 0
        yield loop


def run_to_longest_step(loop: Loop) -> None:
    """Run to just before the longest of ten steps, in which the identification updates its parameters."""
    core = Stand(loop).core
    lengths = []
    for _ in range(STEPS):
        core.clear_counts()
        loop.run(PERIODS)
        lengths.append(core.counts(preempt.TASK).most)
    loop.run(PERIODS * lengths.index(max(lengths)))


def check(report: preempt.Report, outcomes: int = 2) -> None:
    assert report.mixed == 0, report
    # Every boundary was tried. `outcomes` is 2 if the activity found the old inputs in some cases, the new in others.
    assert report.points == report.instructions > 50
    assert report.outcomes == outcomes


@pytest.mark.parametrize("periods", [1, 7, 9])
def test_the_identification_uses_the_sample_it_was_pended_for_wherever_interrupted(loop: Loop, periods: int) -> None:
    if loop.get("identification_mode") == ROBUST:
        pytest.skip("the robust identification has no interrupt of its own: the fast ISR sums its windows")
    loop.run(periods)
    # Its mailbox is not written before it has finished, so it always finds the sample for which it was pended.
    check(preempt.interrupt_everywhere(loop, preempt.MRAI), outcomes=1)


# Two rounds of interrupts at the same instruction overwrite the slot that the task may be copying.
@pytest.mark.parametrize("rounds", [1, 2])
@pytest.mark.parametrize("longest", [False, True], ids=["next", "longest"])
def test_the_task_reads_inputs_of_one_instant_wherever_interrupted(loop: Loop, longest: bool, rounds: int) -> None:
    if longest:
        run_to_longest_step(loop)
    report = preempt.interrupt_everywhere(loop, preempt.TASK, rounds)
    check(report)
    assert report.choices >= 2  # there were interrupts before and after the task handed over a result


def test_the_drive_continues_unchanged_after_these_tests(parts: Parts, loop: Loop) -> None:
    before = loop.get("truth.time_s")
    loop.run(100)
    assert loop.get("truth.time_s") == pytest.approx(before + 0.01)
    assert loop.get("fault_word") == 0
    assert loop.get("truth.torque_Nm") == pytest.approx(80, abs=3)


# ---- interrupts that share only a flag or a queue with the control, on the image that would be flashed ----


@pytest.fixture(scope="module")
def flashed() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", flashed=True)


@pytest.fixture(scope="module")
def left_out(flashed: Parts) -> frozenset[int]:
    return padding(flashed.image)


@pytest.fixture(scope="module", params=[PAPER, ROBUST], ids=["paper", "robust"])
def stand(flashed: Parts, request: pytest.FixtureRequest) -> Iterator[Stand]:
    """A drive at standstill with torque, commanded over the bus."""
    motor = flashed.emulated(library.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 1.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        stand = Stand(loop)
        loop.set("identification_mode", request.param)
        stand.power_up()
        stand.run(60, TorqueRequested=60.0)
        assert loop.get("fault_word") == 0
        assert loop.get("truth.torque_Nm") == pytest.approx(60, abs=3)
        yield stand


@contextmanager
def restored_afterwards(core: Core) -> Iterator[None]:
    snapshot = core.save()
    yield
    core.restore(snapshot)
    core.free(snapshot)


GATE_FAULT = 1 << 15


def trigger(stand: Stand, by: int) -> Callable[[], None]:
    """A function that causes the interrupt. If a CAN frame causes it, another frame is already in the queue."""
    if by == preempt.GATE:
        return lambda: stand.core.pend(preempt.GATE)
    first, frame = stand.command.frame(), stand.command.frame()
    stand.library.can_frame_arrives(stand.handle, ctypes.byref(first))
    return lambda: stand.library.can_frame_arrives(stand.handle, ctypes.byref(frame))


# Activities that read what the interrupt writes: they may find the old or the new value. It does not affect the others.
READERS = ((preempt.FAST, preempt.GATE), (preempt.TASK, preempt.GATE), (preempt.TASK, preempt.CAN))
VICTIMS = {preempt.FAST: "fast", preempt.MRAI: "mrai", preempt.TASK: "task"}
PAIRS = [(victim, by) for by in (preempt.GATE, preempt.CAN) for victim in VICTIMS]


@pytest.mark.parametrize(("victim", "by"), PAIRS, ids=[f"{VICTIMS[v]}-{'gate' if b == preempt.GATE else 'can'}"
                                                       for v, b in PAIRS])  # fmt: skip
def test_an_interrupt_within_an_activity_has_the_same_result_as_just_before_or_just_after_it(
    stand: Stand, left_out: frozenset[int], victim: int, by: int
) -> None:
    if victim == preempt.MRAI and stand.loop.get("identification_mode") == ROBUST:
        pytest.skip("the robust identification has no interrupt of its own")
    with (
        restored_afterwards(stand.core),
        preempt.interrupt_from_both_sides(stand.core, victim, by, trigger(stand, by), left_out) as sides,
    ):
        assert sides.mixed == ()
        assert sides.before + sides.after == sides.instructions > 50
        if (victim, by) in READERS:
            assert not sides.same and sides.before > 0 and sides.after > 0
        else:
            assert sides.same


def test_a_gate_fault_is_latched_in_its_own_period_or_in_the_next(stand: Stand, left_out: frozenset[int]) -> None:
    core, loop, gate = stand.core, stand.loop, preempt.GATE
    with preempt.interrupt_from_both_sides(core, preempt.FAST, gate, trigger(stand, gate), left_out) as sides:
        core.restore(sides.snapshot_before)
        assert loop.get("fault_word") == GATE_FAULT
        core.restore(sides.snapshot_after)
        assert loop.get("fault_word") == 0
        core.pend(preempt.FAST)
        preempt.Stepper(core).run((preempt.FAST, False))
        assert loop.get("fault_word") == GATE_FAULT
        assert core.register("FTM0.SWOCTRL") == 0x3F  # all six outputs forced low


def test_a_frame_that_comes_within_the_task_is_taken_by_it_or_waits_for_the_next(
    stand: Stand, left_out: frozenset[int]
) -> None:
    core, can = stand.core, preempt.CAN
    with (
        restored_afterwards(core),
        preempt.interrupt_from_both_sides(core, preempt.TASK, can, trigger(stand, can), left_out) as sides,
    ):
        core.restore(sides.snapshot_before)
        taken, put = core.word("taken"), core.word("put")
        assert taken == put
        core.restore(sides.snapshot_after)
        assert (core.word("taken"), core.word("put")) == (taken - 1, put)
        preempt.Stepper(core).run((preempt.TASK, True), (preempt.TASK, False))
        assert core.word("taken") == put
