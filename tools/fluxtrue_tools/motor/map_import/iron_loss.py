# SPDX-License-Identifier: Apache-2.0
"""Iron losses fitted to (k_h |omega| + k_e omega^2) |psi|^2 (docs/theory/plant.md, PL-8)."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import FluxModel
from fluxtrue_tools.motor.map_import import table
from fluxtrue_tools.motor.map_import.frame import Convention, currents
from fluxtrue_tools.motor.map_import.source import LOSS_QUANTITIES, PLACES, Losses

OPTION = "--iron-loss-column"
SHARE = 0.5  # of hysteresis, where only one speed is known


@dataclass(frozen=True)
class IronLoss:
    """The two coefficients and what they leave."""

    hysteresis: float
    eddy: float
    points: int
    rms_W: float
    max_W: float
    largest_W: float
    share: float  # of the rms loss that is left
    assumed: bool  # that both shares are equal, for want of a second speed


def read(path: Path, given: tuple[str, ...], convention: Convention, turn: complex, pole_pairs: int) -> Losses:
    """A table of losses over speed or frequency, and over currents if it has them."""
    found, said = table.read(path, given, LOSS_QUANTITIES, ("loss",), OPTION)
    if "angle_unit" in said and said["angle_unit"] != convention.angle_unit:
        raise FluxtrueError(f"{path}: gamma in {said['angle_unit']}, allowed: {convention.angle_unit}, as in the map")
    clock = [name for name in ("speed", "frequency") if name in found]
    if len(clock) != 1:
        what = "both speed and frequency" if clock else "neither speed nor frequency"
        raise FluxtrueError(f"{path}: {what}, wanted: one of them; name it with {OPTION} speed=HEADER (rpm, of the "
                            "shaft) or frequency=HEADER (Hz, electrical)")  # fmt: skip
    factor = 2.0 * math.pi * (pole_pairs / 60.0 if clock[0] == "speed" else 1.0)
    omega = np.abs(factor * found[clock[0]])
    pairs = [pair for pair in PLACES if {*pair} <= {*found}]
    i = turn * currents(found, convention, pairs[0]) if pairs else np.zeros(len(omega), dtype=complex)
    return Losses(i.real, i.imag, omega, found["loss"])


def from_points(given: tuple[tuple[float, float], ...], pole_pairs: int) -> Losses:
    """Losses in W at speeds in rpm, without current."""
    loss_W, rpm = np.array(given).T
    none = np.zeros(len(given))
    return Losses(none, none, 2.0 * math.pi * pole_pairs * rpm / 60.0, loss_W)


def fit(losses: Losses, model: FluxModel, i_max_A: float, where: str) -> IronLoss:
    """Both coefficients, not negative, by the least error of the braking torque, which is loss over speed."""
    used = (losses.omega_rad_s > 0.0) & (np.hypot(losses.i_d, losses.i_q) <= i_max_A * (1.0 + 1e-9))
    omega, loss = losses.omega_rad_s[used], losses.loss_W[used]
    if not len(omega):
        raise FluxtrueError(f"{where}: no loss at a speed above 0 and a current up to i_max_A, wanted: at least one")
    if loss.min() < 0.0:
        raise FluxtrueError(f"{where}: loss = {loss.min():g} W, allowed: 0 W and above")
    i_d, i_q = losses.i_d[used], losses.i_q[used]
    squared = model.psi_d(i_d, i_q) ** 2 + model.psi_q(i_d, i_q) ** 2
    single = bool(np.ptp(omega) < 0.05 * omega.max())
    if single:
        per_squared = float(np.sum(loss / omega * squared) / np.sum(squared**2))
        coefficients = np.array((SHARE * per_squared, (1.0 - SHARE) * per_squared / omega.mean()))
    else:
        scale = omega.max()
        rows = np.column_stack((squared, squared * omega / scale))
        size = float(np.abs(rows).max())
        coefficients = nnls(rows / size, loss / omega)[0] / size
        coefficients[1] /= scale
    left = loss - (coefficients[0] * omega + coefficients[1] * omega**2) * squared
    return IronLoss(float(coefficients[0]), float(coefficients[1]), len(omega), float(np.sqrt(np.mean(left**2))),
                    float(np.abs(left).max()), float(loss.max()),
                    float(np.sqrt(np.sum(left**2) / max(np.sum(loss**2), 1e-300))), single)  # fmt: skip
