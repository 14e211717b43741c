# SPDX-License-Identifier: Apache-2.0
"""What is known of a motor before it is commissioned."""

import math
from dataclasses import dataclass

SWING_DEG, SWING_SHAFT_DEG, SWING_MOST_DEG = 15.0, 3.75, 44.0  # electrical, of the shaft, and what the firmware takes
BRAKE_SHARE = 0.02  # of i_max: small enough for the monitors of a current that follows slowly


@dataclass(frozen=True)
class Nameplate:
    """Of the folder that `fluxtrue motor start` makes; guesses but for the current, the pole pairs and the speed."""

    i_max_A: float
    speed_max_rpm: float
    r_ohm: float
    psi_f_Vs: float
    pole_pairs: int
    inertia_kgm2: float
    level_V: float  # lost by a leg of the inverter
    knee_A: float  # from which the drive compensates all of it
    psi_f_source: str = ""  # of psi_f_Vs, when the user has given a better value than the guess
    v_dc_full_scale_V: float = 0.0
    v_dc_offset_V: float = 0.0  # that the firmware subtracts
    v_dc_offset_max_V: float = 0.0  # that it can subtract
    adc_bits: int = 12
    offset_A: complex = 0.0  # of the current sensors in the stationary frame, as soon as it is measured

    @property
    def swing_deg(self) -> float:
        """Electrical degrees by which the rotor may move in a burst. With many pole pairs the same torque moves it by
        more of them, while the shaft moves less."""
        return min(max(SWING_DEG, SWING_SHAFT_DEG * self.pole_pairs), SWING_MOST_DEG)

    def gained_rpm(self, i_q_A: float, seconds: float) -> float:
        """By a current along q, with the guesses."""
        torque_Nm = 1.5 * self.pole_pairs * self.psi_f_Vs * i_q_A
        return torque_Nm * seconds / self.inertia_kgm2 * 30.0 / math.pi

    def brake_A(self, speed_rpm: float, seconds: float, lightness: float = 1.0) -> float:
        """A current along q that takes the speed away in this time, or less of it.

        lightness   of the rotor, as a multiple of the guess
        """
        wanted = -speed_rpm / (lightness * self.gained_rpm(1.0, seconds))
        most = BRAKE_SHARE * self.i_max_A
        return min(max(wanted, -most), most)
