# SPDX-License-Identifier: Apache-2.0
"""What a run must have done: the simulated machine's torque, current and dc voltage, and the time of the reaction.

Torque is safe between zero and the requested torque, widened by max(10 N·m, 5 % of the largest torque). A loss of
torque is therefore safe; too much torque or torque of the wrong sign is not. Where a line bounds the movement of the
vehicle against the request, wrong torque may last until the fault. A run whose fault came in time, but whose torque or
current exceeds its limit in the safe state, is compared with the three safe states themselves; if it is as good as the
best of them, its verdict says so. A change of the memory that neither the drive's detection nor the shaft torque
notices has no effect: such a run is not counted as demanded, because it could not have failed.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from fluxtrue_tools.fault_campaign import measure, oracle
from fluxtrue_tools.fault_campaign.fmea import BOUNDED, KEEP, LESS, MET, NO_EFFECT, OPEN, PHYSICS, RAMP, Point, Row
from fluxtrue_tools.fault_campaign.measure import MEAN_MS, Outcome
from fluxtrue_tools.fault_campaign.run_point import Trace
from fluxtrue_tools.fault_campaign.spec import Bounded
from fluxtrue_tools.sim.ecu_loop import RUN

TOLERANCE_NM, TOLERANCE_SHARE = 10.0, 0.05
DERATE: Final = 5
FAULT, TORQUE, CURRENT = "fault", "torque", "current"


@dataclass(frozen=True)
class Verdict:
    """The verdict of one run; NaN: it did not happen."""

    first_fault: str
    detect_ms: float
    harm_ms: float  # end of the last time in which the torque was not safe
    beyond_Nm: float  # largest distance from the safe range with its tolerance
    after_Nm: float  # largest torque once it must be safe
    against_cm: float  # largest movement of the vehicle against the request until the fault
    current_A: float
    vdc_V: float
    state: int
    verdict: str  # met; physics: as good as the best safe state; open; no effect: neither fault nor other torque
    met: bool  # as demanded: neither open nor without effect
    why: str  # what the plain demand complains of, and the reference


def _about_fault(row: Row, v: dict[str, Any], departs: bool, effect_ms: float) -> str:
    """What is wrong with the detection; empty: nothing."""
    said = f"{v['first_fault']} after {v['detect_ms']:.1f} ms" if v["first_fault"] else "no fault"
    if row.reaction in (KEEP, RAMP):
        return f"false trip: {said}" if v["first_fault"] else ""
    is_expected = row.expected == ("any",) or bool(set(v["first_fault"].split("|")) & set(row.expected))
    if row.reaction == LESS or (row.reaction == BOUNDED and not departs):
        return said if v["first_fault"] and not is_expected else ""
    return "" if v["first_fault"] and is_expected and v["detect_ms"] <= row.detect_ms + effect_ms else said


class _Run:
    """One run while it is evaluated."""

    def __init__(self, row: Row, bounds: Bounded, rated_Nm: float, trace: Trace) -> None:
        self.row, self.trace = row, trace
        tolerance = max(TOLERANCE_NM, TOLERANCE_SHARE * rated_Nm) if math.isnan(row.torque_Nm) else row.torque_Nm
        self.limits = Outcome(tolerance, row.current_share * bounds.current_A, row.vdc_share * bounds.vdc_V)
        name, detect_ms = measure.first_fault(trace)
        distance = measure.outside(trace, row, rated_Nm)
        self.departs = measure.departs(trace, row, detect_ms, tolerance, distance)
        self.safe_ms = row.torque_ms if math.isnan(row.against_cm) else detect_ms + MEAN_MS
        whole = measure.outcome(trace, 0.0, self.safe_ms)
        hits = np.flatnonzero(distance > tolerance)
        self.v: dict[str, Any] = {
            "first_fault": name,
            "detect_ms": detect_ms,
            "harm_ms": float(trace.time_ms[hits[-1]]) if hits.size else 0.0,
            "beyond_Nm": max(0.0, float(distance.max()) - tolerance),
            "after_Nm": whole.torque_Nm,
            "against_cm": measure.against_cm(trace, detect_ms),
            "current_A": whole.current_A,
            "vdc_V": whole.vdc_V,
            "state": trace.ecu[-1][2],
        }

    def complaints(self, effect_ms: float = 0.0) -> dict[str, str]:
        """By what they are about; times count from the effect."""
        row, limits, v = self.row, self.limits, self.v
        found = {FAULT: said} if (said := _about_fault(row, v, self.departs, effect_ms)) else {}
        if v["against_cm"] > row.against_cm:
            found["movement"] = f"{v['against_cm']:.1f} cm against the request"
        if v["harm_ms"] > self.safe_ms + effect_ms:
            found[TORQUE] = f"torque {v['beyond_Nm']:.1f} N·m beyond its safe range until {v['harm_ms']:.0f} ms"
        if row.reaction == KEEP and not v["first_fault"] and v["state"] not in (RUN, DERATE):
            found["state"] = f"left state run for state {v['state']}"
        if v["current_A"] > limits.current_A:
            found[CURRENT] = f"{v['current_A']:.0f} A"
        if v["vdc_V"] > limits.vdc_V:
            found["voltage"] = f"{v['vdc_V']:.0f} V"
        if not np.isfinite(self.trace.rows).all():
            found["numbers"] = "the simulation lost its numbers"
        return found

    def is_late(self) -> bool:
        """A fault that is expected comes, but after its time."""
        return self.row.reaction not in (KEEP, RAMP) and self.v["detect_ms"] > self.row.detect_ms

    def compared(self, found: dict[str, str], reruns: oracle.Reruns) -> tuple[str, dict[str, float | str], str]:
        """Verdict, cells and words of a run with complaints, compared with what physics allows."""
        why, effect_ms, cells = "; ".join(found.values()), 0.0, dict(oracle.NO_CELLS)
        if self.is_late():
            effect_ms = oracle.effect_ms(self.trace, reruns.healthy())
            why += f"; no effect before {effect_ms:.1f} ms" if effect_ms > 0.0 else ""
            found = self.complaints(effect_ms)
        if not found:
            return PHYSICS, cells | {"effect_ms": effect_ms}, why
        if not set(found) <= {TORQUE, CURRENT} or not self.v["first_fault"]:
            return OPEN, cells, why
        entry_ms, safe_ms = min(self.v["detect_ms"], self.row.detect_ms + effect_ms), self.safe_ms + effect_ms
        best = oracle.reference(entry_ms, safe_ms, self.limits, reruns.imposed)
        run = measure.outcome(self.trace, 0.0, safe_ms)
        cells = best.cells | ({"effect_ms": effect_ms} if effect_ms > 0.0 else {})
        return (
            PHYSICS if best.allows(run) else OPEN,
            cells,
            f"{why}; safe state {run.torque_Nm:.1f} N·m, {run.current_A:.0f} A, {best.text}",
        )


def evaluate(row: Row, bounds: Bounded, rated_Nm: float, point: Point, trace: Trace,
             reruns: oracle.Reruns | None = None) -> dict[str, Any]:  # fmt: skip
    """The run as a line of the results; without `reruns` nothing is compared with what physics allows."""
    run = _Run(row, bounds, rated_Nm, trace)
    found = run.complaints()
    verdict, cells, why = OPEN if found else MET, oracle.NO_CELLS, "; ".join(found.values())
    if found and reruns is not None:
        verdict, cells, why = run.compared(found, reruns)
    elif reruns is not None and row.must_act and not run.v["first_fault"]:
        verdict = MET if oracle.acts(trace, reruns.healthy()) else NO_EFFECT
    is_met = verdict in (MET, PHYSICS)
    return {
        "row": row.id, "motor": point.motor, "point": point.index, "sign": point.sign, "speed_rpm": point.speed_rpm,
        "torque_Nm": point.torque_Nm, **asdict(Verdict(**run.v, verdict=verdict, met=is_met, why=why)),
        **cells,
    }  # fmt: skip
