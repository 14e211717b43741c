# SPDX-License-Identifier: Apache-2.0
"""The report's lines on the current loop: margins of the model, and what has been measured in simulation."""

from collections.abc import Callable
from dataclasses import dataclass

from fluxtrue_tools.motor.current_loop import current_loop, model_response
from fluxtrue_tools.motor.current_steps import AXES, STEP, Step
from fluxtrue_tools.motor.margins import Margins, margins
from fluxtrue_tools.motor.measured import LOOP_INDUCTANCES, LOOP_SPEEDS, STEP_INDUCTANCES, STEP_SPEEDS, Measured
from fluxtrue_tools.motor.motor import Motor

Lines = list[str]
PHASE_MARGIN_MIN_DEG = 40.0  # what each machine keeps, with either law
MARGIN_SPEEDS = tuple(k / 8.0 for k in range(9))  # of the top speed


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


@dataclass(frozen=True)
class Lowest:
    """The lowest margins of the model, and where the phase margin is lowest."""

    phase_deg: float
    gain_dB: float
    share: float
    inductance: float


def lowest_margins(motor: Motor) -> Lowest | None:
    """Over speed and the inductances' error; None: somewhere the loop is unstable.

    The four quadrants are alike: the sign of i_q changes no inductance, and with the other sign of speed the model is
    its own mirror image, whose margins are the same.
    """
    found = []
    for share in MARGIN_SPEEDS:
        for inductance in LOOP_INDUCTANCES:
            margin = model_margins(motor, share, inductance)
            if margin is None:
                return None
            found.append((margin.phase_deg, margin.gain_dB, share, inductance))
    phase_deg, _, share, inductance = min(found)
    return Lowest(phase_deg, min(gain_dB for _, gain_dB, _, _ in found), share, inductance)


def lowest_named(motor: Motor) -> str:
    """The line of the report."""
    found = lowest_margins(motor)
    if found is None:
        return "unstable"
    where = f"{speed_named(motor, found.share)}, {inductance_named(found.inductance)}"
    return (f"{found.phase_deg:.0f}° ({where}), {found.gain_dB:.1f} dB, over speed, L ±25 % and all four quadrants; "
            f"{PHASE_MARGIN_MIN_DEG:g}° are demanded")  # fmt: skip


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
    each = _margin_lines(motor, lambda share, inductance: model_margins(motor, share, inductance))
    return [head, *each, f"  {'lowest':<18} {lowest_named(motor)}"]


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
