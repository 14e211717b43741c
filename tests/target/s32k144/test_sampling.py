# SPDX-License-Identifier: Apache-2.0
"""The task reads results of the converters again (hal_adc_latest). A read clears the flag of a complete conversion,
which is the fast ISR's request: it must not cost a period even where it comes between the flag and the interrupt."""

from __future__ import annotations

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import CENTRE, Core

FAST = 16 + 39
COCO = 0x80
PERIOD_S = 1e-4
ENDS_S = 2 * (3 / 112e6 + 38 / 28e6)  # of i_a and i_c: two triggers and two conversions after the period's start
ERRORS = 0xFF


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", flashed=True)


def to_the_next_period(core: Core) -> None:
    assert core.run(1.01 * PERIOD_S) == CENTRE


def run_until_complete(core: Core) -> None:
    """To the first instruction before which i_c is complete; the interrupt is pending there and not taken yet."""
    start = core.save()
    for nanoseconds in range(-60, 20, 2):
        core.restore(start)
        core.run(ENDS_S + 1e-9 * nanoseconds)
        if core.register("ADC0.SC11") & COCO:
            break
    core.free(start)
    assert core.register("ADC0.SC11") & COCO
    assert core.active_vector != FAST


@pytest.mark.parametrize("read", [False, True], ids=["not read", "read"])
def test_a_read_before_the_interrupt_loses_no_period(parts: Parts, read: bool) -> None:
    with Core.of_program(parts.emulated().library, parts.image, counting=True) as core:
        assert core.run(0.1) == CENTRE
        for _ in range(20):
            runs = core.counts(FAST).runs
            run_until_complete(core)
            if read:
                core.load("ADC0.R1")  # as the task would
            assert (core.register("ADC0.SC11") & COCO == 0) == read
            to_the_next_period(core)
            assert core.counts(FAST).runs == runs + 1
            assert core.register("PDB0.CH0S") & ERRORS == 0
