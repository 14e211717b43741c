# SPDX-License-Identifier: Apache-2.0
"""The C runner through its Python interface: names, ramps, rows, delay, reproducible results."""

import math
from typing import Any

import numpy as np
import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.library import Loop, LoopError
from fluxtrue_tools.sim.motor import Motor


def loop(motor: Motor, controller: str = "firmware", **plant: float) -> Loop:
    return Loop(motor.library, motor.plant | plant, motor.flux_map, controller)


def test_every_name_of_plant_and_truth_can_be_read(hsm1: Motor) -> None:
    names = lib.plant_names(hsm1.library)
    assert len(set(names)) == len(names)
    with loop(hsm1) as sim:
        sim.run(1)
        assert [name for name in names if not math.isfinite(sim.get(name))] == []


def test_every_plant_field_holds_the_value_it_is_given_and_only_that_field(hsm1: Motor) -> None:
    names = [name for name in lib.plant_names(hsm1.library) if name.startswith("plant.")]
    with loop(hsm1) as sim:
        for name in names:
            others = {other: sim.get(other) for other in names if other != name}
            value = 1.0 - sim.get(name) if sim.get(name) in (0.0, 1.0) else 1.5 * sim.get(name)
            try:
                sim.set(name, value)
            except LoopError as error:
                assert error.code == lib.OUT_OF_RANGE
                continue
            # A field that is a whole number keeps the integer part.
            assert sim.get(name) in (value, math.floor(value)), name
            assert {other: sim.get(other) for other in others} == others, name
            sim.set(name, others.get(name, sim.get(name)))


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("plant.nothing", 1.0, lib.UNKNOWN_NAME),
        ("truth.torque_Nm", 1.0, lib.READ_ONLY),
        ("torque_estimated_Nm", 1.0, lib.READ_ONLY),
        ("plant.vdc_V", math.nan, lib.OUT_OF_RANGE),
        ("plant.vdc_V", -1.0, lib.OUT_OF_RANGE),
        ("torque_requested_Nm", 1e9, lib.OUT_OF_RANGE),
        ("x" * 200, 1.0, lib.UNKNOWN_NAME),
    ],
)
def test_a_refused_value_changes_nothing(hsm1: Motor, name: str, value: float, code: int) -> None:
    with loop(hsm1) as sim:
        before = sim.get(name)
        with pytest.raises(LoopError) as refusal:
            sim.set(name, value)
        assert refusal.value.code == code
        assert sim.get(name) == before or math.isnan(before)


def test_an_impossible_plant_is_refused_by_its_first_bad_field(hsm1: Motor) -> None:
    with pytest.raises(LoopError, match=r"plant\.substeps = 3"):
        loop(hsm1, substeps=3)


@pytest.mark.parametrize("controller", ["firmware", "twin"])
def test_the_same_seed_gives_the_same_run_to_the_last_bit(hsm1: Motor, controller: str) -> None:
    def rows(seed: float) -> Any:
        with loop(hsm1, controller, seed=seed, current_noise_A_rms=0.5, speed_rad_s=100.0) as sim:
            sim.set("enable", 1.0)
            sim.set("torque_requested_Nm", 30.0)
            sim.record(["truth.torque_mean_Nm", "id_A", "psi_f_Vs"])
            return sim.run(500)

    first = rows(3.0)
    assert np.array_equal(first, rows(3.0))
    assert not np.array_equal(first, rows(4.0))


def test_two_loops_in_one_process_do_not_affect_each_other(hsm1: Motor) -> None:
    def one(torque: float) -> Loop:
        sim = loop(hsm1, speed_rad_s=100.0)
        sim.set("enable", 1.0)
        sim.set("torque_requested_Nm", torque)
        sim.record(["truth.torque_mean_Nm"])
        return sim

    with one(20.0) as alone:
        expected = alone.run(400)
    with one(20.0) as sim, one(-50.0) as other:
        mixed = []
        for _ in range(40):
            mixed.append(sim.run(10))
            other.run(10)
    assert np.array_equal(np.concatenate(mixed), expected)


def test_rows_do_not_depend_on_how_a_run_is_divided(hsm1: Motor) -> None:
    def rows(chunks: list[int]) -> Any:
        with loop(hsm1, speed_rad_s=50.0) as sim:
            sim.set("enable", 1.0)
            sim.record(["truth.time_s", "truth.i_q_A", "iq_A"], 7)
            return np.concatenate([sim.run(n) for n in chunks])

    whole = rows([210])
    assert whole.shape == (30, 3)
    assert np.array_equal(whole, rows([1, 3, 5, 0, 101, 100]))


def test_a_row_is_the_mean_of_its_periods_and_its_time_is_the_end(hsm1: Motor) -> None:
    def rows(every: int) -> Any:
        with loop(hsm1, speed_rad_s=50.0) as sim:
            sim.set("enable", 1.0)
            sim.set("torque_requested_Nm", 40.0)
            sim.record(["truth.time_s", "truth.torque_mean_Nm", "torque_estimated_Nm"], every)
            return sim.run(200)

    fine, coarse = rows(1), rows(10)
    assert np.allclose(coarse[:, 1], fine[:, 1].reshape(-1, 10).mean(axis=1), rtol=1e-12, atol=1e-12)
    assert np.array_equal(coarse[:, [0, 2]], fine[9::10, [0, 2]])
    assert coarse[-1, 0] == pytest.approx(0.02, abs=1e-12)


def test_a_ramp_is_linear_every_period_for_the_plant_and_every_millisecond_for_the_controller(
    hsm1: Motor,
) -> None:
    with loop(hsm1) as sim:
        sim.record(["plant.vdc_V", "torque_requested_Nm"])
        rows = sim.run(100, {"plant.vdc_V": (300.0, 400.0), "torque_requested_Nm": (0.0, 10.0)})
        assert np.allclose(rows[:, 0], 300.0 + np.arange(100))
        assert np.allclose(rows[:, 1], np.repeat(np.arange(10.0), 10))
        # The ramp ends at its last value, which is kept.
        assert sim.get("plant.vdc_V") == 400.0
        assert sim.get("torque_requested_Nm") == 10.0
        assert set(sim.run(5)[:, 0]) == {400.0}


def test_a_ramp_to_a_value_that_is_not_allowed_is_refused(hsm1: Motor) -> None:
    with loop(hsm1) as sim, pytest.raises(LoopError, match="out of range"):
        sim.run(10, {"torque_requested_Nm": (0.0, 1e9)})


def test_the_duties_of_a_period_act_in_the_next_one(hsm1: Motor) -> None:
    # At standstill 10 A are requested. The first voltage that is not zero is computed in the first period that uses the
    # new reference, and it acts one period later.
    with loop(hsm1, speed_rad_s=0.0, dead_time_s=0.0, current_quantise=0.0) as sim:
        for name, value in {"enable": 1.0, "current_mode": 1.0, "iq_ref_A": 0.0, "id_ref_A": 0.0}.items():
            sim.set(name, value)
        sim.run(50)
        sim.record(["uq_V", "truth.u_q_V"])
        sim.set("iq_ref_A", 10.0)
        rows = sim.run(40)
    computed = int(np.argmax(np.abs(rows[:, 0]) > 1.0))
    acted = int(np.argmax(np.abs(rows[:, 1]) > 1.0))
    assert acted == computed + 1


def test_a_plant_that_finds_no_current_ends_the_run_with_an_error(hsm1: Motor) -> None:
    """With 1 GΩ the time constant L/R is far below a substep, and the integration is unstable."""
    refused = pytest.raises(FluxtrueError, match="no current for the plant's flux linkage")
    with loop(hsm1, imposed_speed=1.0, speed_rad_s=150.0, r_ohm_20=1e9) as sim, refused:
        sim.run_s(1.0)


def test_unknown_channels_are_named(hsm1: Motor) -> None:
    with loop(hsm1) as sim, pytest.raises(LoopError, match=r"truth\.nothing"):
        sim.record(["truth.time_s", "truth.nothing"])


def test_an_open_sensor_disables_switching(hsm1: Motor) -> None:
    with loop(hsm1, speed_rad_s=100.0) as sim:
        sim.set("enable", 1.0)
        sim.set("torque_requested_Nm", 50.0)
        sim.run(1000)
        assert sim.get("fault_word") == 0.0
        sim.set("plant.current_open_b", 1.0)
        sim.run(20)
        assert sim.get("fault_word") != 0.0
        assert sim.get("run_state") == 2.0
