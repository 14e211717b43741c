# SPDX-License-Identifier: Apache-2.0
"""The paper's figures 3, 4, 7 and 8 on its machine.

The paper gives R and psi_f; speed, inductances, gain sets and the size of the magnet change in
figures 3, 4 and 7 are our assumption.
"""

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq

from fluxtrue_tools.demo.experiment import Bench, Bound, Result, number, run
from fluxtrue_tools.sim.run import Recording

SPEED_RPM: Final = 1500.0
GAIN_SETS: Final = {
    "slow": {"flux_bandwidth_rad_s": 30.0, "resistance_bandwidth_rad_s": 10.0},
    "medium": {"flux_bandwidth_rad_s": 100.0, "resistance_bandwidth_rad_s": 20.0},
    "fast": {"flux_bandwidth_rad_s": 500.0, "resistance_bandwidth_rad_s": 40.0},
}
MAGNET_CHANGE_S: Final = 0.1
PSI_ERROR_PERCENT: Final = 0.3
R_ERROR_PERCENT: Final = 2.0
SETTLE_FAST_MS: Final = 20.0
SETTLED: Final = 0.01
OPEN_ERROR_PERCENT: Final = -8.75
OPEN_ERROR_TOLERANCE: Final = 0.05
CLOSED_ERROR_PERCENT: Final = 0.3
CLOSED: Final = {"torque_loop": True, "identification": True}
OPEN: Final = {"torque_loop": False, "identification": False}


def _scenario(torque_Nm: Any, magnet: Any, controller: dict[str, Any], **more: Any) -> dict[str, Any]:
    profile = {"torque_Nm": torque_Nm, "speed_rpm": SPEED_RPM, "magnet_scale": magnet}
    return {
        "duration_s": 1.5,
        "controller": controller | {"dead_time_compensation": 0.0, "identification_mode": "paper"},
        "profile": profile | more.pop("profile", {}),
        # The currents are the states of the paper's (1), so that they are continuous when the magnet changes.
        "plant": {"ideal_inverter": True, "magnet_step_keeps_current": True},
    } | more


def settle_ms(recording: Recording, since_s: float) -> float:
    """How long after a change the identified flux stays within 1 % of the plant's."""
    now = recording["time_s"]
    off = np.abs(recording["psi_f_Vs"] / recording["true_psi_f_Vs"] - 1.0) > SETTLED
    late = now[off & (now > since_s)]
    return 0.0 if late.size == 0 else float(late[-1] - since_s) * 1e3


def _errors(recording: Recording) -> tuple[dict[str, float], list[Bound]]:
    psi = number(recording.error_percent("psi_f_Vs", "true_psi_f_Vs"))
    resistance = number(recording.error_percent("r_ohm", "true_r_ohm"))
    return (
        {"psi_error_percent": psi, "r_error_percent": resistance},
        [
            Bound("ψ error", psi, PSI_ERROR_PERCENT, "%"),
            Bound("R error", resistance, R_ERROR_PERCENT, "%"),
        ],
    )


def fig3_4(bench: Bench, gain_set: str) -> Result:
    """The magnet changes at 0.1 s: how fast and how well are psi_f and R found?"""
    scenario = _scenario(
        40.0,
        [[0, 1.0], [MAGNET_CHANGE_S, 1.0], [MAGNET_CHANGE_S, 0.85]],
        CLOSED | GAIN_SETS[gain_set],
        record_every_s=1e-4,
    )
    recording = run(bench.paper, scenario)
    errors, bounds = _errors(recording)
    settle = number(settle_ms(recording, MAGNET_CHANGE_S), 4)
    if gain_set == "fast":
        bounds.append(Bound("ψ settles to 1 % in", settle, SETTLE_FAST_MS, "ms"))
    summary = {"id": "paper-fig3-4", "gain_set": gain_set} | errors | {"psi_settle_ms": settle}
    return Result(summary, bounds, {gain_set: recording})


def fig7(bench: Bench) -> Result:
    """T* = 80 N·m while the magnet weakens and the winding warms by 60 K."""
    scenario = _scenario(
        [[0, 0], [0.05, 0], [0.05, 80]],
        [[0, 1.0], [0.3, 1.0], [0.5, 0.85]],
        CLOSED,
        profile={"winding_C": [[0, 20], [0.6, 20], [1.2, 80]]},
        duration_s=2.0,
    )
    recording = run(bench.paper, scenario)
    errors, bounds = _errors(recording)
    return Result({"id": "paper-fig7"} | errors, bounds, {"fig7": recording})


def weaken_until(error_at: Callable[[float], float], wanted: float) -> float:
    """The magnet scale at which the open loop's torque error is the wanted one."""
    return float(brentq(lambda scale: error_at(scale) - wanted, 0.7, 0.99, xtol=2e-5))


def fig8(bench: Bench) -> Result:
    """T* = 40 N·m: the magnet loses as much as makes the open loop lose 8.75 % of its torque."""

    def one(scale: float, controller: dict[str, Any]) -> Recording:
        return run(bench.paper, _scenario(40.0, scale, controller))

    def open_error(scale: float) -> float:
        return number(one(scale, OPEN).torque_error_percent, 9)

    scale = weaken_until(open_error, OPEN_ERROR_PERCENT)
    opened, closed = number(open_error(scale)), number(one(scale, CLOSED).torque_error_percent)
    summary = {
        "id": "paper-fig8",
        "magnet_scale": number(scale),
        "torque_error_open_percent": opened,
        "torque_error_closed_percent": closed,
    }
    bounds = [
        Bound("open-loop error less −8.75 %", opened - OPEN_ERROR_PERCENT, OPEN_ERROR_TOLERANCE, "%"),
        Bound("closed-loop torque error", closed, CLOSED_ERROR_PERCENT, "%"),
    ]
    return Result(summary, bounds, {"fig8": _fig8_story(bench, scale)})


def _fig8_story(bench: Bench, scale: float) -> Recording:
    """The same experiment as one figure: the magnet weakens at 0.3 s, and the loop is closed at 0.7 s."""
    magnet = [[0, 1.0], [0.3, 1.0], [0.3, scale]]
    scenario = _scenario(40.0, magnet, OPEN, duration_s=1.2)
    events = [{"t": 0.7, "set": {"torque_loop": True, "identification": True}}]
    return run(bench.paper, scenario | {"event": events})
