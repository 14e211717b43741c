# SPDX-License-Identifier: Apache-2.0
"""What is measured in a run: the first fault, the torque outside its safe range, movement, current and dc voltage.

Torque is safe between zero and the requested torque; its mean over 5 ms counts.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools import faults
from fluxtrue_tools.fault_campaign.fmea import KEEP, RAMP, Row
from fluxtrue_tools.fault_campaign.run_point import Trace

MEAN_MS: Final = 5.0
CHANGE_MS: Final = 70.0  # a changed request has been followed: slew 40 ms, jerk 10 ms, arrival of the frame 10 ms
CM_PER_RAD: Final = 32.0 / 9.0  # the assumed vehicle: wheels of 0.32 m behind a gear of 9:1
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """Figures of a safe state; also their limits."""

    torque_Nm: float  # largest, once the torque must be safe: a safe state has none, whatever is requested
    current_A: float
    vdc_V: float


def mean(torque: Array, period_s: float) -> Array:
    """Over the last 5 ms."""
    count = max(1, round(MEAN_MS * 1e-3 / period_s))
    sums = np.cumsum(np.concatenate([np.zeros(count), torque]))
    return (sums[count:] - sums[:-count]) / count


def first_fault(trace: Trace) -> tuple[str, float]:
    """The names that came first after the injection, and when; NaN: none."""
    after = trace.time_ms > 0.0
    words = np.nan_to_num(trace["fault_word"][after]).astype(np.int64)
    times = trace.time_ms[after]
    hits = np.flatnonzero(words)
    drive = (float(times[hits[0]]), faults.named(int(words[hits[0]]))) if hits.size else (math.inf, [])
    named = faults.explained("INV_Faults.EcuFaults")
    ecu_ms, ecu_word = next(((ms, word) for ms, word, _ in trace.ecu if word), (math.inf, 0))
    ecu = [name for bit, (name, _) in named.items() if ecu_word >> bit & 1]
    found = drive if drive[0] <= ecu_ms else (ecu_ms, ecu)
    return "|".join(found[1]), found[0] if found[1] else math.nan


def outside(trace: Trace, row: Row, rated_Nm: float) -> Array:
    """Distance of the mean torque from its safe range; 0 inside. No request is worth more than the largest torque."""
    torque, time = mean(trace["truth.torque_shaft_mean_Nm"], trace.period_s), trace.time_ms
    before = float(trace["truth.torque_shaft_mean_Nm"][time <= 0.0].mean())
    old, new = trace.requested_Nm
    target = before if new == old else min(max(new, -rated_Nm), rated_Nm)
    ends = [before, target] if row.reaction == KEEP else [before, target, 0.0]
    low, high = np.full(len(torque), min(ends)), np.full(len(torque), max(ends))
    if row.reaction == KEEP:
        followed = time > CHANGE_MS
        low[followed] = high[followed] = target
    if row.reaction == RAMP:
        stopped = time > row.torque_ms
        low[stopped] = high[stopped] = 0.0
    distance = np.maximum(np.maximum(low - torque, torque - high), 0.0)
    distance[time <= 0.0] = 0.0
    return np.asarray(distance)


def departs(trace: Trace, row: Row, detect_ms: float, tolerance_Nm: float, distance: Array) -> bool:
    """Whether the torque leaves its tolerance before the fault: of the present torque, of a changed request."""
    before_fault = trace.time_ms < (math.inf if math.isnan(detect_ms) else detect_ms)
    if trace.requested_Nm[0] != trace.requested_Nm[1]:
        return bool((distance[before_fault] > tolerance_Nm).any())
    torque = trace["truth.torque_shaft_mean_Nm"]
    error = np.abs(mean(torque, trace.period_s) - float(torque[trace.time_ms <= 0.0].mean()))
    return bool((error[before_fault & (trace.time_ms > row.torque_ms)] > tolerance_Nm).any())


def against_cm(trace: Trace, detect_ms: float) -> float:
    """The largest movement of the vehicle against the request, from the injection to the fault or the end."""
    time, angle = trace.time_ms, np.unwrap(trace["truth.theta_m_rad"])
    until = (time > 0.0) & (time <= (math.inf if math.isnan(detect_ms) else detect_ms))
    moved = np.sign(trace.requested_Nm[1]) * (angle[until] - angle[time <= 0.0][-1])
    return float(CM_PER_RAD * max(0.0, -moved.min(initial=0.0)))


def outcome(trace: Trace, from_ms: float, safe_ms: float) -> Outcome:
    """Current and dc voltage after a time, torque after another one."""
    time = trace.time_ms
    torque = np.abs(mean(trace["truth.torque_shaft_mean_Nm"], trace.period_s))[time > safe_ms]
    current = np.hypot(trace["truth.i_d_A"], trace["truth.i_q_A"])[time > from_ms]
    voltage = trace["truth.vdc_V"][time > from_ms]
    return Outcome(float(torque.max(initial=0.0)), float(current.max(initial=0.0)), float(voltage.max(initial=0.0)))
