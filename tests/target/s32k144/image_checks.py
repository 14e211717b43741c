# SPDX-License-Identifier: Apache-2.0
"""What an image of the S32K144 must do on the emulated processor. Each check raises an exception if it does not.

test_faults.py applies all checks to the image, and to images with planted errors, which the checks must find.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import CENTRE, Core, State
from fluxtrue_tools.sim.library import Loop

PERIOD_S = 1e-4
FILTER_S = 8 / 112e6  # hal/s32k144/README.md, PWM: 4 + FFVAL cycles of the timer's clock
SLACK_S = 1 / 112e6
ALL_OUTPUTS, NO_OUTPUTS = 0x3F, 0
DRIVING_NM = 80.0
WINDING_TRIP_C = 230.0  # firmware/motors/hsm1/motor.toml
INVERTER_TRIP_C = 105.0  # its default
INPUT, TEMPERATURE, GATE = 1 << 5, 1 << 14, 1 << 15
FAULTF = 0x80
ENCACHE = 1
ADC0_IRQ, PDB0_IRQ, PDB1_IRQ = 39, 52, 68
CONVERSION_COMPLETE = 0x80
GPIO = 1 << 8


@contextmanager
def driving(parts: Parts) -> Iterator[tuple[Loop, Core]]:
    """A simulated drive that makes torque at 3000 rpm, and its emulated processor."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", DRIVING_NM)
        loop.run(500)
        assert loop.get("fault_word") == 0
        assert loop.get("truth.torque_Nm") > 50
        core = Core.of_simulation(motor.library, loop._sim)
        assert core.outputs == ALL_OUTPUTS
        yield loop, core


@contextmanager
def alone(parts: Parts) -> Iterator[Core]:
    """The processor without a simulated drive, just out of reset."""
    with Core.of_program(parts.emulated().library, parts.image) as core:
        yield core


def started(core: Core) -> None:
    assert core.run(0.1) == CENTRE


def run(core: Core, seconds: float) -> int:
    """Run for this time; return the number of PWM periods that began in it."""
    end, periods = core.now_s + seconds, 0
    while end - core.now_s > SLACK_S:
        periods += core.run(end - core.now_s) == CENTRE
    return periods


def a_gate_fault_switches_off_every_output_within_the_filter_time(parts: Parts) -> None:
    """The timer must not need the core: the test is repeated with a core that executes nothing."""
    for state in (State.RUNS, State.STUCK):
        with driving(parts) as (_, core):
            core.run(0.4 * PERIOD_S)
            core.core_state(state)
            assert core.outputs == ALL_OUTPUTS
            core.board(gate_fault=True)
            core.run(FILTER_S)
            assert core.outputs == NO_OUTPUTS, f"outputs 0x{core.outputs:02x}, state of the core: {state.name}"


def a_fault_line_that_is_active_at_power_on_keeps_the_outputs_off(parts: Parts) -> None:
    """The line is active from reset on: its edge comes when the program enables the fault input."""
    with alone(parts) as core:
        core.board(gate_fault=True)
        started(core)
        run(core, 0.01)
        assert core.load("FTM0.FMS") & FAULTF
        assert core.outputs == NO_OUTPUTS


def a_halted_core_switches_off_every_output(parts: Parts) -> None:
    with driving(parts) as (_, core):
        core.run(0.4 * PERIOD_S)
        core.core_state(State.HALTED)
        assert core.outputs == NO_OUTPUTS


def every_period_is_sampled(parts: Parts) -> None:
    with alone(parts) as core:
        started(core)
        entered = _entries(core)
        periods = run(core, 0.02)
        assert abs(entered.get(ADC0_IRQ, 0) - periods) <= 1
        assert core.resets == 0


def sampling_recovers_from_an_unread_result(parts: Parts) -> None:
    with alone(parts) as core:
        started(core)
        run(core, 0.02)
        core.run(20e-6)
        core.set_register("ADC0.SC12", core.register("ADC0.SC12") | CONVERSION_COMPLETE)
        entered = _entries(core)
        periods = run(core, 0.02)
        assert periods - entered.get(ADC0_IRQ, 0) <= 3
        # More errors would mean that only their handler still pends the fast ISR.
        assert entered.get(PDB0_IRQ, 0) + entered.get(PDB1_IRQ, 0) <= 2
        assert core.resets == 0


def a_stack_that_uses_its_reserve_resets(parts: Parts) -> None:
    """A correct program never writes to the reserve at the end of the stack."""
    with alone(parts) as core:
        started(core)
        run(core, 0.02)
        core.write(core.symbol("stack_bottom") + 128, bytes(4))
        run(core, 0.05)
        assert core.resets >= 1


def the_code_cache_is_on(parts: Parts) -> None:
    with alone(parts) as core:
        started(core)
        assert core.register("LMEM.LMEM_PCCCR") & ENCACHE


def a_winding_at_the_end_of_its_line_trips(parts: Parts) -> None:
    """Through the counts of the thermistor; 110 ms are the confirmation."""
    with driving(parts) as (loop, core):
        loop.set("plant.winding_C", WINDING_TRIP_C - 6.0)
        loop.run(2000)
        assert loop.get("fault_word") == 0
        assert 10.0 < loop.get("truth.torque_Nm") < 0.7 * DRIVING_NM, "below the trip the torque is derated"
        loop.set("plant.winding_C", WINDING_TRIP_C + 10.0)
        loop.run(1300)
        assert int(loop.get("fault_word")) == TEMPERATURE
        assert core.outputs == NO_OUTPUTS
        assert abs(loop.get("truth.torque_Nm")) < 1.0


def an_inverter_at_the_end_of_its_line_trips(parts: Parts) -> None:
    """Likewise, through the second thermistor."""
    with driving(parts) as (loop, core):
        loop.set("emulator.inverter_C", INVERTER_TRIP_C - 6.0)
        loop.run(2000)
        assert loop.get("fault_word") == 0
        assert 10.0 < loop.get("truth.torque_Nm") < 0.7 * DRIVING_NM, "below the trip the torque is derated"
        loop.set("emulator.inverter_C", INVERTER_TRIP_C + 10.0)
        loop.run(1300)
        assert int(loop.get("fault_word")) == TEMPERATURE
        assert core.outputs == NO_OUTPUTS
        assert abs(loop.get("truth.torque_Nm")) < 1.0


def a_wrong_reference_of_the_converters_is_found(parts: Parts) -> None:
    """By the count of the bandgap; 10 ms are the confirmation."""
    with driving(parts) as (loop, core):
        loop.set("plant.converter_reference", 1.0 / 1.03)
        loop.run(300)
        assert loop.get("fault_word") == 0
        loop.set("plant.converter_reference", 1.0 / 1.1)
        loop.run(120)
        assert int(loop.get("fault_word")) == INPUT
        assert core.outputs == NO_OUTPUTS


def a_shorted_switch_ends_in_the_short_circuit_on_its_side(parts: Parts) -> None:
    """At the port: the three switches of that side on throughout the period, the others off."""
    for switch, duty in (("upper_a", 1.0), ("lower_b", 0.0)):
        with driving(parts) as (loop, core):
            loop.set(f"plant.switch_shorted_{switch}", 1)
            loop.run(2000)
            assert int(loop.get("fault_word")) & GATE
            assert core.outputs == ALL_OUTPUTS
            assert [core.duty(pair) for pair in range(3)] == 3 * [duty], switch
            assert abs(loop.get("truth.torque_Nm")) < 10.0, "the short circuit is symmetrical"


@contextmanager
def shorted_below(parts: Parts) -> Iterator[tuple[Loop, Core]]:
    """The short circuit by the lower switches, because one of them is shorted."""
    with driving(parts) as (loop, core):
        loop.set("plant.switch_shorted_lower_b", 1)
        loop.run(2000)
        assert core.outputs == ALL_OUTPUTS
        assert core.duty(0) == 0.0
        yield loop, core


def a_short_circuit_that_the_drivers_end_is_made_on_the_other_side(parts: Parts) -> None:
    """The defect moves from a lower switch to an upper one while the lower ones are on: the drivers end that."""
    with shorted_below(parts) as (loop, core):
        loop.set("plant.switch_shorted_lower_b", 0)
        loop.set("plant.switch_shorted_upper_a", 1)
        loop.run(10)
        assert core.outputs == ALL_OUTPUTS
        assert [core.duty(pair) for pair in range(3)] == 3 * [1.0]


def the_gates_are_read_back_at_their_pins(parts: Parts) -> None:
    """A lower output that no longer reaches its pin ends the short circuit on this side, although the timer runs."""
    with shorted_below(parts) as (loop, core):
        core.set_register("PORTD.PCR16", GPIO)
        loop.run(10)
        assert core.outputs == NO_OUTPUTS or core.duty(0) == 1.0


CHECKS = (
    the_gates_are_read_back_at_their_pins,
    a_gate_fault_switches_off_every_output_within_the_filter_time,
    a_fault_line_that_is_active_at_power_on_keeps_the_outputs_off,
    a_halted_core_switches_off_every_output,
    every_period_is_sampled,
    sampling_recovers_from_an_unread_result,
    a_stack_that_uses_its_reserve_resets,
    the_code_cache_is_on,
    a_winding_at_the_end_of_its_line_trips,
    an_inverter_at_the_end_of_its_line_trips,
    a_wrong_reference_of_the_converters_is_found,
    a_shorted_switch_ends_in_the_short_circuit_on_its_side,
    a_short_circuit_that_the_drivers_end_is_made_on_the_other_side,
)


def _entries(core: Core) -> dict[int, int]:
    """Counts the entries of each handler from now on, by interrupt number."""
    entered: dict[int, int] = {}

    def count_entry(vector: int, is_entry: bool) -> None:
        if is_entry:
            entered[vector - 16] = entered.get(vector - 16, 0) + 1

    core.on_exception(count_entry)
    return entered
