# SPDX-License-Identifier: Apache-2.0
"""A torque step and a current step on the measured machine."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.demo.experiment import Bench, Bound, Result, number, run

STEP_S: Final = 0.05
SPEED_RPM: Final = 2000.0
TORQUE_NM: Final = 100.0
CURRENT_A: Final = 50.0
TORQUE_RISE_MS: Final = 3.0
TORQUE_OVERSHOOT_PERCENT: Final = 5.0
CURRENT_RISE_MS: Final = 1.0
CURRENT_OVERSHOOT_PERCENT: Final = 10.0


def rise_ms(now: NDArray[np.float64], value: NDArray[np.float64], final: float) -> float:
    """10 to 90 % of the final value, interpolated between samples; NaN when never reached."""

    def crossing(share: float) -> float:
        above = value >= share * final
        if not above.any() or above[0]:
            return float("nan")
        k = int(np.argmax(above))
        part = (share * final - value[k - 1]) / (value[k] - value[k - 1])
        return float(now[k - 1] + part * (now[k] - now[k - 1]))

    return 1e3 * (crossing(0.9) - crossing(0.1))


def overshoot_percent(value: NDArray[np.float64], final: float) -> float:
    """Overshoot in percent of the final value."""
    return max(0.0, 100.0 * (float(value.max()) / final - 1.0))


def torque_step(bench: Bench) -> Result:
    """0 to 100 N·m with the slew limit open; then 50 A of i_q with the torque path bypassed."""
    base = {"duration_s": 0.25, "record_every_s": 1e-4, "window": {"from_s": 0.15}}
    profile = {"speed_rpm": SPEED_RPM}
    step = [[0, 0], [STEP_S, 0], [STEP_S, TORQUE_NM]]
    torque = run(
        bench.hsm1,
        base | {"controller": {"torque_slew_Nm_per_s": 0}, "profile": profile | {"torque_Nm": step}},
    )
    current = run(
        bench.hsm1,
        base
        | {
            "controller": {"current_mode": 1, "id_ref_A": 0, "iq_ref_A": 0},
            "profile": profile,
            "event": [{"t": STEP_S, "set": {"iq_ref_A": CURRENT_A}}],
        },
    )
    final = torque.mean("true_torque_Nm")
    after = torque["time_s"] > STEP_S
    rise = number(rise_ms(torque["time_s"][after], torque["true_torque_Nm"][after], final), 4)
    over = number(overshoot_percent(torque["true_torque_Nm"][after], final), 4)
    i_final = current.mean("true_i_q_A")
    i_rise = number(rise_ms(current["time_s"][after], current["true_i_q_A"][after], i_final), 4)
    i_over = number(overshoot_percent(current["true_i_q_A"][after], i_final), 4)
    summary = {
        "id": "torque-step",
        "rise_ms": rise,
        "overshoot_percent": over,
        "current_rise_ms": i_rise,
        "current_overshoot_percent": i_over,
    }
    bounds = [
        Bound("torque rise 10–90 %", rise, TORQUE_RISE_MS, "ms"),
        Bound("torque overshoot", over, TORQUE_OVERSHOOT_PERCENT, "%"),
        Bound("current rise 10–90 %", i_rise, CURRENT_RISE_MS, "ms"),
        Bound("current overshoot", i_over, CURRENT_OVERSHOOT_PERCENT, "%"),
    ]
    return Result(summary, bounds, {"torque": torque, "current": current})
