# SPDX-License-Identifier: Apache-2.0
"""The C interface of hal/host/fluxtrue.h with valid and invalid calls."""

import ctypes
import math
import random
from collections.abc import Callable

import pytest
from sil import OK, OUT_OF_RANGE, READ_ONLY, UNKNOWN_NAME, Drive, names

from fluxtrue_tools.sim.members import members

IDLE = (0.0, 0.0, 0.0, 350.0, 0.0, 20.0)
SETTABLE = ("torque_requested_Nm", "enable", "torque_loop", "identification")
READABLE = (
    *SETTABLE, "torque_estimated_Nm", "psi_f_Vs", "r_ohm", "id_A", "iq_A", "id_ref_A", "iq_ref_A",
    "ud_V", "uq_V", "speed_rpm", "psi_quality", "r_quality", "fault_word",
)  # fmt: skip
INPUTS = ("ia_A", "ib_A", "ic_A", "vdc_V", "theta_m_rad", "t_winding_C")


def running(drive: Drive) -> Drive:
    """Switching enabled, at standstill, no torque requested."""
    assert drive.set("enable", 1.0) == OK
    for _ in range(50):
        out = drive.step(IDLE)
    assert out[3] == 1.0
    assert drive.get("fault_word") == 0.0
    return drive


def test_the_names_come_once_each_and_end_with_null(library: ctypes.CDLL) -> None:
    found = names(library)
    assert len(set(found)) == len(found)
    assert set(READABLE) <= set(found)
    for outside in (-1, -(2**31), len(found), len(found) + 1, 2**31 - 1):
        assert library.fluxtrue_name(outside) is None


def test_every_enumerated_name_can_be_read(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    drive = make()
    assert [name for name in names(library) if not math.isfinite(drive.get(name))] == []


OLD_NAMES = {
    "torque_command_Nm": "torque_requested_Nm",
    "torque_request_Nm": "torque_corrected_Nm",
    "torque_estimate_Nm": "torque_estimated_Nm",
}


@pytest.mark.parametrize(("old", "present"), OLD_NAMES.items())
def test_a_name_of_version_0_1_still_works_and_is_not_listed(
    library: ctypes.CDLL, make: Callable[[], Drive], old: str, present: str
) -> None:
    drive = running(make())
    assert drive.set("torque_requested_Nm", 8.0) == OK
    for _ in range(80):  # 8 ms, less than the confirmation of a lost phase
        drive.step((0.0, 2.0, -2.0, 350.0, 0.0, 20.0))  # a current in the q axis, so that the torque is not zero
    assert drive.get(old) == drive.get(present) != 0.0
    assert drive.set(old, 5.0) == drive.set(present, 5.0)
    assert drive.get(old) == drive.get(present)
    assert old not in names(library) and present in names(library)


def test_the_former_name_of_the_mismatch_share_still_reads_it_and_is_not_listed(
    library: ctypes.CDLL, make: Callable[[], Drive]
) -> None:
    drive = make()
    assert drive.get("contradiction") == drive.get("mismatch_share") == 0.0
    assert drive.set("contradiction", 0.0) == drive.set("mismatch_share", 0.0) == READ_ONLY
    assert "contradiction" not in names(library) and "mismatch_share" in names(library)


def test_the_torque_passes_its_stations_in_order(make: Callable[[], Drive]) -> None:
    drive = running(make())
    assert drive.set("torque_slew_Nm_per_s", 1000.0) == OK
    assert drive.set("torque_limit_drive_Nm", 30.0) == OK
    assert drive.set("torque_requested_Nm", 50.0) == OK
    for _ in range(20):
        drive.step(IDLE)
    assert drive.get("torque_requested_Nm") == 50.0
    assert drive.get("torque_arbitrated_Nm") == pytest.approx(50.0, abs=0.01)
    assert drive.get("torque_limited_Nm") == pytest.approx(30.0, abs=0.01)
    assert 0.9 < drive.get("torque_commanded_Nm") < 2.1  # two steps of 1 N·m
    assert drive.get("torque_corrected_Nm") >= drive.get("torque_commanded_Nm")
    assert drive.set("enable", 0.0) == OK
    for _ in range(20):
        drive.step(IDLE)
    later = [drive.get(f"torque_{station}_Nm") for station in ("limited", "commanded", "corrected")]
    assert later == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", ["", "torque", "torque_command_nm", "enable ", "x" * 10000])
def test_an_unknown_name_is_refused_and_reads_as_nan(make: Callable[[], Drive], name: str) -> None:
    drive = make()
    assert drive.set(name, 1.0) == UNKNOWN_NAME
    assert math.isnan(drive.get(name))


@pytest.mark.parametrize("name", [name for name in READABLE if name not in (*SETTABLE, "id_ref_A", "iq_ref_A")])
def test_a_result_cannot_be_set(make: Callable[[], Drive], name: str) -> None:
    drive = make()
    before = drive.get(name)
    assert drive.set(name, 1.0) == READ_ONLY
    assert drive.get(name) == before


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30, -1e30])
def test_a_value_that_is_not_finite_or_far_out_of_range_is_refused_and_changes_nothing(
    library: ctypes.CDLL, make: Callable[[], Drive], value: float
) -> None:
    drive = make()
    assert drive.set("torque_requested_Nm", 17.0) == OK
    for name in names(library):
        before = drive.get(name)
        assert drive.set(name, value) in (OUT_OF_RANGE, READ_ONLY), name
        assert drive.get(name) == before, name


def test_a_value_that_was_set_is_read_back(make: Callable[[], Drive]) -> None:
    drive = make()
    for name, value in [("torque_requested_Nm", -33.25), ("torque_loop", 1.0), ("torque_loop", 0.0),
                        ("identification", 1.0), ("identification", 0.0), ("enable", 1.0)]:  # fmt: skip
        assert drive.set(name, value) == OK
        assert drive.get(name) == value


def test_a_new_drive_does_not_switch_until_it_is_enabled(make: Callable[[], Drive]) -> None:
    drive = make()
    assert {drive.step(IDLE)[3] for _ in range(100)} == {0.0}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
@pytest.mark.parametrize("place", range(6), ids=INPUTS)
def test_a_sample_that_is_nan_disables_switching_at_once_and_sets_a_fault_bit(
    make: Callable[[], Drive], place: int, bad: float
) -> None:
    drive = running(make())
    sample = list(IDLE)
    sample[place] = bad
    out = drive.step(sample)
    assert out[3] == 0.0
    assert all(0.0 <= duty <= 1.0 for duty in out[:3])
    assert drive.get("fault_word") != 0.0
    # The fault is latched although the samples are good again.
    assert {drive.step(IDLE)[3] for _ in range(50)} == {0.0}


def test_a_negative_dc_voltage_is_a_fault(make: Callable[[], Drive]) -> None:
    drive = running(make())
    sample = list(IDLE)
    sample[INPUTS.index("vdc_V")] = -50.0
    assert drive.step(sample)[3] == 0.0
    assert drive.get("fault_word") != 0.0


def test_after_a_bad_sample_the_drive_works_again_when_the_fault_is_reset(
    library: ctypes.CDLL, make: Callable[[], Drive]
) -> None:
    drive = running(make())
    drive.step((math.nan,) * 6)
    assert drive.set("enable", 0.0) == OK
    assert drive.set("fault_reset", 1.0) == OK
    for _ in range(30):
        drive.step(IDLE)
    assert drive.get("fault_word") == 0.0
    running(drive)
    assert [name for name in names(library) if not math.isfinite(drive.get(name))] == []


def test_a_fault_cannot_be_reset_while_the_drive_is_enabled(make: Callable[[], Drive]) -> None:
    drive = running(make())
    drive.step((math.nan,) * 6)
    assert drive.set("fault_reset", 1.0) == OK
    assert {drive.step(IDLE)[3] for _ in range(50)} == {0.0}
    assert drive.get("fault_word") != 0.0


def test_for_any_input_the_outputs_are_duties(make: Callable[[], Drive]) -> None:
    # Numbers of every size, special values such as NaN, and plausible values between them.
    rng = random.Random(20)
    drive = make()
    special = [math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1e308, -1e308, 1e5, -1e5]
    for _ in range(3000):
        if rng.random() < 0.05:
            drive.set("enable", 0.0)
            drive.set("fault_reset", 1.0)
        if rng.random() < 0.2:
            drive.set("enable", 1.0)
            drive.set("torque_requested_Nm", rng.uniform(-130.0, 130.0))
        sample = [rng.choice(special) if rng.random() < 0.02 else rng.uniform(-300.0, 400.0) for _ in range(6)]
        out = drive.step(sample)
        assert all(0.0 <= duty <= 1.0 for duty in out[:3])
        assert out[3] in (0.0, 1.0)


def spin(drive: Drive, seed: int, periods: int) -> list[tuple[float, float, float, float]]:
    """Step with random samples, which are the same for the same seed."""
    rng = random.Random(seed)
    drive.set("enable", 1.0)
    drive.set("torque_requested_Nm", 10.0 * seed)
    outs = []
    for k in range(periods):
        a, b = rng.uniform(-20.0, 20.0), rng.uniform(-20.0, 20.0)
        outs.append(drive.step((a, b, -a - b, 350.0, 0.01 * seed * k, 20.0)))
    return outs


def test_two_drives_in_one_process_do_not_affect_each_other(make: Callable[[], Drive]) -> None:
    alone = {seed: spin(make(), seed, 400) for seed in (1, 2)}
    first, second = make(), make()
    ran = {1: random.Random(1), 2: random.Random(2)}
    mixed: dict[int, list[tuple[float, float, float, float]]] = {1: [], 2: []}
    for seed, drive in ((1, first), (2, second)):
        drive.set("enable", 1.0)
        drive.set("torque_requested_Nm", 10.0 * seed)
    for k in range(400):
        for seed, drive in ((1, first), (2, second)):
            a, b = (ran[seed].uniform(-20.0, 20.0) for _ in range(2))
            mixed[seed].append(drive.step((a, b, -a - b, 350.0, 0.01 * seed * k, 20.0)))
    assert mixed == alone
    assert alone[1] != alone[2]


def test_a_calibration_of_one_drive_does_not_change_another(make: Callable[[], Drive]) -> None:
    first, second = make(), make()
    before = second.get("flux_bandwidth_rad_s")
    assert first.set("flux_bandwidth_rad_s", 2.0 * before) == OK
    assert first.get("flux_bandwidth_rad_s") == pytest.approx(2.0 * before, rel=1e-3)
    assert second.get("flux_bandwidth_rad_s") == before


def test_a_hundred_drives_can_be_created_and_destroyed_repeatedly(library: ctypes.CDLL) -> None:
    for _ in range(3):
        drives = [Drive(library) for _ in range(100)]
        assert {drive.step(IDLE)[3] for drive in drives} == {0.0}
        for drive in drives:
            drive.close()


def test_the_monitors_of_the_machine_are_all_enabled_again(make: Callable[[], Drive]) -> None:
    drive, new = make(), make()
    assert drive.set("machine_monitors", 0.0) == OK
    assert drive.set("machine_monitors", 1.0) == OK
    layout = members(drive.library._name)
    for name in ("plausibility.e_0", "plausibility.i_alive", "plausibility.ripple_max", "torque_monitor.v_0",
                 "plausibility.gate_exceeded_steps", "gate_fault.i_alive", "frozen_angle.v_0"):  # fmt: skip
        assert layout.read(drive.handle, f"motor.{name}") == layout.read(new.handle, f"motor.{name}"), name
