# SPDX-License-Identifier: Apache-2.0
"""The external watchdog and the paths that shut off the torque: their test at start, and a task that stops."""

import numpy as np
import pytest
from report import Figures
from rig import Rig

GATE_DISABLE, GATE_SUPPLY, WATCHDOG = 1 << 8, 1 << 9, 1 << 10
TORQUE = "truth.torque_shaft_mean_Nm"


@pytest.mark.plant
@pytest.mark.parametrize(
    ("cause", "fault"),
    [("board_gates_stuck", GATE_DISABLE), ("board_supply_stuck", GATE_SUPPLY), ("board_watchdog_stuck", WATCHDOG)],
)
def test_a_shut_off_path_that_does_not_work_is_found_at_start_and_no_torque_is_granted(
    rig: Rig, cause: str, fault: int
) -> None:
    rig.power_cycle()
    rig.expected.faults = True
    rig.stand.set(**{cause: 1.0})
    rig.wait_for("fault")
    rig.advance(0.11)
    assert int(rig.signal("INV_Faults", "EcuFaults")) == fault
    assert int(rig.signal("INV_Faults", "FirstFault")) == 32 + fault.bit_length()
    # The path may work again later: only a start tests it again.
    rig.stand.set(**{cause: 0.0})
    rig.ask(reset=True)
    rig.advance(0.05)
    rig.ask(reset=False, mode="torque")
    rig.advance(1.0)
    assert rig.state == "fault"


@pytest.mark.plant
@pytest.mark.parametrize(("speed_rpm", "asked_Nm"), [(0.0, 100.0), (1000.0, -60.0), (5000.0, 60.0)])
def test_a_task_that_stops_ends_the_torque_and_the_gate_supply(
    rig: Rig, figures: Figures, speed_rpm: float, asked_Nm: float
) -> None:
    rig.expected.faults = rig.expected.frames = True
    rig.turn(speed_rpm)
    rig.start(asked_Nm)
    rig.advance(0.5)
    assert rig.stand.get("truth.gate_supply")[0] == 1.0
    trace = rig.record(["truth.time_s", TORQUE, "truth.gate_supply"])
    start_s = float(rig.stand.get("truth.time_s")[0])
    rig.stand.set(board_task_stuck=1.0)
    rig.advance(0.1)
    time_ms = 1e3 * (trace["truth.time_s"] - start_s)
    at = f"{speed_rpm:g} rpm, {asked_Nm:g} N·m"
    torque_ms = float(time_ms[np.abs(trace[TORQUE]) > 5.0].max())
    supply_ms = float(time_ms[trace["truth.gate_supply"] > 0.5].max())
    figures.promise(f"time until no torque, {at}", torque_ms, 8.0, "ms")
    figures.promise(f"time until no gate supply, {at}", supply_ms, 10.0, "ms")
