# SPDX-License-Identifier: Apache-2.0
"""The bounds of the handlers' execution times beside what the emulated drive executes; wrong annotations are found."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import pytest

from fluxtrue_tools.bench import build, figures, image
from fluxtrue_tools.emulate import build as emulation
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet import facts, observed, worst
from fluxtrue_tools.wcet.bound import INSTRUCTIONS, Image
from fluxtrue_tools.wcet.worst import Worst

DRIVE = image.DRIVE[:4]  # torque of both signs at 3000 rpm up to the limit; the bench drives and checks all of it


@dataclass
class Measured:
    """Bounds, and the rows of the emulated drive with what exceeds a bound."""

    data: dict[str, Any]
    pointers: dict[str, list[str]]
    worst: Worst
    runs: dict[str, dict[str, list[float]]]
    watch: observed.Watch

    def again(self, data: dict[str, Any]) -> Worst:
        """The bounds with other annotations, of instructions only."""
        return worst.bounds(self.worst.image, data, self.pointers, (INSTRUCTIONS,))


@pytest.fixture(scope="module")
def measured() -> Measured:
    if not build.have_arm_compiler():
        pytest.skip(f"{build.ARM_CC} is not installed: there is no image")
    parts = emulation.prepare("hsm1", flashed=True)
    of = Image.read(parts.image)
    data, pointers = facts.load(), figures.pointers(figures.budget(), of.functions)
    bounds = worst.bounds(of, data, pointers)
    watch = observed.Watch(bounds.plan())
    recording = image.record(parts, of.all, figures.MODES["robust"], watch, DRIVE)
    runs = {name: figures._row(recording.of(vector), recording.reactions_of(vector))
            for name, vector in figures.INTERRUPTS.items() if len(recording.of(vector)) > 0}  # fmt: skip
    return Measured(data, pointers, bounds, runs, watch)


def test_no_handler_executed_more_than_its_bound(measured: Measured) -> None:
    assert set(measured.runs) == {"fast ISR", "CAN ISR", "1 kHz task"}
    assert worst.exceeded(measured.worst.figures["driving"], measured.runs) == []
    assert worst.exceeded(measured.worst.figures["anything"], measured.runs) == []


def test_a_bound_below_what_was_executed_is_named(measured: Measured) -> None:
    too_small = copy.deepcopy(measured.worst.figures["driving"])
    executed = int(measured.runs["1 kHz task"]["instructions"][2])
    too_small["1 kHz task"]["instructions"] = executed - 1
    found = worst.exceeded(too_small, measured.runs)
    assert found == [f"1 kHz task: {executed} instructions were executed, the bound is {executed - 1}"]


def test_the_emulated_drive_exceeds_no_annotation(measured: Measured) -> None:
    assert measured.worst.mismatches(measured.watch) == []
    entered, loops = observed.entered(measured.worst.image, measured.worst.reached, measured.watch)
    assert loops > entered > 40


@pytest.mark.parametrize(
    ("function", "statement", "passes"),
    [
        ("e2e_crc", "for (unsigned n", 7),
        ("project_covariance", "for (unsigned j", 7),
        ("kalman_predict", "for (unsigned l", 7),
    ],
)
def test_the_passes_of_a_loop_are_counted_each_time_it_is_entered(
    measured: Measured, function: str, statement: str, passes: int
) -> None:
    bounds = measured.worst
    loops = [one for name in bounds.reached for one in bounds.image.loops(name)]
    ours = [one for one in loops if one.statement and one.statement.function == function]
    seen = {measured.watch.most[one.loop.header] - int(one.tests_first)
            for one in ours if one.statement and one.statement.text.startswith(statement)}  # fmt: skip
    assert seen == {passes}


@pytest.mark.parametrize(("key", "most"), [("identify_add_share", 16), ("e2e_crc", 6)])
def test_an_annotation_that_is_too_small_is_found_by_the_emulated_drive(
    measured: Measured, key: str, most: int
) -> None:
    data = copy.deepcopy(measured.data)
    data["loops"][key] = most
    found = measured.again(data).mismatches(measured.watch)
    assert any(f"the loop of {key}, " in line and f"not at most {most}" in line for line in found), found


def test_code_that_a_mode_excludes_but_the_drive_executes_is_found(measured: Measured) -> None:
    data = copy.deepcopy(measured.data)
    data["modes"]["driving"]["absent"].append("kalman_update")
    found = measured.again(data).mismatches(measured.watch)
    assert any("ran, which driving excludes" in line for line in found), found


@pytest.mark.parametrize("key", ["memset: 74", "hal_pwm_gates"])
def test_a_loop_without_a_bound_fails_with_function_and_line(measured: Measured, key: str) -> None:
    data = copy.deepcopy(measured.data)
    del data["loops"][key], data["modes"]
    function, _, line = key.partition(": ")
    with pytest.raises(FluxtrueError, match=rf"no bound for the loop of {function}, [\w.]+:{line or '[0-9]+'}"):
        measured.again(data)


def test_a_copy_without_a_length_and_an_annotation_without_a_loop_fail(measured: Measured) -> None:
    data = copy.deepcopy(measured.data)
    del data["copies"]["upload"], data["modes"]
    data["loops"]["no_such_function"] = 3
    with pytest.raises(FluxtrueError, match="no length for the copy in upload") as error:
        measured.again(data)
    assert "nothing in the image is described by 'no_such_function'" in str(error.value)


def test_a_call_through_a_pointer_must_be_listed(measured: Measured) -> None:
    with pytest.raises(FluxtrueError, match="a call through a pointer is not listed"):
        worst.bounds(measured.worst.image, measured.data | {"modes": {}}, {}, (INSTRUCTIONS,))
