# SPDX-License-Identifier: Apache-2.0
"""Worker processes that fail or end, and the errors that they hand over."""

import multiprocessing
import os
import pickle
import signal
from collections.abc import Iterator
from functools import partial

import pytest

from fluxtrue_tools import errors
from fluxtrue_tools.campaign import schedule
from fluxtrue_tools.emulate import core  # noqa: F401 - defines an error
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import quantise  # noqa: F401
from fluxtrue_tools.sim.library import OUT_OF_RANGE, LoopError
from fluxtrue_tools.vecu import channel  # noqa: F401


def refused(case: int) -> None:
    raise LoopError("plant.vdc_V", float(case), OUT_OF_RANGE)


def ended(case: int) -> None:
    """Case 0 ends its process; the others never end."""
    if case == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    while True:
        signal.pause()


def test_a_value_that_the_simulation_refuses_in_a_worker_reaches_the_user() -> None:
    with pytest.raises(LoopError, match=r"^plant\.vdc_V = 3: out of range$") as raised:
        list(schedule.local(refused, [3], 1))
    assert (raised.value.name, raised.value.value, raised.value.code) == ("plant.vdc_V", 3.0, OUT_OF_RANGE)


def test_a_worker_that_was_killed_ends_the_campaign_and_the_other_workers() -> None:
    with pytest.raises(FluxtrueError, match="a process with a case has ended"):
        list(schedule.local(ended, [0, 1], 2))


def kinds(error: type[FluxtrueError]) -> Iterator[type[FluxtrueError]]:
    yield error
    for kind in error.__subclasses__():
        yield from kinds(kind)


@pytest.mark.parametrize("kind", list(kinds(errors.FluxtrueError)), ids=lambda kind: kind.__name__)
def test_every_error_for_the_user_passes_between_processes(kind: type[FluxtrueError]) -> None:
    given = ("name", 2.0, OUT_OF_RANGE) if kind is LoopError else ("a text",)
    error = kind(*given)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) != ""


def only_the_first_ends(case: int) -> int:
    if case:
        signal.pause()
    return case


def test_an_interrupted_campaign_does_not_wait_for_the_cases_that_run() -> None:
    results = schedule.local(only_the_first_ends, [0, 1], 2)
    assert next(results) == (0, 0)
    results.close()  # type: ignore[attr-defined]
    assert multiprocessing.active_children() == []


def of_a_large_campaign(campaign: bytes, case: int) -> int:
    assert campaign
    return only_the_first_ends(case)


def test_an_interrupted_campaign_ends_even_if_its_task_is_larger_than_a_pipe() -> None:
    """The thread that hands cases over must never wait for a worker that has been killed."""
    results = schedule.local(partial(of_a_large_campaign, bytes(2_000_000)), range(10), 2)
    assert next(results) == (0, 0)
    results.close()  # type: ignore[attr-defined]
    assert multiprocessing.active_children() == []


def same(case: int) -> int:
    return case


def test_only_a_few_cases_are_submitted_at_a_time() -> None:
    """With all of 100,000 at once the pool sometimes blocked for ever on a busy computer."""
    drawn: list[int] = []

    def cases() -> Iterator[int]:
        for case in range(100_000):
            drawn.append(case)
            yield case

    results = schedule.local(same, cases(), 1)
    assert next(results) == (0, 0)
    assert len(drawn) <= 2 * schedule.SUBMITTED_PER_WORKER
    results.close()  # type: ignore[attr-defined]


def test_every_case_is_run_once() -> None:
    assert sorted(schedule.local(same, range(50), 2)) == [(case, case) for case in range(50)]
