# SPDX-License-Identifier: Apache-2.0
"""The cost of the same functions in other projects.

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
    Peer("sqrt", "sqrt", OPENINVERTER, 49, 4.5e-4, "relative"),
    Peer("sqrt", "arm_sqrt_q31", CMSIS, 58, 2e-9, "of 1"),
    Peer("divide", "arm_divide_q15", CMSIS, 78),
)


@dataclass(frozen=True)
class Loop:
    """A whole control tick of another project."""

    source: str
    content: str
    average: int
    maximum: int


# 1000 ticks in closed loop each, in the same emulation. No other project uses flux tables or identifies parameters.
LOOPS = (
    Loop("teslabs/spinner 06be152", "float: sincos, 2 PID, clamp, SVM", 206, 208),
    Loop("CMSIS-DSP ec1bb75 composed", "q31: sincos, transforms, 2 PID; no SVM", 231, 231),
    Loop(ST, "q15: 3 shunts, 2 PI, circle limit, SVPWM", 305, 309),
    Loop(OPENINVERTER, "fixed: 2 PI, q limit, SVPWM", 310, 314),
    Loop("ODrive f9b5419", "float: PI, limit, SVM; no decoupling", 415, 424),
    Loop("hoverboard-FOC a0751d5", "fixed: hall position, 2 PI, limits", 542, 670),
    Loop("VESC b9d287b", "float: + decoupling, dead time, filters", 561, 563),
    Loop("moteus db1a762", "float: filters, PI, feed-forward, SVM", 684, 684),
    Loop("SimpleFOC 7f9c45f", "float: sensor, 2 sincos, 2 PID, SVPWM", 763, 792),
)
