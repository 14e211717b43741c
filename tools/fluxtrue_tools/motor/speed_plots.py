# SPDX-License-Identifier: Apache-2.0
"""The report's figures over speed: envelope, losses, short circuit."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fluxtrue_tools.motor.envelope import torque_envelope
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.losses import losses
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.short_circuit import short_circuit, used_from_rpm

SPEED, TORQUE = "speed, rpm", "torque, N·m"
KILOWATTS_FROM = 2e3  # W
BATTERY_SHARES = ((0.25, ":"), (0.5, "--"))  # of the largest power that the machine can feed back


def power_unit(largest_W: float) -> tuple[float, str]:
    """Watts per unit, and its name: a small machine's power in watts."""
    return (1e3, "kW") if largest_W >= KILOWATTS_FROM else (1.0, "W")


def _allowed(torque_Nm: Array, fed_W: Array, limit_W: float) -> float:
    """Largest generating torque at a speed; NaN beyond the envelope. Slow machines feed nothing back at all torque."""
    possible = ~np.isnan(fed_W)
    rising = np.maximum.accumulate(fed_W[possible])
    return float(np.interp(limit_W, rising, torque_Nm[possible])) if rising.size else 0.0


def _generating_limits(axes: Axes, motor: Motor) -> None:
    """What remains of the generating torque if the battery takes only a share of the largest power, (LM-3)."""
    found = losses(motor, brakes=True)
    shaft_W = found.torque_Nm[:, None] * found.speed_rpm[None, :] * 2 * np.pi / 60
    fed_W = shaft_W - found.total_W
    largest_W = float(np.nanmax(fed_W))
    if largest_W <= 0.0:
        return
    watts, unit = power_unit(largest_W)
    for share, style in BATTERY_SHARES:
        allowed = [_allowed(found.torque_Nm, column, share * largest_W) for column in fed_W.T]
        name = f"generating, battery takes at most {share * largest_W / watts:.3g} {unit}"
        axes.plot(found.speed_rpm, -np.array(allowed), "tab:red", lw=1, ls=style, label=name)


def envelope_figure(motor: Motor) -> Figure:
    """Torque and power over speed, driving above the axis and generating below."""
    machine = motor.config.machine
    figure, axes = plt.subplots(figsize=(9, 5.5), layout="constrained")
    speed = np.linspace(0, machine.speed_max_rpm, 300)
    power = axes.twinx()
    driving, braking = (torque_envelope(motor, speed, brakes) for brakes in (False, True))
    largest_W = float(np.max(np.minimum(braking, machine.torque_max_Nm) * speed)) * 2 * np.pi / 60
    watts, unit = power_unit(largest_W)
    for sign, possible in ((1.0, driving), (-1.0, braking)):
        named = sign > 0
        limited = np.minimum(possible, machine.torque_max_Nm)
        axes.plot(speed, sign * possible, "tab:gray", ls=":", label="limited by current and voltage" if named else None)
        axes.plot(speed, sign * limited, "tab:green", lw=2, label="also limited by torque_max_Nm" if named else None)
        shaft_W = sign * limited * speed * 2 * np.pi / 60
        power.plot(speed, shaft_W / watts, "tab:blue", lw=1, label="shaft power" if named else None)
    _generating_limits(axes, motor)
    axes.axhline(0.0, color="k", lw=0.6)
    axes.set(xlabel=SPEED, ylabel=f"{TORQUE} (generating below 0)", xlim=(0, machine.speed_max_rpm))
    power.set(ylabel=f"shaft power, {unit}")
    for ax in (axes, power):
        top = max(abs(y) for y in ax.get_ylim())
        ax.set_ylim(-top, top)
    axes.set_title(
        f"Torque and power at {motor.config.inverter.vdc_V:g} V dc, of which the references plan "
        f"{motor.derived.ref_v_ratio:.3f} as phase voltage (peak)\nRed: examples of what remains when the bus limits "
        "the power that the battery takes",
        fontsize=10,
    )
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure


def losses_figure(motor: Motor) -> Figure:
    """Efficiency while driving, and the losses it follows from."""
    found = losses(motor)
    watts, unit = power_unit(float(np.nanmax(found.total_W)))
    figure, axes = plt.subplots(1, 2, figsize=(13, 5), layout="constrained", sharey=True)
    panels = (
        (axes[0], 100 * found.efficiency, [50, 70, 80, 85, 88, 90, 92, 94, 95, 96, 97, 98, 99], "efficiency, %"),
        (axes[1], found.total_W / watts, 10, f"losses, {unit}"),
    )
    for ax, z, levels, title in panels:
        shown = ax.contourf(found.speed_rpm, found.torque_Nm, z, levels=levels, cmap="viridis", extend="both")
        figure.colorbar(shown, ax=ax, ticks=shown.levels)
        envelope = np.minimum(torque_envelope(motor, found.speed_rpm), motor.config.machine.torque_max_Nm)
        (border,) = ax.plot(found.speed_rpm, envelope, "k", lw=1.5)
        ax.set(title=title, xlabel=SPEED, ylim=(0.0, 1.06 * motor.config.machine.torque_max_Nm))
    axes[0].set_ylabel(TORQUE)
    figure.legend([border], ["envelope"], loc="outside lower center", fontsize=8)
    parts = {"iron": found.iron_W, "device drop of the inverter": found.inverter_W}
    known = ["copper at 20 °C", *(name for name, power_W in parts.items() if np.nanmax(power_W) > 0.0)]
    missing = [name for name in parts if name not in known]
    figure.suptitle(
        f"Losses contained: {', '.join(known)}. Not contained: {', '.join([*missing, 'switching, friction'])}",
        fontsize=11,
    )
    return figure


def short_circuit_figure(motor: Motor) -> Figure:
    """Braking torque and current of the shorted machine."""
    machine, found = motor.config.machine, short_circuit(motor)
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(9, 6.5), layout="constrained", sharex=True)
    upper.plot(found.speed_rpm, found.torque_Nm, "tab:red", label="short circuit")
    upper.axhline(-machine.torque_max_Nm, color="tab:green", ls=":", label="-torque_max_Nm")
    upper.set(ylabel=TORQUE, title="Active short circuit in the steady state, windings at 20 °C")
    lower.plot(found.speed_rpm, found.current_A, "tab:red", label="short circuit")
    lower.axhline(machine.i_max_A, color="tab:green", ls=":", label="i_max_A")
    lower.axhline(motor.derived.i_trip_A, color="k", ls=":", label="over-current trip")
    lower.set(xlabel=SPEED, ylabel="peak phase current, A", xlim=(0, machine.speed_max_rpm), ylim=(0, None))
    used = used_from_rpm(motor)
    for ax in (upper, lower):
        if used < machine.speed_max_rpm:
            ax.axvspan(
                used, machine.speed_max_rpm, color="tab:blue", alpha=0.12, label="safe state: a fault shorts the phases"
            )
    named = {
        label: handle for ax in (upper, lower) for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=3, fontsize=8)
    return figure
