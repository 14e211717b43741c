# SPDX-License-Identifier: Apache-2.0
"""At which back-EMF the diodes of a bridge that is switched off can keep currents flowing, without any loss."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.optimize import brentq

from fluxtrue_tools.motor.flux_model import MODELS_KEPT, Array, FluxModel

POINTS: Final = 401  # along i_d
BISECTIONS: Final = 40
SIX_STEP: Final = 2.0 * math.sqrt(3.0) / math.pi  # line voltage's fundamental over v_dc, peak: (SS-24)
PULSE_SHARE: Final = math.hypot(1.0, 2.0 * math.pi / 3.0 - math.sqrt(3.0))  # e/v_dc, up to which pulses end: (SS-26)


def _cancelling_id_A(model: FluxModel, step_A: float) -> float:
    """The current that cancels the magnets' flux."""
    low = -step_A
    while float(model.psi_d(low, 0.0)) > 0.0:
        low *= 2.0
    return float(brentq(lambda i_d: float(model.psi_d(i_d, 0.0)), low, 0.0))


def _orthogonal_iq_A(model: FluxModel, i_d: Array, top_A: float) -> Array:
    """psi_d i_d + psi_q i_q = 0: the voltage of the turning flux is opposite to the current."""
    low, high = np.zeros_like(i_d), np.full_like(i_d, top_A)
    for _ in range(BISECTIONS):
        q = 0.5 * (low + high)
        below = model.psi_d(i_d, q) * i_d + model.psi_q(i_d, q) * q < 0.0
        low, high = np.where(below, q, low), np.where(below, high, q)
    return 0.5 * (low + high)


@lru_cache(maxsize=MODELS_KEPT)
def largest_flux_share(model: FluxModel) -> float:
    """kappa, the largest flux of a machine that generates into diodes, over that of its magnets alone, which is not 0:
    a machine without magnets is refused when its data are read."""
    psi_f = float(model.psi_d(0.0, 0.0))
    step_A = psi_f / float(model.psi_d(0.0, 0.0, nd=1))
    end_A = _cancelling_id_A(model, step_A)
    i_d = np.linspace(end_A, 0.0, POINTS)
    i_q = _orthogonal_iq_A(model, i_d, -10.0 * end_A)
    return float(np.hypot(model.psi_d(i_d, i_q), model.psi_q(i_d, i_q)).max()) / psi_f


def sustained_share(model: FluxModel) -> float:
    """e_c/v_dc (SS-24): below this line back-EMF no current is sustained."""
    return SIX_STEP / largest_flux_share(model)
