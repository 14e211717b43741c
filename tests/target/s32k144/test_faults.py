# SPDX-License-Identifier: Apache-2.0
"""The image reacts to failures as specified, and each of these checks finds its planted error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import image_checks as checks
import pytest
from planting import Plant, plant

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import EmulationStoppedError

# Enabled so long before the fault control that the edge of a line that is active already passes unseen.
EARLY_INPUT = """    FTM0->FLTPOL = FTM_FLTPOL_FLT0POL;
    FTM0->FLTCTRL = 0x411;
    for (volatile int k = 0; k < 20; k++) {
    }
"""
PLANTS: dict[str, tuple[Callable[[Parts], None], Plant]] = {
    "fault control of the even channels only": (
        checks.a_gate_fault_opens_every_output_in_the_filter_time,
        Plant("pwm.c", "#define ALL_CHANNELS_MANUAL 2U", "#define ALL_CHANNELS_MANUAL 1U"),
    ),
    "no fault control of phase c": (
        checks.a_gate_fault_opens_every_output_in_the_filter_time,
        Plant("pwm.c", "PAIR(1) | PAIR(2) |", "PAIR(1) | (PAIR(2) & ~FTM_COMBINE_FAULTEN2) |"),
    ),
    "no filter of the fault input, but the longest": (
        checks.a_gate_fault_opens_every_output_in_the_filter_time,
        Plant("pwm.c", "#define FAULT_FILTER 4U", "#define FAULT_FILTER 15U"),
    ),
    "fault input of the other polarity": (
        checks.a_gate_fault_opens_every_output_in_the_filter_time,
        Plant("pwm.c", "FTM0->FLTPOL = FTM_FLTPOL_FLT0POL;", "FTM0->FLTPOL = 0;"),
    ),
    "fault control on after its input": (
        checks.a_fault_line_that_is_up_at_power_on_keeps_the_outputs_off,
        Plant("pwm.c", "    configure_faults();\n", EARLY_INPUT + "    configure_faults();\n"),
    ),
    "the PWM runs on while the core is halted": (
        checks.a_halted_core_opens_every_output,
        Plant("pwm.c", "FTM_CONF_BDMMODE(SAFE_IN_DEBUG)", "FTM_CONF_BDMMODE(3U)"),
    ),
    "the PWM stops while the core is halted, its outputs as they are": (
        checks.a_halted_core_opens_every_output,
        Plant("pwm.c", "FTM_CONF_BDMMODE(SAFE_IN_DEBUG)", "FTM_CONF_BDMMODE(0U)"),
    ),
    "the slow results are not read": (
        checks.every_period_is_sampled,
        Plant("sampling.c", "    (void)fx_read_two(&ADC0->R[WINDING]);\n", ""),
    ),
    "sequence errors do not interrupt": (
        checks.a_result_that_was_not_read_is_got_over,
        Plant("main.c", "    enable(IRQ_PDB0, PRIORITY_FAST);\n    enable(IRQ_PDB1, PRIORITY_FAST);\n", ""),
    ),
    "a sequence error leaves the locks": (
        checks.a_result_that_was_not_read_is_got_over,
        Plant("sampling.c", "    pdb->SC = 0;\n", ""),
    ),
    "the stack is not watched": (
        checks.a_stack_near_its_end_resets,
        Plant("main.c", "if (stack_measure() < STACK_RESERVE)", "if (stack_measure() < 4U)"),
    ),
    "no code cache": (
        checks.the_code_cache_is_on,
        Plant("clock.c", "LMEM->LMEM_PCCCR = LMEM_PCCCR_ENCACHE;", "LMEM->LMEM_PCCCR = 0;"),
    ),
}


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1")


@pytest.mark.parametrize("check", checks.CHECKS, ids=lambda check: check.__name__)
def test_the_image_holds(parts: Parts, check: Callable[[Parts], None]) -> None:
    check(parts)


@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_error_is_found(parts: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTS[name]
    planted = replace(parts, image=plant(parts.image, error, tmp_path))
    with pytest.raises((AssertionError, EmulationStoppedError)):
        check(planted)


def test_each_check_has_found_an_error() -> None:
    assert {check for check, _ in PLANTS.values()} == set(checks.CHECKS)
