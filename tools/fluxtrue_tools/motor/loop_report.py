# SPDX-License-Identifier: Apache-2.0
"""The report's lines on the current loop: margins of the model, and what has been measured in simulation."""

from collections.abc import Callable

from fluxtrue_tools.motor.current_loop import current_loop, model_response
from fluxtrue_tools.motor.current_steps import AXES, STEP, Step
from fluxtrue_tools.motor.margins import Margins, margins
from fluxtrue_tools.motor.measured import LOOP_INDUCTANCES, LOOP_SPEEDS, STEP_INDUCTANCES, STEP_SPEEDS, Measured
from fluxtrue_tools.motor.motor import Motor

Lines = list[str]


def speed_named(motor: Motor, share: float) -> str:
    """A share of the top speed."""
    return f"{share * motor.config.machine.speed_max_rpm:g} rpm" if share else "standstill"


def inductance_named(inductance: float) -> str:
    """Against the data."""
    return f"L {100 * inductance - 100:+.0f} %" if inductance != 1.0 else "L of the data"


def model_margins(motor: Motor, share: float, inductance: float) -> Margins | None:
    """At a share of the top speed; None: the loop is unstable."""
    speed_rpm = share * motor.config.machine.speed_max_rpm
    if current_loop(motor, speed_rpm, inductance).largest_pole() >= 1.0:
        return None
    return margins(model_response(motor, speed_rpm, inductance))


def margins_named(found: Margins | None) -> str:
    """Phase and gain margin."""
    return "unstable" if found is None else f"{found.phase_deg:.0f}°, {found.gain_dB:.1f} dB"


def _margin_lines(motor: Motor, of: Callable[[float, float], Margins | None]) -> Lines:
    lines = []
    for share in LOOP_SPEEDS:
        each = {inductance: of(share, inductance) for inductance in LOOP_INDUCTANCES}
        own = each[1.0]
        crossover = "" if own is None else f"crossover {own.crossover_Hz:.0f} Hz, "
        others = "; ".join(f"{inductance_named(x)}: {margins_named(each[x])}" for x in each if x != 1.0)
        lines.append(f"  {speed_named(motor, share):<18} {crossover}{margins_named(own)} ({others})")
    return lines


def law_of(motor: Motor) -> str:
    """The source file of the motor's law of current control."""
    return "current_control_turning.c" if motor.config.is_turning else "current_control.c"


def model_lines(motor: Motor) -> Lines:
    """The lines of report.txt that need no simulation."""
    head = f"current loop: phase and gain margin of {law_of(motor)}, sampled linear model"
    return [head, *_margin_lines(motor, lambda share, inductance: model_margins(motor, share, inductance))]


def overshoot_named(step: Step) -> str:
    """Of a step, and whether it is one of the voltage limit instead of the loop."""
    return f"{100 * step.overshoot():.1f} %" + (" (voltage limit)" if step.is_limited else "")


def _step_lines(motor: Motor, measured: Measured) -> Lines:
    lines = [f"  steps of {100 * STEP:g} % of i_max_A, overshoot"]
    for share in STEP_SPEEDS:
        parts = []
        for inductance in STEP_INDUCTANCES:
            found = measured.steps.get((share, inductance))
            if found is not None:
                each = ", ".join(f"i_{axis} {overshoot_named(found[axis])}" for axis in AXES)
                parts.append(f"{inductance_named(inductance)}: {each}")
        if parts:
            lines.append(f"  {speed_named(motor, share):<18} {'; '.join(parts)}")
    return lines


def measured_text(motor: Motor, measured: Measured) -> str:
    """What follows the text of a motor whose current loop has been simulated, or why it has not been."""
    lines: Lines = []
    if measured.loops:
        lines += ["current loop: measured by injection, firmware in simulation"]
        found = {key: margins(response) for key, response in measured.loops.items()}
        lines += _margin_lines(motor, lambda share, inductance: found.get((share, inductance)))
    if measured.steps:
        lines += _step_lines(motor, measured)
    lines += [f"  not measured       {text}" for text in measured.missing]
    return "".join(line + "\n" for line in lines)
