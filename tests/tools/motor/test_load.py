# SPDX-License-Identifier: Apache-2.0
"""Bus and processor load in the report of a motor."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fluxtrue_tools.errors import FluxtrueError
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
    monkeypatch.setattr(load, "cycles", lambda: Cycles(560.0, 224.0, 16800.0))
    text = "\n".join(load_lines(load_motor(write(inverter={"pwm_hz": 20000.0}))))
    assert re.search(r"processor load: 25\.0 % ", text)
    assert re.search(r"fast ISR +10\.0 % at 20000 Hz", text)
    assert re.search(r"1 kHz task +15\.0 % at 1000 Hz", text)


def test_a_field_that_turns_far_costs_what_its_law_costs(
    write: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four pole pairs at 6000 rpm and 5 kHz turn 0.5 rad per period: 784 cycles take 3.5 %."""
    monkeypatch.setattr(load, "cycles", lambda: Cycles(560.0, 224.0, 16800.0))
    turning = load_motor(write(inverter={"pwm_hz": 5000.0}))
    assert turning.config.is_turning
    text = "\n".join(load_lines(turning))
    assert re.search(r"processor load: 18\.5 % ", text)
    assert re.search(r"fast ISR +3\.5 % at 5000 Hz, with current_control_turning\.c", text)


def test_the_cycles_are_those_that_the_bench_has_written_down() -> None:
    found = load.cycles()
    assert found is not None and 100.0 < found.fast_isr < 1000.0 < found.task < 50000.0
    assert found.turning is not None and 50.0 < found.turning < 3.0 * found.fast_isr


@pytest.fixture
def figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Another file of figures."""
    path = tmp_path / "performance.json"
    monkeypatch.setattr(load, "PERFORMANCE", path)
    load.cycles.cache_clear()
    yield path
    load.cycles.cache_clear()


def test_figures_without_the_turning_law_are_refused_for_the_motors_that_need_it(
    figures: Path, write: Callable[..., Path]
) -> None:
    """Only for them, because the bench that writes the figures reads hsm1's report itself."""
    spread = {"cycles": [600, 650.0, 700]}
    figures.write_text(json.dumps({"drives": {"robust": {"runs": {"fast ISR": spread, "1 kHz task": spread}}},
                                   "kernels": {}}), encoding="utf-8")  # fmt: skip
    assert "processor load" in "\n".join(load_lines(load_motor(write())))
    with pytest.raises(FluxtrueError, match=r"performance\.json: .*_turning\.c are missing.*fluxtrue bench --update"):
        load_lines(load_motor(write(inverter={"pwm_hz": 5000.0})))


def test_an_installation_without_figures_has_no_processor_load(figures: Path, write: Callable[..., Path]) -> None:
    assert not figures.exists() and load.cycles() is None
    assert len(load_lines(load_motor(write()))) == 1
