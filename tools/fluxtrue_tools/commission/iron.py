# SPDX-License-Identifier: Apache-2.0
"""Iron losses of the coasting machine: (CM-29), (CM-30).

The current control holds the terminal current along q at zero. The iron takes a current from the windings, so that the
magnetising current along q is not zero, and the flux linkage is turned against the magnet: backwards in either
direction of rotation. A sensor that is late turns it forwards.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.motor.flux_model import FluxModel

LIMIT_SHARE = 0.2  # of i_max: the iron of a machine takes less at these speeds
SIGMAS = 3.0
LEAST_RAD = 5e-4  # a fifth of the bound of the offset: less is not told from the errors of the step
UNCERTAINTY = 0.3  # of the sum: one speed does not show how much of it is hysteresis


@dataclass(frozen=True)
class Iron:
    """P = (k_h |w| + k_e w^2) |psi|^2 (PL-8); half of it is taken for hysteresis at the speed of the measurement."""

    per_flux: float  # k_h + k_e w there, W/(rad/s V^2 s^2)
    sigma: float
    omega_rad_s: float  # electrical

    @property
    def hysteresis(self) -> float:
        """k_h."""
        return 0.5 * self.per_flux

    @property
    def eddy(self) -> float:
        """k_e."""
        return 0.5 * self.per_flux / self.omega_rad_s


def measure(spun: Spun, model: FluxModel, i_max_A: float) -> Iron | None:
    """None: the flux linkage is not turned backwards by more than the errors of the measurement."""
    behind_rad = -spun.lag_s * spun.omega_rad_s
    if behind_rad < max(SIGMAS * spun.offset_sigma_rad, LEAST_RAD):
        return None

    def too_far(i_q_A: float) -> float:
        return float(np.arctan2(model.psi_q(0.0, i_q_A), model.psi_d(0.0, i_q_A))) - behind_rad

    top_A = LIMIT_SHARE * i_max_A
    i_q_A = brentq(too_far, 0.0, top_A) if too_far(top_A) > 0.0 else top_A
    per_flux = 1.5 * i_q_A / float(model.psi_d(0.0, i_q_A))
    return Iron(per_flux, per_flux * spun.offset_sigma_rad / math.tan(behind_rad), spun.omega_rad_s)
