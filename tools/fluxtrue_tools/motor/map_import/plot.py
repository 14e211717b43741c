# SPDX-License-Identifier: Apache-2.0
"""import.png: the points, the map, what the fit changed, and where the map lies beyond the points."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.run import Imported

MANY = 3000  # points
LEVELS = 5  # currents of the other axis for which a curve is drawn


def _places(axes: Axes, done: Imported) -> None:
    grid, points = done.grid, done.points
    d, q = np.meshgrid(grid.id_A, grid.iq_A, indexing="ij")
    size = 4.0 if len(points) < MANY else 1.0
    axes.plot(points.i_d, points.i_q, ".", color="tab:blue", ms=size, label="points of the file")
    beyond = grid.extrapolated
    axes.plot(d[~beyond], q[~beyond], "+", color="0.6", ms=4, label="nodes of the map")
    if beyond.any():
        axes.plot(d[beyond], q[beyond], "x", color="tab:red", ms=4, label="nodes beyond the points")
    angle = np.linspace(0.5 * np.pi, np.pi, 100)
    axes.plot(done.i_max_A * np.cos(angle), done.i_max_A * np.sin(angle), "k", lw=1.2, label="current limit i_max")
    axes.set(title="Points and map", xlabel="i_d, A", ylabel="i_q, A")
    axes.legend(fontsize=8, loc="best")


def _curves(axes: Axes, done: Imported, of_d: bool) -> None:
    """One flux over its own current: lines of the map, points of the file near each line."""
    points, grid = done.points, done.grid
    own, other = (points.i_d, np.abs(points.i_q)) if of_d else (np.abs(points.i_q), points.i_d)
    psi = points.psi_d if of_d else points.psi_q * np.sign(points.i_q + 1e-300)
    axis, across = (grid.id_A, grid.iq_A) if of_d else (grid.iq_A, grid.id_A)
    names = ("i_d", "|i_q|") if of_d else ("|i_q|", "i_d")
    for k, wanted in enumerate(np.linspace(across[0], across[-1], LEVELS)):
        nearest = float(other[np.argmin(np.abs(other - wanted))])
        level = nearest if abs(nearest - wanted) < 0.05 * done.i_max_A else float(wanted)
        there = np.full(len(axis), level)
        line = done.model.psi_d(axis, there) if of_d else done.model.psi_q(there, axis)
        colour = f"C{k}"
        axes.plot(axis, 1e3 * line, color=colour, lw=1.2, label=f"{names[1]} = {level:.4g} A")
        near = np.abs(other - level) < 0.01 * done.i_max_A
        near &= (own >= axis[0] - 1e-9) & (own <= axis[-1] + 1e-9)
        axes.plot(own[near], 1e3 * psi[near], ".", color=colour, ms=4)
    name = "psi_d" if of_d else "psi_q"
    axes.set(title=f"{name}: map (lines), file (points)", xlabel=f"{names[0]}, A", ylabel=f"{name}, mVs")
    axes.legend(fontsize=7, loc="best")


def _change(axes: Axes, done: Imported, values: Array, title: str, unit: str) -> None:
    inside = done.changes.inside
    limit = float(np.abs(values[inside]).max()) or 1.0
    places = done.points.i_d[inside], done.points.i_q[inside]
    shown = axes.scatter(*places, c=values[inside], s=14, cmap="coolwarm", vmin=-limit, vmax=limit)
    axes.figure.colorbar(shown, ax=axes, label=unit)
    axes.set(title=f"{title} inside the current limit", xlabel="i_d, A", ylabel="i_q, A")


def write(done: Imported, path: Path) -> None:
    """The figure."""
    figure, axes = plt.subplots(2, 3, figsize=(17, 9.5), layout="constrained")
    figure.suptitle(f"{done.settings.values['machine.name']}: imported from {done.path.name}")
    _places(axes[0, 0], done)
    _curves(axes[0, 1], done, of_d=True)
    _curves(axes[0, 2], done, of_d=False)
    c = done.changes
    _change(axes[1, 0], done, 1e3 * c.psi_d_Vs, "Change of psi_d", "mVs")
    _change(axes[1, 1], done, 1e3 * c.psi_q_Vs, "Change of psi_q", "mVs")
    _change(axes[1, 2], done, 100.0 * c.torque, "Change of the torque", f"% of {c.largest_Nm:.4g} N·m")
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)
