# SPDX-License-Identifier: Apache-2.0
"""A signal ends a campaign although Python has discarded the exception of its handler."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from fluxtrue_tools import interrupts
from fluxtrue_tools.campaign import schedule

TESTS = Path(__file__).resolve().parents[2]


class Signalled:
    """The handler runs while the object is finalised, where Python prints exceptions and goes on."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)
        for _ in range(1000):  # the interpreter runs handlers at the jumps of a loop
            pass


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupts.install()
    yield
    interrupts._received.clear()
    for number, handler in before.items():
        signal.signal(number, handler)


def same(case: int) -> int:
    return case


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_whose_exception_is_lost_ends_a_campaign_at_its_next_case(number: signal.Signals) -> None:
    done = []
    ends = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: SystemExit}
    with pytest.raises(ends[number]) as raised:
        for case, _ in schedule.local(same, [0, 1, 2], 1):
            done.append(case)
            Signalled(number)
    assert done == [0]
    if number == signal.SIGTERM:
        assert raised.value.code == 143  # type: ignore[attr-defined]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_outside_of_finalisers_raises_at_once(number: signal.Signals) -> None:
    with pytest.raises((KeyboardInterrupt, SystemExit)):
        signal.raise_signal(number)


def test_a_gate_in_the_background_can_interrupt_what_it_starts() -> None:
    """Where SIGINT is ignored, as by a shell's background jobs, a campaign that a test ends would run for hours."""
    code = ("import runpy, signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN); runpy.run_path(sys.argv[1]);"
            "signal.raise_signal(signal.SIGINT)")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", code, TESTS / "conftest.py"], capture_output=True, check=False)
    assert done.returncode == -signal.SIGINT


def test_a_signal_that_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupts.install()
    signal.raise_signal(signal.SIGINT)
    interrupts.raise_if_received()
