# SPDX-License-Identifier: Apache-2.0
"""The times of docs/howto/can.md on the bus, each within one step of the task, at the PWM frequency of the target.

CMakeLists.txt runs this file on virtual ECUs at six frequencies, tests/target/s32k144/test_frequencies.py on images.
The plant is recorded in every period. The time stamp of a received frame is the end of its transmission, which other
frames of the ECU and a command can delay.
"""

from collections.abc import Iterator

import can
import numpy as np
import pytest
from report import Figures
from rig import COMMAND, LIMITS, MS, Rig

from fluxtrue_tools.motor.bases import periods_per_step

pytestmark = pytest.mark.plant
WIRE_S = 135 / 500e3  # the longest frame, with all its stuff bits
TIME, LINK, TORQUE = "truth.time_s", "truth.vdc_V", "torque_commanded_Nm"
FULL_NM = 1000.0  # as much as the machine gives
SLOW_CHARGE_S = 1000.0


class Clock:
    """Periods and steps of this target."""

    def __init__(self, rig: Rig) -> None:
        told = dict(word.split("=") for word in rig.stand.ask("hello").split() if "=" in word)
        self.period_s = 1e-9 * int(told["period_ns"])
        self.step_s = self.period_s * periods_per_step(1.0 / self.period_s)
        # A recorded row has the values at the beginning of its period.
        self.within_s = self.step_s + self.period_s + 1e-6


@pytest.fixture
def clock(rig: Rig) -> Clock:
    return Clock(rig)


@pytest.fixture
def sent_s(rig: Rig) -> Iterator[dict[str, float]]:
    """Times at which the last command and the last battery limits were sent."""
    times: dict[str, float] = {}
    names = {rig.by_name[name].frame_id: name for name in (COMMAND, LIMITS)}

    def note(message: can.Message) -> None:
        if message.arbitration_id in names:
            times[names[message.arbitration_id]] = message.timestamp

    rig.listeners.append(note)
    yield times
    rig.listeners.remove(note)


def test_every_cycle_and_the_time_of_each_state_hold_within_a_step(rig: Rig, clock: Clock, figures: Figures) -> None:
    """Init: 50 ms. Precharge: 2 s until its time-out, measured by the dc voltage, which rises while precharge is on."""
    rig.power_cycle()
    rig.expected.faults = True
    rig.stand.set(precharge_s=SLOW_CHARGE_S)
    rig.ask(mode="torque")
    trace = rig.record([TIME, LINK], 1)
    rig.advance(2.2)
    assert rig.state == "fault"
    rising = np.flatnonzero(np.abs(np.diff(trace[LINK])) > 0.0)
    begin_s, end_s = trace[TIME][rising[0]], trace[TIME][rising[-1]]
    # The step in which init ends shows standby, the next one switches precharge on.
    figures.promise("init", abs(begin_s - 50 * MS - clock.step_s) / MS, clock.within_s / MS, "ms away from 50 ms")
    figures.promise("precharge", abs(end_s - begin_s - 2.0) / MS, clock.within_s / MS, "ms away from 2 s")
    assert int(rig.signal("INV_Faults", "EcuFaults")) == 1 << 1
    for name, message in rig.by_name.items():
        if "INV" in message.senders:
            _check_cycle(rig, clock, name)


def _check_cycle(rig: Rig, clock: Clock, name: str) -> None:
    times = np.array([frame.time_s for frame in rig.frames[name]])
    cycle_s = rig.cycle_s(name)
    away_s = times - times[0] - cycle_s * np.arange(len(times))
    assert len(times) >= 2.0 / cycle_s, name
    # Two other frames of the ECU and a command may be ahead of a frame when it is due.
    assert np.ptp(away_s) < clock.step_s + 3 * WIRE_S, f"{name}: {np.ptp(away_s) / MS:.2f} ms"
    # The mean is exact: if cycles were counted in steps of not exactly 1 ms, the deviations would add up.
    assert abs(away_s[-1]) < clock.step_s + 3 * WIRE_S, f"{name}: {away_s[-1] / MS:.2f} ms after {times[-1]:.1f} s"


def test_ramp_and_lost_command_hold_within_a_step(
    rig: Rig, clock: Clock, figures: Figures, sent_s: dict[str, float]
) -> None:
    """Full torque in 50 ms; it falls 30 ms after the last command and is zero 50 ms after it, in the state ready."""
    rig.expected.counters |= {"TimeOuts", "Jumps", "Repeated", "SkippedCommands"}
    rig.start()
    trace = rig.record([TIME, TORQUE], 1)
    rig.ask(torque_Nm=FULL_NM)
    rig.advance(0.2)
    full = trace[TORQUE].max()
    assert full > 100.0
    first, last = np.flatnonzero(trace[TORQUE] > 0.0)[0], np.flatnonzero(trace[TORQUE] >= full - 0.1)[0]
    took_s = trace[TIME][last] - trace[TIME][first]
    # Two steps, one period of the trace, and one period more because the task ends in the first or second of a step.
    figures.promise("build-up", abs(took_s - 50 * MS) / MS, 2 * clock.step_s / MS + 0.2, "ms away from 50 ms")

    trace.rows.clear()
    age_s = rig.now_s - sent_s[COMMAND]
    rig.is_sending = False
    rig.advance(60 * MS)
    age_s = age_s + trace[TIME] - trace[TIME][0]
    falls_s = age_s[np.flatnonzero(trace[TORQUE] < full - 0.5)[0]]
    gone_s = age_s[np.flatnonzero(trace[TORQUE] == 0.0)[0]]
    # The age of a command counts from the end of its transmission, which one frame of the ECU can delay.
    figures.promise("time-out", abs(falls_s - 30 * MS - WIRE_S) / MS, (clock.within_s + WIRE_S) / MS,
                    "ms away from 30 ms")  # fmt: skip
    figures.promise("torque is gone", gone_s / MS, 50.0, "ms after the last command")
    assert rig.state == "ready"


def test_battery_limits_are_missed_after_300_ms(
    rig: Rig, clock: Clock, figures: Figures, sent_s: dict[str, float]
) -> None:
    rig.power_limits_kW = (50.0, 50.0)
    rig.start(60.0)
    rig.advance(0.4)
    rig.power_limits_kW = None
    trace = rig.record([TIME, TORQUE], 1)
    age_s = rig.now_s - sent_s[LIMITS]
    rig.advance(0.34)
    age_s = age_s + trace[TIME] - trace[TIME][0]
    falls_s = age_s[np.flatnonzero(trace[TORQUE] < trace[TORQUE][0] - 0.5)[0]]
    figures.promise("time-out", abs(falls_s - 300 * MS - WIRE_S) / MS, (clock.within_s + WIRE_S) / MS,
                    "ms away from 300 ms")  # fmt: skip


def test_a_dc_link_that_stays_charged_is_a_fault_after_5_s(rig: Rig, clock: Clock, figures: Figures) -> None:
    """Measured by the status, which is sent every 10 ms."""
    rig.expected.faults = True
    rig.start()
    rig.stand.set(discharge_open=1.0)
    rig.ask(enable=False, mode="off")
    rig.wait_for("discharge")
    begin_s = rig.now_s
    rig.wait_for("fault", 6.0)
    cycle_s = rig.cycle_s("INV_Status")
    figures.promise("discharge", abs(rig.now_s - begin_s - 5.0) / MS, (cycle_s + clock.within_s + 2 * WIRE_S) / MS,
                    "ms away from 5 s")  # fmt: skip
