# SPDX-License-Identifier: Apache-2.0
"""What an error of the angle does to the currents that the drive has in its rotor frame."""

from __future__ import annotations

import numpy as np

from fluxtrue_tools.sim.library import Loop

PERIODS = 100


def error_A(loop: Loop) -> float:
    """The drive's currents and the machine's, each a mean: an angle that is wrong moves them from one axis to the
    other, 6 mrad of 90 A by 0.5 A."""
    loop.record(("id_A", "truth.i_d_A", "iq_A", "truth.i_q_A"), 1)
    i_d, true_d, i_q, true_q = np.mean(loop.run(PERIODS), axis=0)
    return float(np.hypot(i_d - true_d, i_q - true_q))
