# SPDX-License-Identifier: Apache-2.0
"""What a run must have done: the simulated machine's torque, current and dc voltage, and the time of the reaction.

Torque is safe between zero and what is requested, widened by max(10 N·m, 5 % of the largest torque); what counts is its
mean over 5 ms. Losing torque is therefore no harm, too much torque or torque of the wrong sign is. Where a line bounds
the movement of the vehicle against the request, wrong torque may last until the fault.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools import faults
from fluxtrue_tools.fault_campaign.fmea import BOUNDED, KEEP, RAMP, Point, Row
from fluxtrue_tools.fault_campaign.run_point import Trace
from fluxtrue_tools.fault_campaign.spec import Bounded
from fluxtrue_tools.sim.ecu_loop import RUN

MEAN_MS: Final = 5.0
TOLERANCE_NM, TOLERANCE_SHARE = 10.0, 0.05
CHANGE_MS: Final = 70.0  # a changed request has been followed: slew 40 ms, jerk 10 ms, arrival of the frame 10 ms
DERATE: Final = 5
CM_PER_RAD: Final = 32.0 / 9.0  # the assumed vehicle: wheels of 0.32 m behind a gear of 9:1
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Verdict:
    """The verdict of one run; NaN: it did not happen."""

    first_fault: str
    detect_ms: float
    harm_ms: float  # end of the last time in which the torque was not safe
    beyond_Nm: float  # largest distance from the safe range
    against_cm: float  # largest movement of the vehicle against the request until the fault
    current_A: float
    vdc_V: float
    state: int
    met: bool
    why: str


def _mean(torque: Array, period_s: float) -> Array:
    """Over the last 5 ms."""
    count = max(1, round(MEAN_MS * 1e-3 / period_s))
    sums = np.cumsum(np.concatenate([np.zeros(count), torque]))
    return (sums[count:] - sums[:-count]) / count


def _first_fault(trace: Trace, after: NDArray[np.bool_]) -> tuple[str, float]:
    """The names that came first, and when."""
    words = np.nan_to_num(trace["fault_word"][after]).astype(np.int64)
    times = trace.time_ms[after]
    hits = np.flatnonzero(words)
    drive = (float(times[hits[0]]), faults.named(int(words[hits[0]]))) if hits.size else (math.inf, [])
    named = faults.explained("INV_Faults.EcuFaults")
    ecu_ms, ecu_word = next(((ms, word) for ms, word, _ in trace.ecu if word), (math.inf, 0))
    ecu = [name for bit, (name, _) in named.items() if ecu_word >> bit & 1]
    found = drive if drive[0] <= ecu_ms else (ecu_ms, ecu)
    return "|".join(found[1]), found[0] if found[1] else math.nan


def _beyond(trace: Trace, row: Row, tolerance: float, rated_Nm: float) -> Array:
    """Distance of the mean torque from its safe range; 0 inside. No request is worth more than the largest torque."""
    mean, time = _mean(trace["truth.torque_shaft_mean_Nm"], trace.period_s), trace.time_ms
    before = float(trace["truth.torque_shaft_mean_Nm"][time <= 0.0].mean())
    old, new = trace.requested_Nm
    target = before if new == old else min(max(new, -rated_Nm), rated_Nm)
    ends = [before, target] if row.reaction == KEEP else [before, target, 0.0]
    low, high = np.full(len(mean), min(ends)), np.full(len(mean), max(ends))
    if row.reaction == KEEP:
        followed = time > CHANGE_MS
        low[followed] = high[followed] = target
    if row.reaction == RAMP:
        stopped = time > row.torque_ms
        low[stopped] = high[stopped] = 0.0
    outside = np.maximum(np.maximum(low - tolerance - mean, mean - high - tolerance), 0.0)
    outside[time <= 0.0] = 0.0
    return np.asarray(outside)


def _against_cm(trace: Trace, detect_ms: float) -> float:
    """The largest movement of the vehicle against the request, from the injection to the fault or the end."""
    time, angle = trace.time_ms, np.unwrap(trace["truth.theta_m_rad"])
    until = (time > 0.0) & (time <= (math.inf if math.isnan(detect_ms) else detect_ms))
    moved = np.sign(trace.requested_Nm[1]) * (angle[until] - angle[time <= 0.0][-1])
    return float(CM_PER_RAD * max(0.0, -moved.min(initial=0.0)))


def _departs(trace: Trace, row: Row, v: dict[str, Any], tolerance: float, beyond: Array) -> bool:
    """Whether the torque leaves its tolerance before the fault: of the present torque, of a changed request."""
    before_fault = trace.time_ms < (math.inf if math.isnan(v["detect_ms"]) else v["detect_ms"])
    if trace.requested_Nm[0] != trace.requested_Nm[1]:
        return bool((beyond[before_fault] > 0.0).any())
    torque = trace["truth.torque_shaft_mean_Nm"]
    error = np.abs(_mean(torque, trace.period_s) - float(torque[trace.time_ms <= 0.0].mean()))
    return bool((error[before_fault & (trace.time_ms > row.torque_ms)] > tolerance).any())


def _about_fault(row: Row, v: dict[str, Any], departs: bool) -> str:
    """What is wrong with the detection; empty: nothing."""
    said = f"{v['first_fault']} after {v['detect_ms']:.1f} ms" if v["first_fault"] else "no fault"
    if row.reaction in (KEEP, RAMP):
        return f"false trip: {said}" if v["first_fault"] else ""
    is_expected = row.expected == ("any",) or bool(set(v["first_fault"].split("|")) & set(row.expected))
    if row.reaction == BOUNDED and not departs:
        return said if v["first_fault"] and not is_expected else ""
    return "" if v["first_fault"] and is_expected and v["detect_ms"] <= row.detect_ms else said


def _complaints(row: Row, bounds: Bounded, v: dict[str, Any], departs: bool) -> list[str]:
    found = [said] if (said := _about_fault(row, v, departs)) else []
    if v["against_cm"] > row.against_cm:
        found.append(f"{v['against_cm']:.1f} cm against the request")
    until_ms = row.torque_ms if math.isnan(row.against_cm) else v["detect_ms"] + MEAN_MS
    if v["harm_ms"] > until_ms:
        found.append(f"torque {v['beyond_Nm']:.1f} N·m beyond its safe range until {v['harm_ms']:.0f} ms")
    if row.reaction == KEEP and not v["first_fault"] and v["state"] not in (RUN, DERATE):
        found.append(f"left state run for state {v['state']}")
    if v["current_A"] > row.current_share * bounds.current_A:
        found.append(f"{v['current_A']:.0f} A")
    if v["vdc_V"] > row.vdc_share * bounds.vdc_V:
        found.append(f"{v['vdc_V']:.0f} V")
    return found


def evaluate(row: Row, bounds: Bounded, rated_Nm: float, point: Point, trace: Trace) -> dict[str, Any]:
    """The run as a line of the results."""
    after = trace.time_ms > 0.0
    name, detect_ms = _first_fault(trace, after)
    tolerance = max(TOLERANCE_NM, TOLERANCE_SHARE * rated_Nm) if math.isnan(row.torque_Nm) else row.torque_Nm
    beyond = _beyond(trace, row, tolerance, rated_Nm)
    hits = np.flatnonzero(beyond > 0.0)
    current = np.hypot(trace["truth.i_d_A"], trace["truth.i_q_A"])[after]
    measured: dict[str, Any] = {
        "first_fault": name,
        "detect_ms": detect_ms,
        "harm_ms": float(trace.time_ms[hits[-1]]) if hits.size else 0.0,
        "beyond_Nm": float(beyond.max()),
        "against_cm": _against_cm(trace, detect_ms),
        "current_A": float(current.max()),
        "vdc_V": float(trace["truth.vdc_V"][after].max()),
        "state": trace.ecu[-1][2],
    }
    why = _complaints(row, bounds, measured, _departs(trace, row, measured, tolerance, beyond))
    if not np.isfinite(trace.rows).all():
        why.append("the simulation lost its numbers")
    verdict = Verdict(**measured, met=not why, why="; ".join(why))
    return {
        "row": row.id, "motor": point.motor, "point": point.index, "sign": point.sign, "speed_rpm": point.speed_rpm,
        "torque_Nm": point.torque_Nm, **asdict(verdict),
    }  # fmt: skip
