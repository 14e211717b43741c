# SPDX-License-Identifier: Apache-2.0
"""A recording as one figure."""

import os
from pathlib import Path
from typing import Any

os.environ.setdefault("MPLBACKEND", "Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.sim.output import atomic
from fluxtrue_tools.sim.run import Recording

COMMAND, TRUTH, ESTIMATE, SECOND = "#7f7f7f", "#1f4e79", "#d1495b", "#edae49"
STYLE: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "font.size": 9,
    "grid.alpha": 0.3,
    "legend.fontsize": 8,
    "legend.framealpha": 0.85,
    "lines.linewidth": 1.3,
}


def finish(axes: Axes, title: str, ylabel: str, xlabel: str | None = None) -> None:
    """Title, units and legend; no axis offset that a reader would have to decode."""
    axes.set_title(title, loc="left")
    axes.set_ylabel(ylabel)
    axes.ticklabel_format(axis="y", useOffset=False)
    if xlabel:
        axes.set_xlabel(xlabel)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best")


def torque(axes: Axes, run: Recording) -> None:
    """Command, truth, estimate."""
    now = run["time_s"]
    axes.plot(now, run["torque_command_Nm"], color=COMMAND, ls="--", label="command")
    axes.plot(now, run["true_torque_Nm"], color=TRUTH, label="shaft (plant)")
    axes.plot(now, run["torque_estimate_Nm"], color=ESTIMATE, lw=0.9, label="estimate")
    finish(axes, "Torque", "N·m")


def flux(axes: Axes, run: Recording) -> None:
    """Magnet flux, true and identified."""
    axes.plot(run["time_s"], 1e3 * run["true_psi_f_Vs"], color=TRUTH, label="plant")
    axes.plot(run["time_s"], 1e3 * run["psi_f_Vs"], color=ESTIMATE, lw=0.9, label="identified")
    _room(axes, 1.0)
    finish(axes, "Magnet flux ψ_f", "mV·s")


def resistance(axes: Axes, run: Recording) -> None:
    """Stator resistance, true and identified."""
    axes.plot(run["time_s"], 1e3 * run["true_r_ohm"], color=TRUTH, label="plant")
    axes.plot(run["time_s"], 1e3 * run["r_ohm"], color=ESTIMATE, lw=0.9, label="identified")
    _room(axes, 0.5)
    finish(axes, "Stator resistance R", "mΩ")


def _currents(axes: Axes, run: Recording) -> None:
    now = run["time_s"]
    for axis, colour in (("d", SECOND), ("q", TRUTH)):
        axes.plot(now, run[f"true_i_{axis}_A"], color=colour, label=f"i_{axis}")
        axes.plot(now, run[f"i{axis}_ref_A"], color=COMMAND, ls="--", lw=0.8)
    axes.plot([], [], color=COMMAND, ls="--", lw=0.8, label="references")
    finish(axes, "Currents", "A (peak)")


def _speed(axes: Axes, run: Recording) -> None:
    axes.plot(run["time_s"], run["true_speed_rpm"], color=TRUTH, label="plant")
    axes.plot(run["time_s"], run["speed_rpm"], color=ESTIMATE, lw=0.9, label="measured")
    _room(axes, 10.0)
    finish(axes, "Speed", "rpm", "time, s")


def _voltage(axes: Axes, run: Recording) -> None:
    now = run["time_s"]
    axes.plot(now, run["ud_V"], color=SECOND, label="u_d")
    axes.plot(now, run["uq_V"], color=TRUTH, label="u_q")
    axes.plot(now, run["vdc_V"] / 3**0.5, color=COMMAND, ls="--", lw=0.8, label="V_dc/√3")
    finish(axes, "Voltages acting, as the controller has them", "V (peak)", "time, s")


def _room(axes: Axes, span: float) -> None:
    """A constant is drawn as a constant, not as the noise of its last digit."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - span, middle + span)


def figure(run: Recording, title: str) -> Figure:
    """Torque, currents, flux, resistance, speed, voltages."""
    with plt.rc_context(STYLE):
        sheet, axes = plt.subplots(3, 2, figsize=(11, 8), sharex=True, layout="constrained")
        for axis, draw in zip(
            axes.flat, (torque, _currents, flux, resistance, _speed, _voltage), strict=True
        ):
            draw(axis, run)
        sheet.suptitle(title, fontsize=11)
    return sheet


def write(run: Recording, title: str, path: Path) -> None:
    """Any format that matplotlib knows by its suffix."""
    sheet = figure(run, title)
    try:
        with atomic(path) as scratch:
            sheet.savefig(scratch, dpi=120)
    finally:
        plt.close(sheet)
