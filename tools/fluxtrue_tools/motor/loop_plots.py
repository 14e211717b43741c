# SPDX-License-Identifier: Apache-2.0
"""The report's figure of the current loop."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from fluxtrue_tools.motor.current_loop import current_loop, frequencies_Hz
from fluxtrue_tools.motor.motor import Motor

POINTS = 400
INDUCTANCES = ((0.75, "tab:red"), (1.0, "tab:green"), (1.25, "tab:blue"))


def current_loop_figure(motor: Motor) -> Figure:
    """Bode plot of the open loop at standstill and at top speed, over the inductances' error."""
    top_rpm = motor.config.machine.speed_max_rpm
    figure, axes = plt.subplots(2, 2, figsize=(12, 7), layout="constrained", sharex=True, sharey="row")
    frequency = frequencies_Hz(motor, POINTS)
    z = np.exp(2j * np.pi * frequency / motor.config.inverter.pwm_hz)
    for column, (speed_rpm, title) in enumerate(((0.0, "standstill"), (top_rpm, f"{top_rpm:g} rpm"))):
        gain, phase = axes[:, column]
        for inductance, colour in INDUCTANCES:
            loop = current_loop(motor, speed_rpm, inductance)
            margin = f"{loop.margins()[0]:.0f}°" if loop.largest_pole() < 1.0 else "unstable"
            label = f"L {100 * inductance - 100:+.0f} %: phase margin {margin}"
            gain.plot(frequency, 20 * np.log10(np.abs(loop.gain(z))), colour, label=label)
            phase.plot(frequency, np.degrees(np.unwrap(np.angle(loop.gain(z)))), colour)
        gain.axhline(0.0, color="k", lw=0.6)
        gain.set_title(f"Open current loop at {title}")
        gain.legend(fontsize=8)
        phase.set(xlabel="frequency in the rotor's frame, Hz", xscale="log")
        for ax in (gain, phase):
            ax.grid(alpha=0.3)
    axes[0, 0].set_ylabel("gain, dB")
    axes[1, 0].set_ylabel("phase, °")
    law = "current_control_turning.c" if motor.config.is_turning else "current_control.c"
    figure.suptitle(f"Linear model of {law}, no resistance; margins over the frequencies of both signs")
    return figure
