# SPDX-License-Identifier: Apache-2.0
"""The report's figures of the current loop: open loop by model and by injection, steps in simulation."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.motor.current_loop import Response, model_response
from fluxtrue_tools.motor.current_steps import AXES, STEP, Step
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.loop_report import (
    inductance_named,
    law_of,
    margins_named,
    model_margins,
    overshoot_named,
    speed_named,
)
from fluxtrue_tools.motor.margins import margins
from fluxtrue_tools.motor.measured import LOOP_INDUCTANCES, STEP_INDUCTANCES, STEP_SPEEDS, Measured
from fluxtrue_tools.motor.motor import Motor

COLOURS = ("tab:red", "tab:green", "tab:blue")
GAIN_DB = (-40.0, 40.0)
BELOW = -0.12  # of a panel's height: its legend lies outside, because the currents may be anywhere


def _label(motor: Motor, share: float, inductance: float, measured: Response | None) -> str:
    by_injection = "" if measured is None else f" (measured {margins_named(margins(measured))})"
    return f"{inductance_named(inductance)}: {margins_named(model_margins(motor, share, inductance))}{by_injection}"


def _direction(response: Response, sign: int) -> tuple[Array, Array, Array]:
    """Frequency, gain in dB and phase in degrees of one direction of rotation."""
    order = np.argsort(np.abs(response.frequency_Hz))
    order = order[np.sign(response.frequency_Hz[order]) == sign]
    values = response.gain[order] if sign > 0 else np.conj(response.gain[order])
    degrees = np.degrees(np.unwrap(np.angle(values)))
    return np.abs(response.frequency_Hz[order]), 20 * np.log10(np.abs(values)), degrees


def _bode(gain: Axes, phase: Axes, sign: int, model: Response, measured: Response | None, colour: str) -> None:
    """One direction; the phase of the model begins between -270° and 90°, that of the measurement is beside it."""
    frequency, gain_dB, degrees = _direction(model, sign)
    degrees -= 360.0 * np.floor((degrees[0] + 270.0) / 360.0)
    gain.plot(frequency, gain_dB, colour)
    phase.plot(frequency, degrees, colour)
    if measured is not None:
        style = {"color": colour, "marker": "o", "ms": 4, "ls": "", "mfc": "none"}
        at, found_dB, found = _direction(measured, sign)
        beside = np.interp(np.log(at), np.log(frequency), degrees)
        gain.plot(at, found_dB, **style)
        phase.plot(at, found + 360.0 * np.round((beside - found) / 360.0), **style)


def _columns(motor: Motor) -> list[tuple[float, int, str]]:
    """Standstill looks the same in both directions."""
    top = speed_named(motor, 1.0)
    return [(0.0, 1, "standstill"), (1.0, 1, f"{top}, with the field"), (1.0, -1, f"{top}, against the field")]


def current_loop_figure(motor: Motor, measured: Measured) -> Figure:
    """Bode plot of the open loop at standstill and at top speed, over the inductances' error."""
    figure, axes = plt.subplots(2, 3, figsize=(15, 8), layout="constrained", sharex=True, sharey="row")
    for column, (share, sign, title) in enumerate(_columns(motor)):
        gain, phase = axes[:, column]
        speed_rpm = share * motor.config.machine.speed_max_rpm
        for inductance, colour in zip(LOOP_INDUCTANCES, COLOURS, strict=True):
            found = measured.loops.get((share, inductance))
            _bode(gain, phase, sign, model_response(motor, speed_rpm, inductance), found, colour)
            gain.plot([], [], colour, label=_label(motor, share, inductance, found))
        gain.axhline(0.0, color="k", lw=0.6)
        phase.axhline(-180.0, color="k", lw=0.6)
        gain.set_title(f"Open current loop, {title}")
        phase.set(xlabel="frequency in the rotor's frame, Hz", xscale="log")
        for ax in (gain, phase):
            ax.grid(alpha=0.3)
        gain.legend(fontsize=8, title="phase and gain margin, both directions", title_fontsize=8, loc="lower left")
    axes[0, 0].set(ylabel="gain, dB", ylim=GAIN_DB)
    axes[1, 0].set(ylabel="phase, °")
    points = "; circles: measured by injection, firmware in simulation" if measured.loops else ""
    figure.suptitle(f"Lines: sampled linear model of {law_of(motor)}{points}")
    return figure


def _draw_step(ax: Axes, step: Step, colour: str, label: str) -> None:
    time_ms = 1e3 * step.time_s
    for axis, values in step.change_A.items():
        own = axis == step.axis
        ax.plot(
            time_ms, values, color=colour, ls="-" if own else ":", lw=1.5 if own else 1, label=label if own else None
        )


def _step_panel(ax: Axes, motor: Motor, measured: Measured, share: float, axis: str) -> None:
    other = AXES[1 - AXES.index(axis)]
    step = None
    for inductance, colour in zip(STEP_INDUCTANCES, COLOURS, strict=True):
        if (share, inductance) in measured.steps:
            step = measured.steps[share, inductance][axis]
            _draw_step(ax, step, colour, f"{inductance_named(inductance)}: overshoot {overshoot_named(step)}")
    if step is not None:
        reference = np.where(step.time_s >= 0.0, step.step_A, 0.0)
        ax.step(1e3 * step.time_s, reference, "k--", where="post", lw=0.8, label=f"i_{axis} reference")
        ax.plot([], [], color="tab:gray", ls=":", lw=1, label=f"i_{other}")
    ax.set(title=f"Step of i_{axis}, {speed_named(motor, share)}", ylabel="change of the current, A")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, ncols=2, loc="upper center", bbox_to_anchor=(0.5, BELOW))


def step_figure(motor: Motor, measured: Measured) -> Figure:
    """Both axes at standstill and at half of the top speed."""
    figure, axes = plt.subplots(2, 2, figsize=(12, 9.5), layout="constrained", sharex=True)
    for row, axis in enumerate(AXES):
        for column, share in enumerate(STEP_SPEEDS):
            _step_panel(axes[row, column], motor, measured, share, axis)
    for ax in axes[-1]:
        ax.set_xlabel("time since the reference changed, ms")
    figure.suptitle(f"Steps of {100 * STEP:g} % of i_max_A within one period: firmware in simulation, currents of the "
                    "machine")  # fmt: skip
    return figure
