# SPDX-License-Identifier: Apache-2.0
"""What the same functions cost elsewhere.

Measured with gcc 12.2 for Cortex-M4 (hard float ABI) in emulation, instructions issued, with the
largest error found. Facts about published code; none of that code is here.
"""

from __future__ import annotations

from dataclasses import dataclass

CMSIS = "CMSIS-DSP ec1bb75"
OPENINVERTER = "OpenInverter core 13aaea0"
ST = "ST FOC library v2 (2008)"


@dataclass(frozen=True)
class Peer:
    """One function of another project."""

    function: str  # the group it is compared within
    name: str
    source: str
    instructions: int
    error: float | None = None
    unit: str = ""


PEERS = (
    Peer("sincos", "arm_sin_q15, sine only", CMSIS, 19, 1.4e-4, "of 1"),
    Peer("sincos", "arm_sin_q31, sine only", CMSIS, 21, 1.9e-5, "of 1"),
    Peer("sincos", "arm_sin_cos_q31", CMSIS, 124, 3.6e-3, "of 1"),
    Peer("sincos", "sine and cosine", ST, 28, 6.1e-3, "of 1"),
    Peer("sincos", "sine only", OPENINVERTER, 5, 3.0e-3, "of 1"),
    Peer("atan2", "atan2", OPENINVERTER, 40, 1.3e-4, "rad"),
    Peer("atan2", "arm_atan2_q15", CMSIS, 161, 3e-4, "rad"),
    Peer("sqrt", "sqrt", OPENINVERTER, 49, 4.5e-4, "relative"),
    Peer("sqrt", "arm_sqrt_q31", CMSIS, 58, 2e-9, "of 1"),
    Peer("divide", "arm_divide_q15", CMSIS, 78),
)
