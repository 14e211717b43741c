# SPDX-License-Identifier: Apache-2.0
"""The report's figures, as SVG text."""

import io
import os
from collections.abc import Callable
from typing import Any, Final

os.environ.setdefault("MPLBACKEND", "Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from fluxtrue_tools.campaign.score import BANDS, CRAWL, band_of, rms
from fluxtrue_tools.campaign.spec import Campaign
from fluxtrue_tools.campaign.terminal import band_name
from fluxtrue_tools.campaign.tour import Trace
from fluxtrue_tools.sim.plot import COMMAND, ESTIMATE, SECOND, STYLE, TRUTH

COLOURS: Final = (SECOND, ESTIMATE, TRUTH, "#6a994e", "#7b2d8b", "#4f4f4f", "#00798c", "#9c6644")
SPEED_BINS: Final = 13
TORQUE_BINS: Final = 12
SCALE_PERCENT: Final = 10.0  # where colours and histograms end
FINE_PERCENT: Final = 2.0


def _styled(draw: Callable[..., Figure]) -> Callable[..., str]:
    def styled(*arguments: Any) -> str:
        with plt.rc_context(STYLE | {"svg.hashsalt": draw.__name__}):
            figure = draw(*arguments)
            stream = io.StringIO()
            figure.savefig(stream, format="svg")
            plt.close(figure)
            return stream.getvalue()

    return styled


def _colours(campaign: Campaign) -> dict[str, str]:
    return dict(zip([c.name for c in campaign.controller], COLOURS, strict=False))


def _speed_edges(table: pd.DataFrame) -> np.ndarray:
    speed = table.loc[table["band"] != CRAWL, "speed_rpm"].abs()
    return np.geomspace(speed.min() * 0.999, speed.max() * 1.001, SPEED_BINS + 1)


def _plain_ticks(axes: Any, edges: np.ndarray) -> None:
    """A logarithmic axis with round numbers."""
    wanted = [n for n in (300, 500, 1000, 2000, 5000, 10000) if edges[0] <= n <= edges[-1] * 1.01]
    axes.set_xscale("log")
    axes.set_xlim(edges[0], edges[-1])
    axes.set_xticks(wanted, [str(n) for n in wanted])
    axes.minorticks_off()


def _map(axis: Any, rows: pd.DataFrame, speeds: np.ndarray, torques: np.ndarray, top_percent: float) -> Any:
    driving = rows["torque_requested_Nm"] * np.sign(rows["speed_rpm"])
    place = [rows["speed_rpm"].abs(), driving]
    count, _, _ = np.histogram2d(*place, bins=[speeds, torques])
    total, _, _ = np.histogram2d(*place, bins=[speeds, torques], weights=rows["error_percent"] ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        error = np.sqrt(total / count).T
    mesh = axis.pcolormesh(speeds, torques, error, cmap="viridis_r", vmin=0.0, vmax=top_percent)
    _plain_ticks(axis, speeds)
    axis.set_xlabel("speed, rpm")
    axis.grid(visible=False)
    return mesh


@_styled
def maps(campaign: Campaign, table: pd.DataFrame) -> Figure:
    """rms error over speed and torque: torque counted positive when it drives, whatever the direction. All on one
    scale, and those held to bounds once more on a finer one."""
    names, fine = [controller.name for controller in campaign.controller], campaign.check.controllers
    count = len(names) + len(fine)
    figure, axes = plt.subplots(1, count, figsize=(3.2 * count + 1.6, 3.8), layout="constrained",
                                sharey=True, squeeze=False)  # fmt: skip
    speeds = _speed_edges(table)
    top = table["torque_requested_Nm"].abs().max() * 1.001
    torques = np.linspace(-top, top, TORQUE_BINS + 1)
    coarse, finer = list(axes[0][: len(names)]), list(axes[0][len(names) :])
    for group, shown, scale, mark in ((coarse, names, SCALE_PERCENT, ""), (finer, fine, FINE_PERCENT, ", finer scale")):
        mesh = None
        for axis, name in zip(group, shown, strict=True):
            mesh = _map(axis, table[table["controller"] == name], speeds, torques, scale)
            axis.set_title(name + mark, loc="left")
        if mesh is not None:
            figure.colorbar(mesh, ax=group, label="rms torque error, %", extend="max")
    axes[0][0].set_ylabel("torque, N·m (positive drives, negative brakes)")
    return figure


def _over_speed(axes: Any, campaign: Campaign, table: pd.DataFrame) -> None:
    edges = _speed_edges(table)
    middle = np.sqrt(edges[1:] * edges[:-1])
    for name, colour in _colours(campaign).items():
        rows = table[table["controller"] == name]
        bins = np.digitize(rows["speed_rpm"].abs(), edges) - 1
        found = [(rms(part["error_percent"]), rms(part["bound_percent"]))
                 for part in (rows[bins == k] for k in range(SPEED_BINS))]  # fmt: skip
        axes.plot(middle, [e for e, _ in found], color=colour, marker="o", ms=3, label=name)
        if np.isfinite([b for _, b in found]).any():
            axes.plot(middle, [b for _, b in found], color=colour, ls=":", label=f"information bound, {name}'s data")
    axes.set_yscale("log")
    axes.set_ylim(0.1, 50.0)
    errors = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)
    axes.set_yticks(errors, [f"{e:g}" for e in errors])
    _plain_ticks(axes, edges)
    axes.set_xlabel("speed, rpm")
    axes.set_ylabel("rms torque error, %")


@_styled
def over_speed(campaign: Campaign, table: pd.DataFrame) -> Figure:
    """rms error and information bound over speed."""
    figure, axes = plt.subplots(figsize=(9, 4), layout="constrained")
    _over_speed(axes, campaign, table)
    axes.legend(loc="upper center", ncols=3)
    return figure


def headline(campaign: Campaign, table: pd.DataFrame) -> Figure:
    """Overview of the campaign from crawl_rpm on: distribution of the errors, and their place."""
    table = table.assign(band=band_of(table["speed_rpm"], campaign.check))
    table = table[table["band"] != CRAWL]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
        for name, colour in _colours(campaign).items():
            error = np.sort(table.loc[table["controller"] == name, "error_percent"].abs())
            share = 100.0 * np.arange(1, len(error) + 1) / max(1, len(error))
            axes[0].plot(error, share, color=colour, label=name)
        axes[0].set_xlim(0.0, SCALE_PERCENT)
        axes[0].set_ylim(0.0, 101.0)
        axes[0].set_xlabel("magnitude of the torque error, %")
        axes[0].set_ylabel("share of windows within it, %")
        axes[0].set_title(f"{table['case'].nunique()} random plants, simulated", loc="left")
        axes[0].legend(loc="lower right")
        _over_speed(axes[1], campaign, table)
        limits, split, edges = campaign.check.limits, campaign.check.band_rpm, _speed_edges(table)
        bounds = {"color": COMMAND, "ls": "--", "lw": 1.0}
        axes[1].plot([edges[0], split], [limits.rms_low] * 2, label="promised", **bounds)
        axes[1].plot([split, edges[-1]], [limits.rms_high] * 2, **bounds)
        axes[1].set_title("over speed", loc="left")
        axes[1].legend(loc="upper center", ncols=2)
    return figure


@_styled
def histograms(campaign: Campaign, table: pd.DataFrame) -> Figure:
    """Histograms of the errors with and without correction, by speed range."""
    bands = [band for band in (*BANDS, CRAWL) if (table["band"] == band).any()]
    figure, axes = plt.subplots(1, len(bands), figsize=(11, 3.6), layout="constrained", sharey=True, squeeze=False)
    bins = np.linspace(-SCALE_PERCENT, SCALE_PERCENT, 81)
    for axis, band in zip(axes[0], bands, strict=True):
        for name, colour in _colours(campaign).items():
            rows = table[(table["controller"] == name) & (table["band"] == band)]
            # The sign of an error is counted along the torque, so that both directions of torque can be added.
            error = np.clip(rows["error_percent"] * np.sign(rows["torque_requested_Nm"]), bins[0], bins[-1])
            weight = np.full(len(error), 100.0 / max(1, len(error)))
            axis.hist(error, bins=bins, weights=weight, histtype="step", color=colour, label=name, lw=1.4)
        axis.set_title(band_name(campaign, band), loc="left")
        axis.set_xlabel("torque error, % (positive: too much)")
        axis.set_yscale("log")
    axes[0][0].set_ylabel("share of windows, %")
    axes[0][0].legend()
    return figure


def _series(axes: Any, trace: Trace, colour: str, name: str) -> None:
    every = np.concatenate([trace.drive, *trace.windows])
    column = trace.columns.index
    start = trace.drive[-1, column("truth.time_s")] if len(trace.drive) else 0.0
    now = every[:, column("truth.time_s")] - start
    axes[1].plot(now, every[:, column("truth.torque_mean_Nm")], color=colour, lw=0.7, label=f"{name}: air gap")
    requested, torque = (every[:, column(c)] for c in ("torque_requested_Nm", "truth.torque_mean_Nm"))
    axes[2].plot(now, torque - requested, color=colour, lw=0.7, label=name)
    axes[3].plot(now, every[:, column("torque_estimated_Nm")] - torque, color=colour, lw=0.7, label=name)
    axes[0].plot(now, every[:, column("truth.speed_rad_s")] * 60.0 / (2.0 * np.pi), color=colour, lw=0.9, label=name)


def case_figure(campaign: Campaign, traces: dict[str, Trace], title: str) -> Figure:
    """One case over time: speed, torque, its error, and the error of the estimate."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(4, 1, figsize=(12, 9), sharex=True, layout="constrained")
        for name, colour in _colours(campaign).items():
            if name in traces:
                _series(axes, traces[name], colour, name)
        labels = ("speed, rpm", "torque, N·m", "torque less requested, N·m", "estimated less torque, N·m")
        for axis, label in zip(axes, labels, strict=True):
            axis.set_ylabel(label)
        for axis in axes[2:]:
            axis.set_ylim(-15.0, 15.0)
            axis.axhline(0.0, color=COMMAND, lw=0.6)
        axes[0].legend(loc="upper left")
        axes[-1].set_xlabel("time, s (0: the warm-up drive ends, the windows begin)")
        figure.suptitle(title, fontsize=11)
    return figure
