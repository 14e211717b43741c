# SPDX-License-Identifier: Apache-2.0
"""The image reacts to failures as specified, and each check finds its planted errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import image_checks as checks
import pytest
from planting import PlantedError, assert_passes_without_error, image_with_error

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import EmulationStoppedError

# Enables the fault input long before the fault control, which therefore misses the edge of a line that is active.
EARLY_INPUT = """    FTM0->FLTPOL = FTM_FLTPOL_FLT0POL;
    FTM0->FLTCTRL = 0x411;
    for (volatile int k = 0; k < 20; k++) {
    }
"""
PLANTED_ERRORS: dict[str, tuple[Callable[[Parts], None], PlantedError]] = {
    "fault control of the even channels only": (
        checks.a_gate_fault_switches_off_every_output_within_the_filter_time,
        PlantedError("pwm.c", "#define ALL_CHANNELS_MANUAL 2U", "#define ALL_CHANNELS_MANUAL 1U"),
    ),
    "no fault control of phase c": (
        checks.a_gate_fault_switches_off_every_output_within_the_filter_time,
        PlantedError("pwm.c", "PAIR(1) | PAIR(2) |", "PAIR(1) | (PAIR(2) & ~FTM_COMBINE_FAULTEN2) |"),
    ),
    "the longest filter of the fault input": (
        checks.a_gate_fault_switches_off_every_output_within_the_filter_time,
        PlantedError("pwm.c", "#define FAULT_FILTER 4U", "#define FAULT_FILTER 15U"),
    ),
    "inverted polarity of the fault input": (
        checks.a_gate_fault_switches_off_every_output_within_the_filter_time,
        PlantedError("pwm.c", "FTM0->FLTPOL = FTM_FLTPOL_FLT0POL;", "FTM0->FLTPOL = 0;"),
    ),
    "fault control enabled after the fault input": (
        checks.a_fault_line_that_is_active_at_power_on_keeps_the_outputs_off,
        PlantedError("pwm.c", "    configure_faults();\n", EARLY_INPUT + "    configure_faults();\n"),
    ),
    "the PWM continues while the core is halted": (
        checks.a_halted_core_switches_off_every_output,
        PlantedError("pwm.c", "FTM_CONF_BDMMODE(SAFE_IN_DEBUG)", "FTM_CONF_BDMMODE(3U)"),
    ),
    "the PWM stops while the core is halted, but its outputs stay as they are": (
        checks.a_halted_core_switches_off_every_output,
        PlantedError("pwm.c", "FTM_CONF_BDMMODE(SAFE_IN_DEBUG)", "FTM_CONF_BDMMODE(0U)"),
    ),
    "the slow results are not read": (
        checks.every_period_is_sampled,
        PlantedError("sampling.c", "    (void)fx_read_two(&ADC0->R[WINDING]);\n", ""),
    ),
    "sequence errors do not interrupt": (
        checks.sampling_recovers_from_an_unread_result,
        PlantedError("main.c", "    enable(IRQ_PDB0, PRIORITY_FAST);\n    enable(IRQ_PDB1, PRIORITY_FAST);\n", ""),
    ),
    "a sequence error does not release the locks": (
        checks.sampling_recovers_from_an_unread_result,
        PlantedError("sampling.c", "    pdb->SC = 0;\n", ""),
    ),
    "the reserve of the stack is not checked": (
        checks.a_stack_that_uses_its_reserve_resets,
        PlantedError("main.c", "if (stack_measure() < STACK_RESERVE)", "if (stack_measure() < 4U)"),
    ),
    "the thermistor's range ends below the trip": (
        checks.a_winding_at_the_end_of_its_line_trips,
        PlantedError("ntc.c", "count < node[NODES - 1]", "count < node[19]"),
    ),
    "the inverter's thermistor is read from the winding's channel": (
        checks.an_inverter_at_the_end_of_its_line_trips,
        PlantedError("temperature.c", "ntc_dC(sampling_inverter())", "ntc_dC(sampling_winding())"),
    ),
    "the bandgap is not read": (
        checks.a_wrong_reference_of_the_converters_is_found,
        PlantedError("sampling.c", "reference_permille((uint16_t)ADC1->R[KNOWN])", "1000"),
    ),
    "the latch of the fault input is never ended": (
        checks.a_shorted_switch_ends_in_the_short_circuit_on_its_side,
        PlantedError("pwm.c", "    if (is_fault_over()) {\n", "    if (is_fault_over() && !ended_by_fault) {\n"),
    ),
    "the latch of the fault input is not ended while switching is enabled": (
        checks.a_short_circuit_that_the_drivers_end_is_made_on_the_other_side,
        PlantedError("pwm.c", "again = on && ended_by_fault", "again = !on && ended_by_fault"),
    ),
    "the gates read back as they were commanded": (
        checks.the_gates_are_read_back_at_their_pins,
        PlantedError("pwm.c", "    return is_one_of_each_pair(seen);", "    return true;"),
    ),
    "no code cache": (
        checks.the_code_cache_is_on,
        PlantedError("clock.c", "LMEM->LMEM_PCCCR = LMEM_PCCCR_ENCACHE;", "LMEM->LMEM_PCCCR = 0;"),
    ),
}
# The line at rest keeps every output off, so that the drive makes no torque in the first place.
NO_TORQUE = "inverted polarity of the fault input"


@pytest.fixture(scope="module")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1")


@pytest.mark.parametrize("check", checks.CHECKS, ids=lambda check: check.__name__)
def test_the_image_passes_each_check(parts: Parts, check: Callable[[Parts], None]) -> None:
    check(parts)


@pytest.mark.parametrize("name", PLANTED_ERRORS)
def test_a_planted_error_is_found(parts: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED_ERRORS[name]
    assert_passes_without_error(check, parts)
    planted = replace(parts, image=image_with_error(parts.image, [error], tmp_path))
    with pytest.raises((AssertionError, EmulationStoppedError)) as found:
        check(planted)
    places = [entry.name for entry in found.traceback if entry.path == Path(checks.__file__)]
    assert places[-1] == (check.__name__ if name != NO_TORQUE else checks.driving.__name__)


def test_each_check_has_a_planted_error() -> None:
    assert {check for check, _ in PLANTED_ERRORS.values()} == set(checks.CHECKS)
