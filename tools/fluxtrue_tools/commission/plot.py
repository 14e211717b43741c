# SPDX-License-Identifier: Apache-2.0
"""commission.png: the currents of all bursts, the surface with its samples, what is left, and the MTPA line. The same
panels, and those of the other steps, are drawn one by one for the live page.
"""

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from scipy.interpolate import RectBivariateSpline

from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.grid import Grid

LINES = 5
NEAR = 0.03  # of i_max: a sample belongs to a line


def _places(axes: Axes, found: Found, known: Nameplate) -> None:
    for raw in found.bursts:
        axes.plot(raw.i.real, raw.i.imag, ".-", ms=2, lw=0.4)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(known.i_max_A * np.cos(angle), known.i_max_A * np.sin(angle),
              color=plt.rcParams["text.color"], lw=1.0, label="i_max")  # fmt: skip
    axes.set(title="Currents of all bursts", xlabel="i_d, A", ylabel="i_q, A", aspect="equal")
    axes.legend(fontsize=8)


def _in_time(axes: Axes, found: Found) -> None:
    raw = max(found.bursts, key=lambda raw: len(raw.i) if all(raw.axes) else 0)
    times = 1e3 * raw.period_s * np.arange(len(raw.i))
    axes.plot(times, raw.i.real, label="i_d")
    axes.plot(times, raw.i.imag, label="i_q")
    axes.set(title="Longest burst", xlabel="time, ms", ylabel="A")
    axes.legend(fontsize=8)


def _samples(found: Found, of_d: bool) -> tuple[Array, Array]:
    """Currents and corrected flux linkages of the bursts that measure this axis."""
    assert found.surface is not None
    surface = found.surface
    which = [n for n, weights in enumerate(surface.weights) if weights[0 if of_d else 1] > 0.0]
    return np.concatenate([surface.i[n] for n in which]), np.concatenate([surface.psi[n] for n in which])


def _curves(axes: Axes, found: Found, known: Nameplate, of_d: bool) -> None:
    assert found.surface is not None
    i, psi = _samples(found, of_d)
    own, other = (i.real, np.abs(i.imag)) if of_d else (np.abs(i.imag), i.real)
    magnet = float(found.surface.model.psi_d(0.0, 0.0))
    values = psi.real - magnet if of_d else psi.imag * np.sign(i.imag)
    for k, share in enumerate(np.linspace(0.0, 0.8, LINES)):
        level = share * known.i_max_A * (1.0 if of_d else -1.0) + 0.0  # no minus zero
        reach = np.sqrt(1.0 - share**2) * known.i_max_A
        line = np.linspace(-reach if of_d else 0.0, 0.0 if of_d else reach, 80)
        there = np.full(len(line), level)
        model = found.surface.model
        drawn = model.psi_d(line, there) - magnet if of_d else model.psi_q(there, line)
        axes.plot(line, 1e3 * drawn, color=f"C{k}", lw=1.2, label=f"{'|i_q|' if of_d else 'i_d'} = {level:.3g} A")
        near = (np.abs(other - level) < NEAR * known.i_max_A) & (own >= line[0]) & (own <= line[-1])
        axes.plot(own[near], 1e3 * values[near], ".", color=f"C{k}", ms=2)
    name, along = ("psi_d", "i_d") if of_d else ("psi_q", "|i_q|")
    axes.set(
        title=f"{name}{' without psi_f' if of_d else ''}: surface (lines), samples (points)",
        xlabel=f"{along}, A",
        ylabel=f"{name}, mV·s",
    )
    axes.legend(fontsize=7)


def _left(axes: Axes, found: Found) -> None:
    assert found.surface is not None
    for n, (i, rest) in enumerate(zip(found.surface.i, found.surface.left, strict=True)):
        of_d, of_q = found.surface.weights[n]
        for part, weight, colour in ((rest.real, of_d, "C0"), (rest.imag, of_q, "C1")):
            if weight > 0.0:
                axes.plot(np.abs(i), 1e3 * part, ".", color=colour, ms=1.5)
    limit = 6e3 * found.surface.left_Vs
    axes.plot([], [], ".", color="C0", label="psi_d")
    axes.plot([], [], ".", color="C1", label="psi_q")
    axes.set(title="Samples minus surface", xlabel="|i|, A", ylabel="mV·s", ylim=(-limit, limit))
    axes.legend(fontsize=8)


def magnet_of(found: Found, known: Nameplate) -> str:
    """Where the magnet's flux linkage comes from."""
    return "the measured" if found.spun is not None else "a given" if known.psi_f_source else "the nameplate's"


def _mtpa(axes: Axes, found: Found, grid: Grid, known: Nameplate) -> None:
    d, q = np.meshgrid(grid.id_A, grid.iq_A, indexing="ij")
    torque = 1.5 * known.pole_pairs * (grid.psi_d_Vs * q - grid.psi_q_Vs * d)
    torque = np.where(np.hypot(d, q) <= 1.02 * known.i_max_A, torque, np.nan)
    shown = axes.contour(d, q, torque, levels=10, linewidths=0.8)
    axes.clabel(shown, fontsize=7, fmt="%.3g N·m")
    at = RectBivariateSpline(grid.id_A, grid.iq_A, 1.5 * known.pole_pairs * (grid.psi_d_Vs * q - grid.psi_q_Vs * d))
    angles = np.linspace(0.5 * np.pi, np.pi, 181)
    amplitudes = np.linspace(0.02, 1.0, 40) * known.i_max_A
    best = [angles[int(np.argmax(at.ev(a * np.cos(angles), a * np.sin(angles))))] for a in amplitudes]
    axes.plot(amplitudes * np.cos(best), amplitudes * np.sin(best), "r", lw=1.5, label="MTPA")
    axes.set(title=f"Torque of this map, with {magnet_of(found, known)} psi_f", xlabel="i_d, A", ylabel="i_q, A")
    axes.legend(fontsize=8)


def _offset(axes: Axes, found: Found, _: Nameplate) -> None:
    reach = 1.3 * max(abs(found.offset_A), 3.0 * found.offset_sigma_A)
    axes.axhline(0.0, color=plt.rcParams["text.color"], lw=0.8)
    axes.axvline(0.0, color=plt.rcParams["text.color"], lw=0.8)
    axes.errorbar(found.offset_A.real, found.offset_A.imag, 3.0 * found.offset_sigma_A, 3.0 * found.offset_sigma_A, "o",
                  label="offset, ±3 sigma of the noise")  # fmt: skip
    axes.set(title="Current shown without current", xlabel="alpha, A", ylabel="beta, A", aspect="equal",
             xlim=(-reach, reach), ylim=(-reach, reach))  # fmt: skip
    axes.legend(fontsize=8)
    zero = found.dc_zero
    said = "not found" if zero.unknown else f"{zero.value_V:+.3f} V ±{zero.sigma_V:.1g} V"
    axes.text(0.02, 0.02, f"offset of the dc voltage: {said}", transform=axes.transAxes, fontsize=8)


def _levels(axes: Axes, found: Found, _: Nameplate) -> None:
    """The voltages of the points contain what ripple and movement add; (CM-12) takes that away."""
    r = found.resistance
    assert r is not None
    lost_V = float((np.abs(r.volts) - r.r_ohm * np.abs(r.currents_A)).mean())
    for sign, label in ((1.0, f"slope {1e3 * r.r_ohm:.4g} mohm"), (-1.0, None)):
        line = sign * np.array([0.0, float(np.abs(r.currents_A).max())])
        axes.plot(line, r.r_ohm * line + sign * lost_V, "C1", lw=1.2, label=label)
    axes.plot(r.currents_A, r.volts, "o", ms=4, color="C0", label="levels, with ripple and movement")
    axes.set(title="Direct currents", xlabel="mean i_d, A", ylabel="mean u_d, V")
    axes.legend(fontsize=8)


def _drag(axes: Axes, found: Found, _: Nameplate) -> None:
    assert found.drag is not None
    speed = np.linspace(found.drag.from_rad_s, found.drag.to_rad_s, 100)
    axes.plot(30.0 / np.pi * speed, found.drag.torque_Nm(speed), lw=1.5)
    axes.set(title="Drag: torque against the rotation", xlabel="speed, rpm", ylabel="N·m")
    axes.set_ylim(bottom=0.0)


Panel = Callable[[Axes, Found, Nameplate], None]
# Of each step, in the order of live/wizard/files.py, which has their titles.
PANELS: Final[dict[str, tuple[Panel, ...]]] = {
    "offsets": (_offset,),
    "phases": (),
    "spin": (),
    "drag": (_drag,),
    "resistance": (_levels,),
    "map": (_places, lambda axes, found, _: _left(axes, found), partial(_curves, of_d=True),
            partial(_curves, of_d=False)),
}  # fmt: skip
_DARK = {"figure.facecolor": "#18202a", "axes.facecolor": "#18202a", "savefig.facecolor": "#18202a",
         "axes.edgecolor": "#5c6c80", "xtick.color": "#9dabba", "ytick.color": "#9dabba", "text.color": "#e8edf3",
         "axes.labelcolor": "#e8edf3", "grid.color": "#222c38", "legend.edgecolor": "#2a3543",
         "image.cmap": "cool"}  # fmt: skip
THEMES: Final[dict[str, dict[str, Any]]] = {"light": {}, "dark": _DARK}  # dark: the colours of the live page
PANEL_IN, PANEL_DPI = (5.2, 4.0), 160


def _png(draw: Callable[[Axes], None], theme: str) -> bytes:
    with plt.rc_context(THEMES[theme]):
        figure, axes = plt.subplots(figsize=PANEL_IN, layout="constrained")
        draw(axes)
        content = io.BytesIO()
        figure.savefig(content, format="png", dpi=PANEL_DPI, metadata={"Software": None})
        plt.close(figure)
    return content.getvalue()


def of_step(step: str, number: int, found: Found, known: Nameplate, theme: str) -> bytes:
    """One panel of a step as PNG."""
    draw = PANELS[step][number]
    return _png(lambda axes: draw(axes, found, known), theme)


def of_torque(found: Found, grid: Grid, known: Nameplate, theme: str) -> bytes:
    """Torque and MTPA line of the finished map as PNG."""
    return _png(lambda axes: _mtpa(axes, found, grid, known), theme)


def write(found: Found, known: Nameplate, grid: Grid | None, path: Path) -> None:
    """The figure."""
    r = found.resistance
    assert r is not None
    figure, axes = plt.subplots(2, 3, figsize=(17, 9.5), layout="constrained")
    if found.surface is None or grid is None:
        for each in axes.flat[1:]:
            each.set_visible(False)
        _levels(axes[0, 0], found, known)
    else:
        _places(axes[0, 0], found, known)
        _curves(axes[0, 1], found, known, of_d=True)
        _curves(axes[0, 2], found, known, of_d=False)
        _in_time(axes[1, 0], found)
        _left(axes[1, 1], found)
        _mtpa(axes[1, 2], found, grid, known)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)
