# SPDX-License-Identifier: Apache-2.0
"""The report's figures, and those of them that lie over the current plane."""

from collections.abc import Callable
from functools import partial

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fluxtrue_tools.motor.envelope import available_flux
from fluxtrue_tools.motor.flux_model import Array, flux, torque
from fluxtrue_tools.motor.flux_tables import error_plane
from fluxtrue_tools.motor.loop_plots import current_loop_figure, step_figure
from fluxtrue_tools.motor.measured import Measured
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.quantise import Q15_ONE
from fluxtrue_tools.motor.references import lookup_references
from fluxtrue_tools.motor.speed_plots import envelope_figure, losses_figure, short_circuit_figure

POINTS = 121
LIMITS_SHOWN = 7


def _plane(motor: Motor, both_halves: bool) -> tuple[Array, Array]:
    i_max = motor.config.machine.i_max_A
    q_low = -i_max if both_halves else 0.0
    return np.meshgrid(np.linspace(-i_max, 0, POINTS), np.linspace(q_low, i_max, 2 * POINTS - 1), indexing="ij")


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
    d, q = _plane(motor, both_halves)
    for ax, (title, f) in zip(axes.flat, panels, strict=False):
        _filled(ax, motor, d, q, f(d, q), title)
    return figure


def flux_figure(motor: Motor) -> Figure:
    """psi_d, psi_q over the current circle, symmetrised."""
    m = motor.model
    return _grid(
        motor,
        [("psi_d, mVs", lambda d, q: 1e3 * m.psi_d(d, q)), ("psi_q, mVs", lambda d, q: 1e3 * m.psi_q(d, q))],
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
            ("L_d apparent, uH", l_d),
            ("L_q apparent, uH", l_q),
            ("L_d incremental, uH", lambda d, q: 1e6 * m.psi_d(d, q, nd=1)),
            ("L_q incremental, uH", lambda d, q: 1e6 * m.psi_q(d, q, nq=1)),
        ],
        False,
    )


def _lines(axes: Axes, d: Array, q: Array, z: Array, colour: str, label: str) -> None:
    lines = axes.contour(d, q, z, levels=10, colors=colour, linewidths=0.6)
    axes.clabel(lines, fontsize=6)
    axes.plot([], [], color=colour, linewidth=0.6, label=label)


def _voltage_limits(axes: Axes, motor: Motor, d: Array, q: Array, psi: Array) -> None:
    """Where the machine needs all of the planned voltage, at some speeds between the first that matters and the top."""
    top_rpm = motor.config.machine.speed_max_rpm
    speed = np.linspace(0.0, top_rpm, 401)[1:]
    available = available_flux(motor, speed)
    matters = speed[(available < np.nanmax(psi)) & (available > np.nanmin(psi))]
    if len(matters) == 0:
        return
    ticks = MaxNLocator(LIMITS_SHOWN).tick_values(matters[0], matters[-1])
    shown = np.unique([*ticks[(ticks >= matters[0]) & (ticks <= matters[-1])], matters[-1]])
    level = available_flux(motor, shown)
    lines = axes.contour(d, q, psi, levels=np.sort(level), colors="tab:blue", linewidths=0.8)
    named = {float(x): f"{rpm:.0f} rpm" for x, rpm in zip(level, shown, strict=True)}
    axes.clabel(lines, fontsize=7, fmt=lambda x: named[min(named, key=lambda known: abs(known - x))])
    axes.plot([], [], color="tab:blue", linewidth=0.8, label="voltage limit at a speed")


def _mtpv(motor: Motor) -> tuple[Array, Array]:
    """Contour ends that lie inside the circle: the voltage, not the current, limits the torque there."""
    torques = np.linspace(0.0, motor.solver.torque_top_Nm * 0.999, 60)
    ends = [(c.id_A[-1], c.iq_A[-1]) for c in motor.solver.contours(torques)]
    inside = [(d, q) for d, q in ends if np.hypot(d, q) < 0.995 * motor.config.machine.i_max_A]
    d, q = zip(*inside, strict=True) if inside else ((), ())
    return np.array(d), np.array(q)


def loci_figure(motor: Motor) -> Figure:
    """MTPA, field weakening and MTPV with torque and flux contours, and the stored references."""
    figure, axes = plt.subplots(figsize=(9, 8), layout="constrained")
    d, q = _plane(motor, False)
    inside = np.hypot(d, q) <= motor.config.machine.i_max_A
    t = torque(motor.model, motor.config.machine.pole_pairs, d, q)
    _lines(axes, d, q, np.where(inside, t, np.nan), "tab:gray", "torque, N·m")
    _voltage_limits(axes, motor, d, q, np.where(inside, flux(motor.model, d, q), np.nan))
    angle = np.linspace(np.pi / 2, np.pi, 100)
    i_max = motor.config.machine.i_max_A
    axes.plot(i_max * np.cos(angle), i_max * np.sin(angle), "k", label="current limit")
    contours = motor.solver.contours(np.linspace(0, motor.solver.torque_top_Nm * 0.999, 60))
    axes.plot([c.id_A[0] for c in contours], [c.iq_A[0] for c in contours], "tab:green", lw=2.5, label="MTPA")
    axes.plot(*_mtpv(motor), "tab:red", lw=2.5, label="MTPV")
    _stored_loci(axes, motor)
    _demagnetisation(axes, motor)
    axes.set(
        title=f"Current references of {motor.config.machine.name}",
        xlabel="i_d, A",
        ylabel="i_q, A",
        xlim=(-1.02 * i_max, 0.03 * i_max),
        ylim=(0, 1.02 * i_max),
    )
    axes.set_aspect("equal")
    axes.legend(loc="upper left", fontsize=8)
    return figure


def _demagnetisation(axes: Axes, motor: Motor) -> None:
    """The limit of the magnets at the ends of the temperatures, where it lies inside the figure."""
    magnet, i_max = motor.config.magnet, motor.config.machine.i_max_A
    if magnet.i_d_demag_A is None:
        return
    for celsius, style in ((20.0, "--"), (magnet.assumed_C, "-")):
        limit = magnet.i_d_demag_A - magnet.i_d_demag_A_per_K * (celsius - 20.0)
        if limit < 1.02 * i_max:
            axes.axvline(-limit, color="tab:purple", ls=style, label=f"magnets at {celsius:g} °C")


def _stored_loci(axes: Axes, motor: Motor) -> None:
    """References as the firmware reads them, at some available fluxes."""
    refs, b = motor.references, motor.bases
    for k, psi in enumerate(np.linspace(refs.psi_Vs[0], refs.psi_Vs[-1], 7)):
        t = np.linspace(0, float(np.interp(psi, refs.psi_Vs, refs.torque_max_Nm)), 80)
        counts = np.round(t / b.torque_Nm * Q15_ONE).astype(np.int64)
        level = np.full_like(counts, round(psi / b.flux_Vs * Q15_ONE))
        i_d, i_q = (x / Q15_ONE * b.current_A for x in lookup_references(refs, counts, level))
        axes.plot(i_d, i_q, "--", color="tab:orange", lw=1, label="stored references" if k == 0 else None)


def error_figure(motor: Motor) -> Figure:
    """What the quantised, bilinear look-up adds to the map."""
    d, q, e_d, e_q, e_t = error_plane(
        motor.tables, motor.model, motor.bases, motor.config.machine.i_max_A, motor.config.machine.pole_pairs
    )
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.2), layout="constrained")
    for ax, z, title in zip(
        axes, (1e6 * e_d, 1e6 * e_q, e_t), ("psi_d error, uVs", "psi_q error, uVs", "torque error, N·m"), strict=True
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
