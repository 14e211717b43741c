# SPDX-License-Identifier: Apache-2.0
"""The report's figures, and those of them that fill the current plane."""

from collections.abc import Callable
from functools import partial

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.flux_tables import error_plane
from fluxtrue_tools.motor.loci_plots import current_plane, loci_figure
from fluxtrue_tools.motor.loop_plots import current_loop_figure, step_figure
from fluxtrue_tools.motor.measured import Measured
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.speed_plots import envelope_figure, losses_figure, short_circuit_figure


def _filled(axes: Axes, motor: Motor, d: Array, q: Array, z: Array, title: str) -> None:
    z = np.where(np.hypot(d, q) <= motor.config.machine.i_max_A * 1.0001, z, np.nan)
    low, high = float(np.nanmin(z)), float(np.nanmax(z))
    if high - low < 1e-9 * max(abs(high), 1.0):
        axes.text(0.5, 0.5, f"{high:.4g} everywhere", transform=axes.transAxes, ha="center")
        axes.set_xlim(d.min(), d.max())
        axes.set_ylim(q.min(), q.max())
    else:
        shown = axes.contourf(d, q, z, levels=16, cmap="viridis")
        axes.figure.colorbar(shown, ax=axes)
    axes.set(title=title, xlabel="i_d, A", ylabel="i_q, A")


def _grid(motor: Motor, panels: list[tuple[str, Callable[[Array, Array], Array]]], both_halves: bool) -> Figure:
    rows = (len(panels) + 1) // 2
    figure, axes = plt.subplots(rows, 2, figsize=(11, 4.2 * rows), layout="constrained", squeeze=False)
    d, q = current_plane(motor, both_halves)
    for ax, (title, f) in zip(axes.flat, panels, strict=False):
        _filled(ax, motor, d, q, f(d, q), title)
    return figure


def flux_figure(motor: Motor) -> Figure:
    """psi_d, psi_q over the current circle, symmetrised."""
    m = motor.model
    return _grid(
        motor,
        [("psi_d, mV·s", lambda d, q: 1e3 * m.psi_d(d, q)), ("psi_q, mV·s", lambda d, q: 1e3 * m.psi_q(d, q))],
        True,
    )


def inductance_figure(motor: Motor) -> Figure:
    """Apparent and incremental inductances."""
    m = motor.model

    def l_d(d: Array, q: Array) -> Array:
        near = np.minimum(d, -1e-3 * motor.config.machine.i_max_A)
        return 1e6 * (m.psi_d(near, q) - m.psi_d(0.0, q)) / near

    def l_q(d: Array, q: Array) -> Array:
        near = np.maximum(q, 1e-3 * motor.config.machine.i_max_A)
        return 1e6 * m.psi_q(d, near) / near

    return _grid(
        motor,
        [
            ("L_d apparent, µH", l_d),
            ("L_q apparent, µH", l_q),
            ("L_d incremental, µH", lambda d, q: 1e6 * m.psi_d(d, q, nd=1)),
            ("L_q incremental, µH", lambda d, q: 1e6 * m.psi_q(d, q, nq=1)),
        ],
        False,
    )


def error_figure(motor: Motor) -> Figure:
    """What the quantised, bilinear look-up adds to the map."""
    d, q, e_d, e_q, e_t = error_plane(
        motor.tables, motor.model, motor.bases, motor.config.machine.i_max_A, motor.config.machine.pole_pairs
    )
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.2), layout="constrained")
    for ax, z, title in zip(
        axes, (1e6 * e_d, 1e6 * e_q, e_t), ("psi_d error, µV·s", "psi_q error, µV·s", "torque error, N·m"), strict=True
    ):
        _filled(ax, motor, d, q, z, title)
    return figure


Draw = Callable[[Motor], Figure]
FIGURES: dict[str, tuple[str, Draw]] = {
    "plot_flux.png": ("Flux linkages (symmetrised)", flux_figure),
    "plot_inductances.png": ("Inductances", inductance_figure),
    "plot_loci.png": ("Current references: MTPA, field weakening, MTPV", loci_figure),
    "plot_envelope.png": ("Torque-speed envelope", envelope_figure),
    "plot_losses.png": ("Efficiency and losses", losses_figure),
    "plot_short_circuit.png": ("Active short circuit", short_circuit_figure),
    "plot_error.png": ("Table error against the map", error_figure),
}


def figures(motor: Motor, measured: Measured) -> dict[str, tuple[str, Draw]]:
    """All that there is to draw: constant inductances are two numbers, and no measurement is no figure."""
    found = FIGURES | {"plot_current_loop.png": ("Current loop", partial(current_loop_figure, measured=measured))}
    if measured.steps:
        found["plot_steps.png"] = ("Steps of the current", partial(step_figure, measured=measured))
    if motor.flux_map is None:
        del found["plot_inductances.png"]
    return found
