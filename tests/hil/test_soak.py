# SPDX-License-Identifier: Apache-2.0
"""A long drive: no cyclic frame is missing, no counter moves, and torque stays true to the end."""

import numpy as np
import pytest

from report import Figures
from rig import Rig

TRUTH = "truth.torque_shaft_mean_Nm"
ROUND_S = 20.0
TORQUES_NM = (40.0, 90.0, -60.0, 0.0, 20.0, -100.0, 70.0, -20.0)
SPEEDS_RPM = (1500.0, 3000.0, 800.0, -2000.0, 2500.0)


@pytest.mark.plant
def test_in_a_long_drive_no_cyclic_frame_is_missing_and_torque_stays_true(
    rig: Rig, figures: Figures, request: pytest.FixtureRequest
) -> None:
    """30 simulated minutes with changing torque, speed, temperature and magnet."""
    minutes = request.config.getoption("--soak-minutes")
    rounds = max(1, round(60.0 * minutes / ROUND_S))
    log = list(rig.listeners)
    rig.listeners.clear()  # half a million frames and more: counted here, not logged
    rig.stand.set(current_noise_A_rms=0.5)
    rig.start()
    rig.keep_frames = False
    begun_s, begun = rig.now_s, dict(rig.counted)
    rows = []
    for number in range(rounds):
        wave = np.sin(2.0 * np.pi * number / 20.0)
        rig.stand.ramp("plant.speed_rad_s", SPEEDS_RPM[number % len(SPEEDS_RPM)] * 2.0 * np.pi / 60.0, 2.0)
        rig.stand.ramp("plant.winding_C", 70.0 + 50.0 * wave, 10.0)
        rig.stand.ramp("plant.magnet_scale", 0.93 - 0.07 * wave, 10.0)
        torque_Nm = TORQUES_NM[number % len(TORQUES_NM)]
        rig.ask(torque_Nm=torque_Nm)
        rig.advance(ROUND_S - 0.5)
        trace = rig.record([TRUTH])
        rig.advance(0.5)
        rig.record([])
        rows.append([rig.now_s - begun_s, torque_Nm, float(trace[TRUTH].mean())])
        assert rig.state == "run", f"after {rig.now_s - begun_s:.0f} s: {rig.state}"
    rig.listeners.extend(log)
    _check_frames(rig, begun, rig.now_s - begun_s, figures)
    _check_torque(rows, figures)


def _check_frames(rig: Rig, begun: dict[str, int], seconds: float, figures: Figures) -> None:
    rows = []
    for name, message in rig.by_name.items():
        if "INV" in message.senders:
            wanted = seconds / rig.cycle_s(name)
            rows.append([name, wanted, rig.counted[name] - begun.get(name, 0)])
    figures.table(f"Frames in {seconds:g} s", ["message", "due", "received"], rows)
    missing = max(abs(received - due) for _, due, received in rows)
    figures.promise("frames missing or too many, of any message", missing, 1.0, "frames")


def _check_torque(rows: list[list[float]], figures: Figures) -> None:
    """The first minute is for learning."""
    learnt = [row for row in rows if row[0] > 60.0] or rows[-1:]
    errors = [100.0 * (row[2] - row[1]) / max(abs(row[1]), 13.2) for row in learnt]
    figures.plot("Torque at the end of each round", [("%", [("shaft less asked", [r[0] for r in learnt], errors)])])
    figures.promise("root mean square of the torque errors", float(np.sqrt(np.mean(np.square(errors)))), 0.8, "%")
    figures.promise("largest torque error", max(errors, key=abs), 2.5, "%")
