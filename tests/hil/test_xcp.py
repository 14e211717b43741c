# SPDX-License-Identifier: Apache-2.0
"""Calibration sessions on the running drive."""

import numpy as np
import pytest
from report import Figures
from rig import Rig
from xcp_master import DENIED, LOCKED, OUT_OF_RANGE, Master, XcpError

from fluxtrue_tools.a2l.elf import Description

TRUTH = "truth.torque_shaft_mean_Nm"


def settled(rig: Rig) -> float:
    """Shaft torque at 40 N·m."""
    rig.turn(1500.0)
    rig.ask(torque_Nm=40.0)
    rig.advance(1.0)
    trace = rig.record([TRUTH])
    rig.advance(0.2)
    rig.record([])
    return float(trace[TRUTH].mean())


@pytest.mark.plant
def test_a_measurement_read_over_xcp_is_what_the_plant_does(rig: Rig, description: Description) -> None:
    rig.turn(2000.0)
    rig.start(50.0)
    rig.advance(1.0)
    master = Master(rig, description)
    assert master.measurement("speed_rpm") == pytest.approx(2000.0, abs=2.0)
    # The estimate is compared with the shaft, not with the request that it is controlled to.
    assert master.measurement("torque_estimated_Nm") == pytest.approx(rig.stand.get(TRUTH)[0], abs=0.5)
    assert master.measurement("v_dc_V") == pytest.approx(350.0, abs=1.0)
    assert master.measurement("fault_word") == 0.0


@pytest.mark.plant
def test_a_measurement_list_loses_no_millisecond_of_a_torque_step(
    rig: Rig, figures: Figures, description: Description
) -> None:
    rig.turn(2000.0)
    rig.start(0.0)
    rig.advance(0.3)
    master = Master(rig, description)
    rig.ask(torque_Nm=60.0)
    trace = rig.record(["truth.time_s", TRUTH])
    begun = len(trace.rows)
    sampled = master.sample(["torque_estimated_Nm", "i_q_A"], 0, 0.3)
    periods = np.diff(sampled.time_ms) % 65536
    assert len(periods) >= 299 and set(periods) == {1.0}
    told = sampled.columns["torque_estimated_Nm"]
    truth = trace[TRUTH][begun:]
    figures.plot("Recorded over XCP in the 1 ms raster", [("torque, N·m", [
        ("told over XCP", 1e-3 * (sampled.time_ms - sampled.time_ms[0]), told),
        ("shaft", trace["truth.time_s"] - trace["truth.time_s"][0], truth),
    ])])  # fmt: skip
    figures.promise("told less shaft at the end", told[-50:].mean() - truth[-50:].mean(), 0.5, "N·m")


@pytest.mark.plant
def test_measuring_changes_no_duty(rig: Rig, description: Description) -> None:
    def drive(measure: bool) -> str:
        rig.power_cycle(seed=3)
        rig.turn(2000.0)
        rig.start(40.0)
        # The set-up of the session takes some 30 ms; the drive without it waits as long.
        begun_s = rig.now_s
        if measure:
            Master(rig, description).sample(["i_d_A", "i_q_A", "u_d_V", "u_q_V", "psi_f_Vs"], 1, 0.5)
        rig.advance(1.0 - (rig.now_s - begun_s))
        return rig.stand.duty_hash()

    quiet = drive(False)
    assert drive(True) == quiet


def test_without_the_key_nothing_can_be_written(rig: Rig, description: Description) -> None:
    master = Master(rig, description)
    before = master.checksum()
    with pytest.raises(XcpError) as error:
        master.write("flux_bandwidth_rad_s", 10.0)
    assert error.value.code == LOCKED
    assert master.checksum() == before


def test_a_value_out_of_its_range_is_refused_whole(rig: Rig, description: Description) -> None:
    master = Master(rig, description)
    master.unlock()
    before = master.checksum()
    for name, value in master.values.items():
        was = master.calibration(name)
        for bad in (value.hi * 1.01 + 1.0, value.lo - 1.0, float("nan"), float("inf")):
            with pytest.raises(XcpError) as error:
                master.write(name, bad)
            assert error.value.code == OUT_OF_RANGE
        assert master.calibration(name) == was
    assert master.checksum() == before


def test_memory_that_is_not_described_cannot_be_read(rig: Rig, description: Description) -> None:
    master = Master(rig, description)
    # Beyond everything that is described, the scope's memory included.
    end = max(value.address for value in (*description.measurements, *description.scope)) + 65536
    for address in (0, 4, 0xFFFFFFFC, end):
        with pytest.raises(XcpError) as error:
            master.command(0xF4, 4, 0, 0, *address.to_bytes(4, "little"))
        assert error.value.code == DENIED


@pytest.mark.plant
def test_a_value_that_is_written_acts_and_the_built_in_one_comes_back(
    rig: Rig, figures: Figures, description: Description
) -> None:
    """With the bandwidth of the torque loop at zero a weaker magnet costs torque; with the built-in one it does not."""
    rig.turn(1000.0)
    rig.start(0.0)
    rig.advance(0.3)
    master = Master(rig, description)
    master.unlock()
    built_in = master.checksum()
    master.write("torque_loop_bandwidth_rad_s", 0.0)
    assert master.checksum() != built_in
    rig.stand.set(magnet_scale=0.9)
    rig.warm_up(30.0)
    open_Nm = settled(rig)
    master.set_page(0)
    assert master.calibration("torque_loop_bandwidth_rad_s") > 0.0
    closed_Nm = settled(rig)
    figures.table("40 N·m, magnet at 90 %", ["torque loop", "shaft N·m"], [["off", open_Nm], ["built in", closed_Nm]])
    assert open_Nm < 39.0
    figures.promise("error with the built-in value", closed_Nm - 40.0, 0.4, "N·m")
