# SPDX-License-Identifier: Apache-2.0
"""Bus and processor load in the report of a motor."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from fluxtrue_tools.motor import load
from fluxtrue_tools.motor.load import Cycles, bus_load, frame_bits, load_lines
from fluxtrue_tools.motor.motor import load_motor


@pytest.mark.parametrize(("length", "bits"), [(0, 55), (1, 65), (8, 135)])
def test_the_longest_frame_with_all_its_stuff_bits(length: int, bits: int) -> None:
    """By hand: a frame of 8 bytes has 44 + 64 bits, 24 stuff bits and 3 bits between frames."""
    assert frame_bits(length) == bits


def test_the_inverters_frames_are_a_part_of_all() -> None:
    assert 0.05 < bus_load("INV") < bus_load() < 0.7
    assert bus_load("VCU_X") == 0.0


def test_the_processor_load_is_cycles_times_frequency(
    write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 112 MHz and 20 kHz a fast ISR of 560 cycles takes 10 %, and a task of 16,800 cycles each millisecond 15 %."""
    monkeypatch.setattr(load, "cycles", lambda: Cycles(560.0, 16800.0))
    text = "\n".join(load_lines(load_motor(write(inverter={"pwm_hz": 20000.0}))))
    assert re.search(r"processor load: 25\.0 % ", text)
    assert re.search(r"fast ISR +10\.0 % at 20000 Hz", text)
    assert re.search(r"1 kHz task +15\.0 % at 1000 Hz", text)
    monkeypatch.setattr(load, "cycles", lambda: None)
    assert len(load_lines(load_motor(write()))) == 1


def test_the_cycles_are_those_that_the_bench_has_written_down() -> None:
    found = load.cycles()
    assert found is not None and 100.0 < found.fast_isr < 1000.0 < found.task < 50000.0
