# SPDX-License-Identifier: Apache-2.0
"""The error of an ideal linear estimator with the same data, docs/theory/information-bound.md.

Units    torque error in percent of max(|requested torque|, a tenth of rated), one standard deviation
"""

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign.bound_model import STATES, Complex, Physics, physics_of, truth_of
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.sample import Sample
from fluxtrue_tools.campaign.spec import Campaign

if TYPE_CHECKING:
    from fluxtrue_tools.campaign.tour import Trace

Array = NDArray[np.float64]
STEP: Final = 1e-4  # of every state, for the differences
MIN_CURRENT_A: Final = 2.0  # below this current the direction of the dead-time voltage is random


def prior_variances(campaign: Campaign, machine: Machine) -> Array:
    """(IB-5): a uniform range of half width a has the variance a²/3; the mean of three gains a third of it."""
    spread = campaign.spread

    def variance(limits: tuple[float, float]) -> float:
        return ((limits[1] - limits[0]) / 2.0) ** 2 / 3.0

    known = {
        "resistance": machine.r_temp_coeff_per_K**2 * variance(spread.winding_error_C),
        "magnet": variance(spread.magnet_scale),
        "lq": variance(spread.lq_scale),
        "ld_slope": variance(spread.ld_slope_scale),
        "cross": variance(spread.cross_saturation_scale),
        "dead_time": variance(spread.dead_time_scale),
        "device_drop": variance(spread.device_drop_error_V),
        "vdc_gain": variance(spread.vdc_gain),
        "current_gain": variance(spread.current_gain) / 3.0,
        "angle": np.radians(1.0) ** 2 * variance(spread.angle_offset_deg),
        "iron": variance(spread.iron_loss_scale),
    }
    return np.maximum([known[name] for name in STATES], 1e-18)  # a range of one value: the parameter is known


def noise_variance(campaign: Campaign, machine: Machine, omega: Array, periods: float) -> Array:
    """(IB-6): white sensor noise of one axis, as volts, in a mean over `periods`."""
    plant = machine.motor.plant | campaign.plant.values()
    current = 2.0 / 3.0 * (campaign.noise_share * plant["current_full_scale_A"]) ** 2
    bits = plant.get("angle_bits", 0.0)
    angle = (2.0 * np.pi * machine.pole_pairs / 2.0**bits) ** 2 / 12.0 if bits else 0.0
    inductance = float(machine.model.psi_q(0.0, 0.0, nq=1))
    psi = machine.motor.psi_f_Vs
    ohms = machine.motor.r_ohm**2 + (omega * inductance) ** 2
    return np.asarray((ohms * current + (omega * psi) ** 2 * angle) / periods)


def voltage_jacobian(physics: Physics, x: Array, i_seen: Complex, omega: Array) -> Array:
    """Rows d and q of every point, (2n, states), by central differences."""
    columns = []
    for k in range(x.size):
        step = np.zeros(x.size)
        step[k] = STEP
        slope = (physics.voltage(x + step, i_seen, omega) - physics.voltage(x - step, i_seen, omega)) / (2.0 * STEP)
        columns.append(np.concatenate([slope.real, slope.imag]))
    return np.stack(columns, axis=1)


def torque_jacobian(physics: Physics, x: Array, i_seen: Complex, omega: Array) -> Array:
    """Derivatives of the torque, (n, states)."""
    columns = []
    for k in range(x.size):
        step = np.zeros(x.size)
        step[k] = STEP
        up, down = (physics.torque(x + s, i_seen, omega) for s in (step, -step))
        columns.append((up - down) / (2.0 * STEP))
    return np.stack(columns, axis=1)


def information(jacobian: Array, variance: Array) -> Array:
    """(IB-7): sum of H' H / variance over the rows."""
    return np.asarray(jacobian.T @ (jacobian / variance[:, None]))


def torque_deviation(information_of_drive: Array, per_window: list[Array], slopes: Array) -> Array:
    """(IB-8): torque's standard deviation in each window, from the information of the drive and the window itself."""
    deviation = []
    for own, slope in zip(per_window, slopes, strict=True):
        total = information_of_drive + own
        scale = 1.0 / np.sqrt(
            np.diag(total)
        )  # the states differ by orders of magnitude; scaling keeps the matrix well conditioned
        covariance = np.linalg.inv(total * np.outer(scale, scale)) * np.outer(scale, scale)
        deviation.append(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
    return np.array(deviation)


def _points(trace: "Trace", rows: Array) -> tuple[Complex, Array]:
    column = trace.columns.index
    current = rows[:, column("truth.i_d_A")] + 1j * rows[:, column("truth.i_q_A")]
    return current, rows[:, column("truth.speed_rad_s")]


def of_case(campaign: Campaign, machine: Machine, drawn: Sample, trace: "Trace") -> list[float]:
    """The bound in percent for every window of one controller's run."""
    physics, x = physics_of(machine, drawn), truth_of(machine, drawn)
    current, speed = _points(trace, trace.drive)
    kept = np.isfinite(current) & (np.abs(current) > MIN_CURRENT_A)
    omega = machine.pole_pairs * speed[kept]
    seen = physics.seen(x, current[kept])
    rows = voltage_jacobian(physics, x, seen, omega)
    per_row = 0.01 / (1.0 / machine.motor.plant["pwm_hz"])
    variance = np.tile(noise_variance(campaign, machine, omega, per_row), 2)
    information_of_drive = np.diag(1.0 / prior_variances(campaign, machine)) + information(rows, variance)
    return _of_windows(campaign, machine, physics, x, information_of_drive, trace)


def _of_windows(campaign: Campaign, machine: Machine, physics: Physics, x: Array, information_of_drive: Array,
                trace: "Trace") -> list[float]:  # fmt: skip
    means = np.array([rows.mean(axis=0) for rows in trace.windows])
    current, speed = _points(trace, means)
    if not np.isfinite(current).all():
        return [float("nan")] * len(trace.windows)
    omega, seen = machine.pole_pairs * speed, physics.seen(x, current)
    rows = voltage_jacobian(physics, x, seen, omega)
    count = len(trace.windows)
    periods = np.array([rows.shape[0] for rows in trace.windows]) * 1e-3 * machine.motor.plant["pwm_hz"]
    variance = noise_variance(campaign, machine, omega, 1.0) / periods
    own = [information(rows[[k, k + count]], np.full(2, variance[k])) for k in range(count)]
    deviation = torque_deviation(information_of_drive, own, torque_jacobian(physics, x, seen, omega))
    requested = means[:, trace.columns.index("torque_requested_Nm")]
    base = np.maximum(np.abs(requested), 0.1 * machine.rated_Nm)
    return [float(value) for value in 100.0 * deviation / base]
