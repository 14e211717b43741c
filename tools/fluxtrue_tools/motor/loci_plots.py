# SPDX-License-Identifier: Apache-2.0
"""The report's figure of the current references over the current plane, with all that limits them."""

from collections.abc import Sequence

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.demagnetisation import COLD_C, hottest_C, limit_A, withstands_C
from fluxtrue_tools.motor.envelope import voltage_speed
from fluxtrue_tools.motor.flux_model import Array, torque
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.quantise import Q15_ONE
from fluxtrue_tools.motor.references import Contour, lookup_references

POINTS = 121
LIMITS_SHOWN = 7
TORQUES_SHOWN = 11
SPEEDS_APART = 0.04  # of top speed: nearer limits of the voltage could not be labelled


def current_plane(motor: Motor, both_halves: bool) -> tuple[Array, Array]:
    """i_d and i_q over the rectangle around the current circle, without its positive i_d."""
    i_max = motor.config.machine.i_max_A
    q_low = -i_max if both_halves else 0.0
    return np.meshgrid(np.linspace(-i_max, 0, POINTS), np.linspace(q_low, i_max, 2 * POINTS - 1), indexing="ij")


def _torques(axes: Axes, motor: Motor, d: Array, q: Array, inside: Array) -> None:
    t = torque(motor.model, motor.config.machine.pole_pairs, d, q)
    levels = [level for level in MaxNLocator(TORQUES_SHOWN).tick_values(0.0, float(t[inside].max())) if level > 0.0]
    lines = axes.contour(d, q, np.where(inside, t, np.nan), levels=levels, colors="tab:gray", linewidths=0.6)
    axes.clabel(lines, fontsize=7, fmt="%g N·m")
    axes.plot([], [], color="tab:gray", linewidth=0.6, label="constant torque")


def _label(axes: Axes, lines: QuadContourSet, named: dict[float, str]) -> None:
    """The names of the levels on their contours, legible where they lie on other ones."""
    for text in axes.clabel(lines, fontsize=7, fmt=lambda x: named[min(named, key=lambda known: abs(known - x))]):
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.5})


def round_speeds(low: float, high: float, apart: float) -> Array:
    """The highest speed, and round ones below it that are at least so far apart."""
    ticks = MaxNLocator(max(min(LIMITS_SHOWN, int((high - low) / apart)), 1)).tick_values(low, high)
    return np.array([*ticks[(ticks >= low) & (ticks <= high - apart)], high])


def _voltage_limits(axes: Axes, motor: Motor, d: Array, q: Array, inside: Array) -> None:
    """Where the machine needs all of the planned voltage, at some speeds between the first that matters and the top."""
    top_rpm = motor.config.machine.speed_max_rpm
    limit = np.where(inside, voltage_speed(motor, d, q), np.nan)
    speed = np.linspace(0.0, top_rpm, 401)[1:]
    matters = speed[(speed > np.nanmin(limit)) & (speed < np.nanmax(limit))]
    if len(matters) == 0:
        return
    shown = round_speeds(matters[0], matters[-1], SPEEDS_APART * top_rpm)
    # The reciprocal is finite where the flux vanishes.
    level = 1.0 / shown
    lines = axes.contour(d, q, 1.0 / np.maximum(limit, 1e-9), levels=np.sort(level), colors="tab:blue", linewidths=0.8)
    named = {float(x): f"{rpm:.0f} rpm" for x, rpm in zip(level, shown, strict=True)}
    _label(axes, lines, named)
    axes.plot([], [], color="tab:blue", linewidth=0.8, label=f"voltage limit at a speed, up to {top_rpm:g} rpm")


def _mtpv(contours: Sequence[Contour], i_max_A: float) -> tuple[Array, Array]:
    """Contour ends that lie inside the circle: the voltage, not the current, limits the torque there."""
    ends = [(c.id_A[-1], c.iq_A[-1]) for c in contours]
    inside = [(d, q) for d, q in ends if np.hypot(d, q) < 0.995 * i_max_A]
    d, q = zip(*inside, strict=True) if inside else ((), ())
    return np.array(d), np.array(q)


def loci_figure(motor: Motor) -> Figure:
    """MTPA, field weakening and MTPV with torque and flux contours, and the stored references."""
    figure, axes = plt.subplots(figsize=(9, 9.2), layout="constrained")
    d, q = current_plane(motor, False)
    inside = np.hypot(d, q) <= motor.config.machine.i_max_A
    _torques(axes, motor, d, q, inside)
    _voltage_limits(axes, motor, d, q, inside)
    angle = np.linspace(np.pi / 2, np.pi, 100)
    i_max = motor.config.machine.i_max_A
    axes.plot(i_max * np.cos(angle), i_max * np.sin(angle), "k", label="current limit i_max_A")
    contours = motor.solver.contours(np.linspace(0, motor.solver.torque_top_Nm * 0.999, 60))
    axes.plot([c.id_A[0] for c in contours], [c.iq_A[0] for c in contours], "tab:green", lw=2.5, label="MTPA")
    weakest = _mtpv(contours, i_max)
    if len(weakest[0]):
        axes.plot(*weakest, "tab:red", lw=2.5, label="MTPV")
    _stored_loci(axes, motor)
    _demagnetisation(axes, motor, d, q, inside)
    axes.set(
        title=f"Current references of {motor.config.machine.name}",
        xlabel="i_d, A",
        ylabel="i_q, A",
        xlim=(-1.02 * i_max, 0.03 * i_max),
        ylim=(0, 1.02 * i_max),
    )
    axes.set_aspect("equal")
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    return figure


def demagnetisation_limits(config: MotorConfig) -> dict[float, str]:
    """Names of the limits that lie inside the current circle, by their magnitude in A, largest first.

    Without a temperature coefficient it is one; else those at round temperatures from 20 °C to the hottest magnets that
    the firmware calculates with, and at the assumed temperature.
    """
    i_max, assumed = config.machine.i_max_A, config.magnet.assumed_C
    if config.magnet.i_d_demag_A is None:
        return {}
    first = withstands_C(config, i_max)
    if first is None:
        limit = limit_A(config, COLD_C)
        return {limit: "any temperature"} if limit < i_max else {}
    low, high = max(first, COLD_C), min(hottest_C(config), withstands_C(config, 0.0) or COLD_C)
    ticks = MaxNLocator(LIMITS_SHOWN).tick_values(low, high) if low < high else np.empty(0)
    apart = 0.5 * float(np.diff(ticks[:2])[0]) if len(ticks) > 1 else 0.0
    shown = {float(c) for c in ticks if abs(c - assumed) > apart} | {assumed}
    shown = {c for c in shown if low <= c <= high and limit_A(config, c) < i_max}
    return {limit_A(config, celsius): f"{celsius:g} °C" for celsius in sorted(shown)}


def _demagnetisation(axes: Axes, motor: Motor, d: Array, q: Array, inside: Array) -> None:
    """The limit of i_d at several temperatures of the magnets, the assumed one with a thick line."""
    config = motor.config
    if config.magnet.i_d_demag_A is None:
        return
    named = demagnetisation_limits(config)
    if not named:
        label = f"demagnetisation limit: not within i_max_A up to {hottest_C(config):g} °C"
        axes.plot([], [], color="none", label=label)
        return
    assumed = limit_A(config, config.magnet.assumed_C)
    levels = sorted(named)
    widths = [2.0 if level == assumed else 0.9 for level in levels]
    z = np.where(inside, -d, np.nan)
    lines = axes.contour(d, q, z, levels=levels, colors="tab:purple", linewidths=widths, linestyles="-.")
    _label(axes, lines, named)
    label = "demagnetisation limit of i_d at a magnet temperature"
    axes.plot([], [], color="tab:purple", ls="-.", lw=0.9, label=label)
    if assumed in named:
        label = "the same at magnet.assumed_C (winding not measured)"
        axes.plot([], [], color="tab:purple", ls="-.", lw=2.0, label=label)


def _stored_loci(axes: Axes, motor: Motor) -> None:
    """References as the firmware reads them, at some available fluxes."""
    refs, b = motor.references, motor.bases
    for k, psi in enumerate(np.linspace(refs.psi_Vs[0], refs.psi_Vs[-1], 7)):
        t = np.linspace(0, float(np.interp(psi, refs.psi_Vs, refs.torque_max_Nm)), 80)
        counts = np.round(t / b.torque_Nm * Q15_ONE).astype(np.int64)
        level = np.full_like(counts, round(psi / b.flux_Vs * Q15_ONE))
        i_d, i_q = (x / Q15_ONE * b.current_A for x in lookup_references(refs, counts, level))
        axes.plot(
            i_d,
            i_q,
            "--",
            color="tab:orange",
            lw=1,
            label="stored references, field weakening at an available flux" if k == 0 else None,
        )
