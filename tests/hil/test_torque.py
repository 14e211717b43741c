# SPDX-License-Identifier: Apache-2.0
"""Torque requested over CAN against the plant's torque, and the signals of the bus."""

from typing import Any

import numpy as np
import pytest
from report import Figures
from rig import Rig, Trace

from fluxtrue_tools.demo.step import overshoot_percent, rise_ms

# As in the demonstration: noise, a resistance as at 119 °C while the sensor reports 20 °C, a magnet 15 % weaker.
WRONG: dict[str, Any] = {"r_ohm_20": 0.025, "current_noise_A_rms": 0.5, "magnet_scale": 0.85}
TRUTH = "truth.torque_shaft_mean_Nm"
WARM_UP_S = 60.0
COLD_PERCENT = 4.0
LEAST_NM = 13.2  # errors are of |torque|, or of a tenth of the machine's 132 N·m if that is more
# After a drive. The bounds of the campaign are wider, 0.8 % and 2.5 %: here sensors have no gain error.
RMS_PERCENT, WORST_PERCENT = 0.6, 1.5
# Of this the resolution of 0.1 N·m on the bus is +-0.25 % of 20 N·m, the rest the error of the estimate.
TOLD_PERCENT = 1.5


def mean_truth(rig: Rig, seconds: float = 0.3) -> float:
    trace = rig.record([TRUTH])
    rig.advance(seconds)
    return float(trace[TRUTH].mean())


def percent(error_Nm: float, torque_Nm: float) -> float:
    return 100.0 * error_Nm / max(abs(torque_Nm), LEAST_NM)


def _row(rig: Rig, torque_Nm: float) -> list[float]:
    """Requested torque, shaft torque, its error in percent, estimated torque on CAN."""
    rig.ask(torque_Nm=torque_Nm)
    rig.advance(0.5)
    since_s = rig.now_s
    truth_Nm = mean_truth(rig)
    told_Nm = float(rig.series("INV_Status", "TorqueEstimated", since_s)[1].mean())
    return [torque_Nm, truth_Nm, percent(truth_Nm - torque_Nm, torque_Nm), told_Nm]


@pytest.mark.plant
def test_after_a_drive_shaft_torque_is_the_torque_asked_for_with_everything_wrong(rig: Rig, figures: Figures) -> None:
    rig.stand.set(**WRONG)
    rig.turn(1000.0)
    rig.start()
    rig.warm_up(WARM_UP_S)
    errors, told = [], []
    for speed_rpm in (1000.0, 3000.0, 5000.0, -3000.0, -1000.0):
        rig.turn(speed_rpm, 1.0)
        # At 5000 rpm the dc voltage is not sufficient for more than 80 N·m with this machine.
        torques = [t for t in (-120.0, -80.0, -40.0, -20.0, 20.0, 40.0, 80.0, 120.0) if abs(t) * abs(speed_rpm) <= 4e5]
        rows = [_row(rig, torque_Nm) for torque_Nm in torques]
        errors += [row[2] for row in rows]
        told += [percent(row[3] - row[1], row[0]) for row in rows]
        figures.table(f"{speed_rpm:g} rpm", ["asked N·m", "shaft N·m", "error %", "told on CAN N·m"], rows)
        asked = [row[0] for row in rows]
        figures.plot(f"Torque error at {speed_rpm:g} rpm", [("error, %", [
            ("shaft less asked", asked, [row[2] for row in rows]),
            ("told less shaft", asked, told[-len(rows):]),
        ])], "torque asked for, N·m")  # fmt: skip
    figures.promise("root mean square of the errors", float(np.sqrt(np.mean(np.square(errors)))), RMS_PERCENT, "%")
    figures.promise("largest error", max(errors, key=abs), WORST_PERCENT, "%")
    figures.promise("told less shaft", max(told, key=abs), TOLD_PERCENT, "%")


@pytest.mark.plant
def test_from_a_cold_start_torque_is_close_at_the_first_requests_and_true_when_they_come_back(
    rig: Rig, figures: Figures
) -> None:
    """The same machine at the first requests; with the tables alone the error is 5 to 10 % (see the demonstration)."""
    rig.stand.set(**WRONG)
    rig.turn(2000.0)
    rig.start()
    torques = (40.0, 80.0, 120.0, -120.0, -80.0, -40.0)
    rounds = [[_row(rig, torque_Nm) for torque_Nm in torques] for _ in range(3)]
    worst = [max((row[2] for row in rows), key=abs) for rows in rounds]
    for number, rows in enumerate(rounds, 1):
        figures.table(f"Round {number}", ["asked N·m", "shaft N·m", "error %", "told on CAN N·m"], rows)
    figures.plot("Torque error from a cold start, 0.8 s at each point", [("error, %", [
        (f"round {number}", range(1, len(rows) + 1), [row[2] for row in rows])
        for number, rows in enumerate(rounds, 1)
    ])], "point")  # fmt: skip
    figures.promise("largest error in the first round", worst[0], COLD_PERCENT, "%")
    figures.promise("largest error in the third round", worst[2], WORST_PERCENT, "%")


@pytest.mark.plant
def test_zero_torque_gives_no_torque_at_any_speed(rig: Rig, figures: Figures) -> None:
    rows = []
    rig.start()
    for speed_rpm in (0.0, 500.0, 2000.0, 4000.0, 6000.0, 8000.0):
        rig.turn(speed_rpm)
        rig.advance(0.4)
        rows.append([speed_rpm, mean_truth(rig, 0.1)])
    figures.table("Request 0", ["rpm", "shaft N·m"], rows)
    shaft = [("shaft", [r[0] for r in rows], [r[1] for r in rows])]
    figures.plot("Torque with a request of zero", [("torque, N·m", shaft)], "speed, rpm")
    worst = max(rows, key=lambda row: abs(row[1]))
    figures.promise(f"shaft torque at {worst[0]:g} rpm", worst[1], 2.0, "N·m")


@pytest.mark.plant
def test_a_weaker_magnet_costs_no_torque_as_in_figure_8_of_the_paper(rig: Rig, figures: Figures) -> None:
    """40 N·m; the magnet loses 8.75 % of its flux in one step, faster than a real magnet; the identification finds it.

    In the paper a loss of 8.75 % is reduced to 1.25 %. The same is required here, at one operating point.
    """
    rig.turn(1000.0)
    rig.start()
    rig.warm_up(20.0)
    rig.turn(1500.0)
    rig.ask(torque_Nm=40.0)
    rig.advance(1.0)
    start_s = rig.now_s
    trace = rig.record(["truth.time_s", TRUTH, "truth.psi_f_Vs"])
    rig.advance(1.0)
    weak_at = len(trace.rows)
    rig.stand.set(magnet_scale=0.9125)
    rig.advance(9.0)
    torque_Nm, psi_mVs = trace[TRUTH], 1e3 * trace["truth.psi_f_Vs"]
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    told_s, told_Nm = rig.series("INV_Status", "TorqueEstimated", start_s)
    psi_s, told_mVs = rig.series("INV_Identification", "PsiF", start_s)
    figures.plot("The magnet weakens at 1 s", [
        ("torque, N·m", [("shaft", time_s, torque_Nm), ("told on CAN", told_s - start_s, told_Nm)]),
        ("flux, mV·s", [("magnet", time_s, psi_mVs), ("told on CAN", psi_s - start_s, told_mVs)]),
    ])  # fmt: skip
    figures.promise("deepest loss", 100.0 * (torque_Nm[weak_at:].min() / 40.0 - 1.0), 8.75, "%")
    figures.promise("torque 9 s later", 100.0 * (torque_Nm[-300:].mean() / 40.0 - 1.0), 1.25, "%")
    rig.record([])
    rig.warm_up(20.0)
    rig.turn(1500.0)
    rig.ask(torque_Nm=40.0)
    rig.advance(1.0)
    figures.promise("torque after a drive of 20 s", 100.0 * (mean_truth(rig) / 40.0 - 1.0), 0.5, "%")


def _step(rig: Rig, figures: Figures, first_Nm: float, second_Nm: float) -> tuple[Trace, int]:
    rig.turn(2000.0)
    rig.start(first_Nm)
    rig.advance(0.8)
    trace = rig.record(["truth.time_s", TRUTH], 1)
    start_s = rig.now_s
    rig.advance(0.05)
    at = len(trace.rows)
    rig.ask(torque_Nm=second_Nm)
    rig.advance(0.4)
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    told_s, told_Nm = rig.series("INV_Status", "TorqueEstimated", start_s)
    asked_s, asked_Nm = rig.series("INV_Status", "TorqueCommanded", start_s)
    figures.plot(f"From {first_Nm:g} to {second_Nm:g} N·m", [("torque, N·m", [
        ("shaft", time_s, trace[TRUTH]), ("told on CAN", told_s - start_s, told_Nm),
        ("asked of the control", asked_s - start_s, asked_Nm),
    ])])  # fmt: skip
    return trace, at


@pytest.mark.plant
def test_a_torque_step_over_can_follows_the_ramp_and_overshoots_little(rig: Rig, figures: Figures) -> None:
    trace, at = _step(rig, figures, 0.0, 100.0)
    after = np.arange(len(trace.rows)) >= at
    # The slew rate of the machine's torque in 40 ms takes 30 ms for 100 N·m; the jerk limit adds 10 ms at each end.
    figures.promise("rise 10 - 90 %", rise_ms(1e-4 * np.arange(after.sum()), trace[TRUTH][after], 100.0), 45.0, "ms")
    figures.promise("overshoot", overshoot_percent(trace[TRUTH][after], 100.0), 5.0, "%")


@pytest.mark.plant
def test_a_reversal_of_torque_passes_zero_without_overshoot(rig: Rig, figures: Figures) -> None:
    trace, at = _step(rig, figures, 80.0, -80.0)
    after = trace[TRUTH][at:]
    figures.promise("overshoot", overshoot_percent(-after, 80.0), 5.0, "%")
    figures.promise("torque at the end", after[-500:].mean() + 80.0, 0.4, "N·m")
