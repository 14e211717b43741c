# SPDX-License-Identifier: Apache-2.0
"""A long drive: no cyclic frame is missing, no counter changes, and the torque stays accurate to the end."""

import can
import numpy as np
import pytest
from health import JITTER_S
from report import Figures
from rig import Rig

TRUTH = "truth.torque_shaft_mean_Nm"
ROUND_S = 20.0
ROUNDS_FOR_RMS = 40  # every pair of torque and speed once; fewer are not enough for a mean
WAVE_ROUNDS = 60  # winding and magnet warm up and cool down in 20 minutes
TORQUES_NM = (40.0, 90.0, -60.0, 0.0, 20.0, -100.0, 70.0, -20.0)
SPEEDS_RPM = (1500.0, 3000.0, 800.0, -2000.0, 2500.0)


class Metronome:
    """Counts the periods of each cyclic message, and the periods that differ from its cycle."""

    def __init__(self, rig: Rig) -> None:
        self._cycle_s = {m.frame_id: rig.cycle_s(m.name) for m in rig.by_name.values() if "INV" in m.senders}
        self._last_s: dict[int, float] = {}
        self.begun_s = rig.now_s
        self.periods = dict.fromkeys(self._cycle_s, 0)
        self.wrong = dict.fromkeys(self._cycle_s, 0)

    def __call__(self, message: can.Message) -> None:
        frame_id, now_s = message.arbitration_id, message.timestamp
        if frame_id not in self._cycle_s:
            return
        if frame_id in self._last_s:
            self.periods[frame_id] += 1
            self.wrong[frame_id] += abs(now_s - self._last_s[frame_id] - self._cycle_s[frame_id]) > JITTER_S
        self._last_s[frame_id] = now_s


@pytest.mark.plant
def test_in_a_long_drive_no_cyclic_frame_is_missing_and_torque_stays_true(
    rig: Rig, figures: Figures, request: pytest.FixtureRequest
) -> None:
    """30 simulated minutes with changing torque, speed, temperature and magnet."""
    minutes = request.config.getoption("--soak-minutes")
    rounds = max(1, round(60.0 * minutes / ROUND_S))
    log = list(rig.listeners)
    metronome = Metronome(rig)
    rig.listeners[:] = [metronome]  # a million frames: counted here, not logged
    rig.stand.set(current_noise_A_rms=0.5, winding_C=70.0, magnet_scale=0.93)
    rig.start()
    rig.keep_frames = False
    rig.warm_up(60.0)
    begun_s = rig.now_s
    rows = []
    for number in range(rounds):
        wave = np.sin(2.0 * np.pi * number / WAVE_ROUNDS)
        rig.stand.ramp("plant.speed_rad_s", SPEEDS_RPM[number % len(SPEEDS_RPM)] * 2.0 * np.pi / 60.0, 2.0)
        rig.stand.ramp("plant.winding_C", 70.0 + 50.0 * wave, ROUND_S)
        rig.stand.ramp("plant.magnet_scale", 0.93 - 0.07 * wave, ROUND_S)
        torque_Nm = TORQUES_NM[number % len(TORQUES_NM)]
        rig.ask(torque_Nm=torque_Nm)
        rig.advance(ROUND_S - 0.5)
        trace = rig.record([TRUTH])
        rig.advance(0.5)
        rig.record([])
        rows.append([rig.now_s - begun_s, torque_Nm, float(trace[TRUTH].mean())])
        assert rig.state == "run", f"after {rig.now_s - begun_s:.0f} s: {rig.state}"
    rig.listeners[:] = log
    _check_frames(rig, metronome, figures)
    _check_torque(rows, figures)


def _check_frames(rig: Rig, metronome: Metronome, figures: Figures) -> None:
    names = {message.frame_id: name for name, message in rig.by_name.items()}
    rows = [[names[frame_id], count, metronome.wrong[frame_id]] for frame_id, count in metronome.periods.items()]
    figures.table("Periods of the cyclic messages", ["message", "periods", "not the cycle"], rows)
    drive_s = rig.now_s - metronome.begun_s
    for name, count, _ in rows:  # a message that stops would have no wrong period
        assert count >= drive_s / rig.cycle_s(name) - 2.0, name
    figures.promise("periods with a frame missing, early or late", sum(row[2] for row in rows), 0.0, "periods")


def _check_torque(rows: list[list[float]], figures: Figures) -> None:
    """The bounds of the campaign, for a machine that warms up and cools down during the drive."""
    errors = [100.0 * (row[2] - row[1]) / max(abs(row[1]), 13.2) for row in rows]
    line = ("shaft less asked", [row[0] for row in rows], errors)
    figures.plot("Torque at the end of each round", [("error, %", [line])])
    if len(errors) >= ROUNDS_FOR_RMS:
        figures.promise("root mean square of the torque errors", float(np.sqrt(np.mean(np.square(errors)))), 0.8, "%")
    figures.promise("99th percentile of the torque errors", float(np.percentile(np.abs(errors), 99)), 2.5, "%")
