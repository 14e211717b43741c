# SPDX-License-Identifier: Apache-2.0
"""A recording as one figure."""

import os
from pathlib import Path
from typing import Any

os.environ.setdefault("MPLBACKEND", "Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.sim.run import IDENTIFIED, Recording

COMMAND, TRUTH, ESTIMATE, SECOND, FAULT = "#7f7f7f", "#1f4e79", "#d1495b", "#edae49", "#b00020"
NAMES_APART = 0.03  # of the time axis, for each line of text
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
    """Requested, true and estimated torque."""
    now = run["time_s"]
    axes.plot(now, run["torque_requested_Nm"], color=COMMAND, ls="--", label="requested")
    axes.plot(now, run["true_torque_Nm"], color=TRUTH, label="shaft (plant)")
    axes.plot(now, run["torque_estimated_Nm"], color=ESTIMATE, lw=0.9, label="estimated")
    finish(axes, "Torque", "N·m")


def flux(axes: Axes, run: Recording) -> None:
    """Magnet flux, true and identified."""
    axes.plot(run["time_s"], 1e3 * run["true_psi_f_Vs"], color=TRUTH, label="plant")
    axes.plot(run["time_s"], 1e3 * run["psi_f_Vs"], color=ESTIMATE, lw=0.9, label="identified")
    _widen(axes, 1.0)
    finish(axes, "Magnet flux ψ_f", "mV·s")


def resistance(axes: Axes, run: Recording) -> None:
    """Stator resistance, true and identified."""
    axes.plot(run["time_s"], 1e3 * run["true_r_ohm"], color=TRUTH, label="plant")
    axes.plot(run["time_s"], 1e3 * run["r_ohm"], color=ESTIMATE, lw=0.9, label="identified")
    _widen(axes, 0.5)
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
    _widen(axes, 10.0)
    finish(axes, "Speed", "rpm")


def _voltage(axes: Axes, run: Recording) -> None:
    now = run["time_s"]
    axes.plot(now, run["ud_V"], color=SECOND, label="u_d")
    axes.plot(now, run["uq_V"], color=TRUTH, label="u_q")
    axes.plot(now, run["vdc_V"] / 3**0.5, color=COMMAND, ls="--", lw=0.8, label="V_dc/√3")
    finish(axes, "Voltages acting, as the controller has them", "V (peak)")


def _scales(axes: Axes, run: Recording) -> None:
    """The identified factors of the tables and of the iron loss."""
    now = run["time_s"]
    for name, label, colour in (("lq_scale", "ψ_q", TRUTH), ("ld_scale", "ψ_d − ψ_f", ESTIMATE),
                                ("iron_scale", "iron loss", SECOND)):  # fmt: skip
        axes.plot(now, run[name], color=colour, label=label)
    _widen(axes, 0.02)
    finish(axes, "Identified scales of the motor data", "1")


def _confidence(axes: Axes, run: Recording) -> None:
    now = run["time_s"]
    axes.plot(
        now,
        run["torque_confidence"],
        color=TRUTH,
        label="confidence: share of its authority that the torque loop may use",
    )
    axes.plot(now, run["mismatch_share"], color=ESTIMATE, label="mismatch: share of updates that no parameter explains")
    axes.set_ylim(-0.05, 1.05)
    finish(axes, "Confidence", "1")


def _residues(axes: Axes, run: Recording) -> None:
    now = run["time_s"]
    axes.plot(now, run["drop_V"], color=TRUTH, label="uncompensated dead time and device drop, V")
    axes.plot(now, np.degrees(run["angle_error_rad"]), color=ESTIMATE, label="angle, measured minus true, ° electrical")
    _widen(axes, 0.5)
    finish(axes, "Identified errors of inverter and angle", "V, °")


def _local(axes: Axes, run: Recording) -> None:
    axes.plot(run["time_s"], 1e3 * run["local_flux_Vs"], color=TRUTH, label="flux error that no parameter explains")
    _widen(axes, 0.5)
    finish(axes, "Local flux error", "mV·s")


def _widen(axes: Axes, span: float) -> None:
    """Widen the axis of a constant, so that the noise of its last digit is not visible."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - span, middle + span)


def _close_together(run: Recording) -> list[tuple[float, list[str]]]:
    """The faults by time; those whose names would be written over each other are one entry."""
    span = run.scenario.duration_s
    groups: list[tuple[float, list[str]]] = []
    for time_s, names in run.faults():
        if groups and time_s - groups[-1][0] < NAMES_APART * span * len(groups[-1][1]):
            groups[-1][1].extend(names)
        else:
            groups.append((time_s, list(names)))
    return groups


def _mark_faults(axes: Axes, run: Recording, named: bool) -> None:
    """A line where the drive tripped, through every panel; the names in one, a line of text for each."""
    for time_s, _ in run.faults():
        axes.axvline(time_s, color=FAULT, ls=":", lw=1.1)
    for time_s, names in _close_together(run) if named else []:
        axes.annotate("\n".join(names), (time_s, 0.98), xycoords=("data", "axes fraction"), rotation=90,
                      ha="right", va="top", color=FAULT, fontsize=8,
                      bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0})  # fmt: skip


def _identified(run: Recording) -> bool:
    """Whether the robust identification found anything: without it its panels would be straight lines."""
    return "lq_scale" in run.columns and any(bool(np.ptp(run[name])) for name in IDENTIFIED)


def figure(run: Recording, title: str) -> Figure:
    """Torque, currents, flux, resistance, speed, voltages; with the robust identification also what else it found."""
    panels = [torque, _currents, flux, resistance, _speed, _voltage]
    panels += [_scales, _residues, _local, _confidence] if _identified(run) else []
    rows = len(panels) // 2
    with plt.rc_context(STYLE):
        sheet, axes = plt.subplots(rows, 2, figsize=(11, 2.7 * rows), sharex=True, layout="constrained")
        for axis, draw in zip(axes.flat, panels, strict=True):
            draw(axis, run)
            _mark_faults(axis, run, named=draw is torque)
        for axis in axes[-1]:
            axis.set_xlabel("time, s")
        sheet.suptitle(title, fontsize=11)
    return sheet


def write(run: Recording, title: str, path: Path) -> None:
    """Any format that matplotlib knows by its suffix."""
    sheet = figure(run, title)
    try:
        sheet.savefig(path, dpi=120)
    finally:
        plt.close(sheet)
