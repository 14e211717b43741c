# SPDX-License-Identifier: Apache-2.0
"""Behaviour after the loss of commands."""

import numpy as np
import pytest
from report import Figures
from rig import MS, Rig

TRUTH = "truth.torque_shaft_mean_Nm"
NO_TORQUE_NM = 1.0


@pytest.mark.plant
@pytest.mark.parametrize(("speed_rpm", "torque_Nm"), [(2000.0, 100.0), (2000.0, -100.0), (6000.0, 40.0)])
def test_50_ms_after_the_last_command_there_is_no_torque(
    rig: Rig, figures: Figures, speed_rpm: float, torque_Nm: float
) -> None:
    rig.expected.counters |= {"TimeOuts", "Jumps", "Repeated", "SkippedCommands"}
    rig.turn(speed_rpm)
    rig.start(torque_Nm)
    rig.advance(0.8)
    rig.advance(10 * MS)
    trace = rig.record(["truth.time_s", TRUTH], 1)
    rig.is_sending = False
    # The last command was sent one cycle ago.
    rig.advance(90 * MS)
    after_s = trace["truth.time_s"] - trace["truth.time_s"][0] + 10 * MS
    figures.plot(f"{torque_Nm:g} N·m at {speed_rpm:g} rpm; the last command at 0 s",
                 [("torque, N·m", [("shaft", after_s, trace[TRUTH])])])  # fmt: skip
    left_Nm = np.abs(trace[TRUTH][after_s >= 50 * MS]).max()
    figures.promise("torque left after 50 ms", left_Nm, NO_TORQUE_NM, "N·m")
    held = trace[TRUTH][after_s <= 29 * MS]
    assert np.abs(held - torque_Nm).max() < 3.0, "torque was taken back before the 30 ms of the time-out"
    assert rig.state == "ready"


def test_two_lost_commands_in_a_row_change_nothing(rig: Rig) -> None:
    rig.expected.counters |= {"SkippedCommands"}
    rig.start(20.0)
    rig.advance(0.3)
    for _ in range(5):
        rig.is_sending = False
        rig.advance(10 * MS)  # in this cycle no command was sent
        rig.is_sending = True
        rig.skip_counters(1)
        rig.advance(40 * MS)
    assert rig.state == "run"
    assert rig.signal("INV_Status", "TorqueCommanded") == pytest.approx(20.0, abs=0.1)


def test_after_a_time_out_enable_must_be_given_anew(rig: Rig) -> None:
    rig.expected.counters |= {"TimeOuts", "Jumps", "Repeated", "SkippedCommands"}
    rig.start(20.0)
    rig.advance(0.3)
    rig.is_sending = False
    rig.advance(0.2)
    rig.is_sending = True  # still with enable and torque
    rig.advance(0.3)
    assert rig.state == "ready"
    assert rig.signal("INV_Status", "TorqueCommanded") == 0.0
    rig.ask(enable=False, torque_Nm=0.0)
    rig.advance(0.05)
    rig.ask(enable=True)
    rig.wait_for("run")


@pytest.mark.plant
def test_power_limits_that_stop_coming_take_the_torque_back(rig: Rig, figures: Figures) -> None:
    rig.turn(1000.0)
    rig.power_limits_kW = (50.0, 50.0)
    rig.start(60.0)
    rig.advance(0.8)
    trace = rig.record(["truth.time_s", TRUTH])
    rig.power_limits_kW = None
    rig.advance(0.6)
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    figures.plot("The battery's limits stop coming at 0 s", [("torque, N·m", [("shaft", time_s, trace[TRUTH])])])
    figures.promise("torque left after 0.45 s", np.abs(trace[TRUTH][time_s > 0.45]).max(), NO_TORQUE_NM, "N·m")
    assert rig.signal("INV_DcLink", "DeratingReason") == 7.0


@pytest.mark.plant
def test_power_limits_that_stop_coming_while_they_limit_let_no_more_power_through_on_the_way(
    rig: Rig, figures: Figures
) -> None:
    """100 N·m requested, 12 kW allowed, about 36 N·m; the ramp that ends the torque must let no more power through."""
    rig.turn(3000.0)
    rig.power_limits_kW = (12.0, 60.0)
    rig.start(100.0)
    rig.advance(1.5)
    trace = rig.record(["truth.time_s", TRUTH, "truth.idc_A", "truth.vdc_V"])
    rig.power_limits_kW = None
    rig.advance(0.6)
    time_s = trace["truth.time_s"] - trace["truth.time_s"][0]
    power_kW = 1e-3 * trace["truth.idc_A"] * trace["truth.vdc_V"]
    figures.plot("The battery's limits stop coming at 0 s", [
        ("torque, N·m", [("shaft", time_s, trace[TRUTH])]), ("power, kW", [("dc link", time_s, power_kW)]),
    ])  # fmt: skip
    figures.promise("largest power", power_kW.max() / 12.0, 1.1, "of what was allowed")
    figures.promise("torque left after 0.45 s", np.abs(trace[TRUTH][time_s > 0.45]).max(), NO_TORQUE_NM, "N·m")
