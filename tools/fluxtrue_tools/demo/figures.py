# SPDX-License-Identifier: Apache-2.0
"""The report's figures, as SVG text."""

import io
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.demo.experiment import Result
from fluxtrue_tools.demo.grid import TWIN_PERCENT, allowed_percent
from fluxtrue_tools.demo.paper import SETTLED
from fluxtrue_tools.demo.step import STEP_S
from fluxtrue_tools.sim.plot import COMMAND, ESTIMATE, SECOND, STYLE, TRUTH, finish, flux, resistance, torque
from fluxtrue_tools.sim.run import Recording

GAIN_COLOURS = {"slow": SECOND, "medium": ESTIMATE, "fast": "#6a994e"}


def _svg(figure: Figure) -> str:
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    plt.close(figure)
    return stream.getvalue()


def _sheet(rows: int, columns: int, size: tuple[float, float], **more: Any) -> tuple[Figure, Any]:
    return plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **more)


def _styled(draw: Callable[..., Figure]) -> Callable[..., str]:
    def styled(*arguments: Any) -> str:
        with plt.rc_context(STYLE | {"svg.hashsalt": draw.__name__}):
            return _svg(draw(*arguments))

    return styled


def _mark(axes: Axes, first: float, last: float, text: str, colour: str) -> None:
    axes.axvspan(first, last, color=colour, alpha=0.10, lw=0)
    axes.text(
        0.5 * (first + last), 0.03, text, transform=axes.get_xaxis_transform(),
        ha="center", va="bottom", fontsize=8,
    )  # fmt: skip


def _zoom(axes: Axes, requested: float) -> None:
    """Give the axis a range of at least ten percent."""
    axes.set_ylim(0.84 * requested, 1.06 * requested)


@_styled
def story(run: Recording, parts: Sequence[tuple[float, float, str, str]]) -> Figure:
    """Torque before and after the loop is closed, and the identified values."""
    figure, axes = _sheet(2, 1, (9, 5.2), sharex=True, height_ratios=[2, 1])
    top, bottom = axes[:, 0]
    torque(top, run)
    _zoom(top, float(run["torque_requested_Nm"][-1]))
    for part in parts:
        _mark(top, *part)
    finish(top, "Shaft torque", "N·m")
    top.legend(loc="upper left", ncols=3)
    flux(bottom, run)
    bottom.set_xlabel("time, s")
    bottom.set_xlim(0, float(run["time_s"][-1]))
    return figure


@_styled
def gain_sets(results: Sequence[Result]) -> Figure:
    """The paper's figures 3 and 4."""
    figure, axes = _sheet(1, 2, (10, 3.8))
    left, right = axes[0]
    for result in results:
        ((name, run),) = result.runs.items()
        shown = run["time_s"] <= 0.6
        now = run["time_s"][shown]
        if name == "slow":
            left.plot(now, 1e3 * run["true_psi_f_Vs"][shown], color=TRUTH, label="plant")
            right.plot(now, 1e3 * run["true_r_ohm"][shown], color=TRUTH, label="plant")
            final = 1e3 * float(run["true_psi_f_Vs"][-1])
            left.axhspan(final * (1 - SETTLED), final * (1 + SETTLED), color=COMMAND, alpha=0.25, lw=0, label="±1 %")
        colour = GAIN_COLOURS[name]
        left.plot(now, 1e3 * run["psi_f_Vs"][shown], color=colour, label=name)
        right.plot(now, 1e3 * run["r_ohm"][shown], color=colour, label=name, lw=1.0)
    finish(left, "Magnet flux ψ_f identified", "mV·s", "time, s")
    finish(right, "Stator resistance R identified", "mΩ", "time, s")
    return figure


@_styled
def fig7(run: Recording) -> Figure:
    """Torque, flux, resistance while magnet and winding change."""
    figure, axes = _sheet(1, 3, (12, 3.6))
    for axis, draw in zip(axes[0], (torque, flux, resistance), strict=True):
        draw(axis, run)
        axis.set_xlabel("time, s")
    axes[0, 0].set_ylim(70.0, 85.0)
    return figure


def _point_axis(top: Axes, bottom: Axes, points: list[dict[str, float]]) -> None:
    """Torque under the lower axes, speed over the upper."""
    labels = [f"{p['torque_requested_Nm']:+.0f}" for p in points]
    bottom.set_xticks(range(len(points)), labels, rotation=90, fontsize=7)
    bottom.set_xlim(-0.5, len(points) - 0.5)
    bottom.set_xlabel("requested torque, N·m")
    speeds = [p["speed_rpm"] for p in points]
    for speed in dict.fromkeys(speeds):
        at = [k for k, s in enumerate(speeds) if s == speed]
        top.text(
            float(np.mean(at)), 1.02, f"{speed:+.0f} rpm",
            transform=top.get_xaxis_transform(), ha="center", weight="bold",
        )  # fmt: skip
        for axes in {top, bottom}:
            axes.axvline(at[-1] + 0.5, color=COMMAND, lw=0.6)


@_styled
def grid(points: list[dict[str, float]]) -> Figure:
    """Open and closed loop at every point, then the closed loop against its bound."""
    figure, axes = _sheet(2, 1, (11, 5.4), sharex=True)
    top, bottom = axes[:, 0]
    at = np.arange(len(points))
    closed = [p["torque_error_closed_percent"] for p in points]
    allowed = np.array([allowed_percent(p["torque_requested_Nm"]) for p in points])
    top.bar(at, [p["torque_error_open_percent"] for p in points], color=SECOND, label="tables alone")
    top.plot(at, closed, "o", ms=4, color=TRUTH, label="torque loop closed")
    bottom.bar(at, 2 * allowed, bottom=-allowed, color=COMMAND, alpha=0.2, label="allowed")
    bottom.plot(at, closed, "o", ms=4, color=TRUTH, label="torque loop closed")
    finish(top, "", "torque error, % of requested")
    finish(bottom, "", "the same, enlarged, %")
    for axis in (top, bottom):
        low, high = axis.get_ylim()
        axis.set_ylim(low - 0.25 * (high - low), high)
        axis.legend(loc="lower center", ncols=2)
    _point_axis(top, bottom, points)
    return figure


@_styled
def twin(points: list[dict[str, float]]) -> Figure:
    """Error of the fixed-point arithmetic."""
    figure, axes = _sheet(1, 1, (11, 2.9))
    axis = axes[0, 0]
    at = np.arange(len(points))
    axis.axhspan(-TWIN_PERCENT, TWIN_PERCENT, color=COMMAND, alpha=0.2, lw=0, label="allowed")
    for loop, colour in (("open", SECOND), ("closed", TRUTH)):
        values = [p[f"torque_difference_{loop}_percent_of_rated"] for p in points]
        axis.plot(at, values, "o", ms=4, color=colour, label=f"loop {loop}")
    finish(axis, "", "firmware less twin,\n% of rated torque")
    _point_axis(axis, axis, points)
    return figure


@_styled
def steps(result: Result) -> Figure:
    """Torque and current over the first milliseconds."""
    figure, axes = _sheet(1, 2, (10, 3.6))
    left, right = axes[0]
    for axis, run, columns in (
        (left, result.runs["torque"], ("torque_requested_Nm", "true_torque_Nm", "torque_estimated_Nm")),
        (right, result.runs["current"], ("iq_ref_A", "true_i_q_A", "iq_A")),
    ):
        now = 1e3 * (run["time_s"] - STEP_S)
        shown = (now > -1) & (now < 12)
        for column, colour, label in zip(
            columns, (COMMAND, TRUTH, ESTIMATE), ("requested", "plant", "estimated"), strict=True
        ):
            axis.plot(now[shown], run[column][shown], color=colour, label=label)
    right.plot(
        1e3 * (result.runs["current"]["time_s"] - STEP_S), result.runs["current"]["true_i_d_A"],
        color=SECOND, lw=0.9, label="i_d, plant",
    )  # fmt: skip
    right.set_xlim(-1, 5)
    finish(left, "0 → 100 N·m at 2000 rpm", "N·m", "time after the step, ms")
    finish(right, "i_q: 0 → 50 A at 2000 rpm", "A", "time after the step, ms")
    return figure
