# SPDX-License-Identifier: Apache-2.0
"""A drive that continues from a saved state does so bit by bit, in the same and in another process."""

import copy
import ctypes
import hashlib
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from plant import Plant
from sil import NO_STATE, OK, OUT_OF_RANGE, Drive, library_path, load, names

from fluxtrue_tools.sim.members import pointers

# Before the save: periods (no multiple of a step) and values; after it: values set at once.
CASES = {
    "robust": (1500.0, 4003, {"torque_requested_Nm": 60.0}, {"torque_requested_Nm": -35.0}),
    "paper": (2500.0, 3007, {"torque_requested_Nm": 40.0, "identification_mode": 0.0}, {}),
    "calibrated": (800.0, 2001, {"torque_requested_Nm": 25.0, "torque_loop_bandwidth_rad_s": 80.0,
                                 "torque_limit_drive_Nm": 20.0, "machine_monitors": 0.0}, {"machine_monitors": 1.0}),
    "current mode": (600.0, 2005, {"current_mode": 1.0, "id_ref_A": -40.0, "iq_ref_A": 55.0}, {"iq_ref_A": -20.0}),
    "commissioning": (0.0, 1503, {"commission": 1.0}, {}),
    "switched off": (1200.0, 3001, {"torque_requested_Nm": 30.0}, {"enable": 0.0}),
    "fault": (1200.0, 2009, {"torque_requested_Nm": 30.0, "fault": 1.0}, {"enable": 0.0, "fault_reset": 1.0}),
}  # fmt: skip
AFTER = 1500


@pytest.fixture(scope="module")
def library() -> ctypes.CDLL:
    return load("paper")


def closed_loop(drive: Drive, plant: Plant, periods: int) -> np.ndarray:
    """The samples of so many periods."""
    samples = np.empty((periods, 6))
    for k in range(periods):
        samples[k] = plant.sample()
        out = drive.step(tuple(samples[k]))
        plant.advance(out)
    return samples


def prepared(drive: Drive, case: str) -> Plant:
    """A drive in operation."""
    speed_rpm, periods, values, _ = CASES[case]
    plant = Plant(speed_rpm)
    for name, value in {"dead_time_compensation": 0.0, "enable": 1.0, **values}.items():
        if name != "fault":
            assert drive.set(name, value) == OK, name
    closed_loop(drive, plant, periods)
    if "fault" in values:
        drive.step((float("nan"),) * 6)
        assert drive.get("fault_word") != 0.0
    else:
        assert drive.get("fault_word") == 0.0
    return plant


def change(drive: Drive, case: str) -> None:
    for name, value in CASES[case][3].items():
        assert drive.set(name, value) == OK, name


@pytest.mark.parametrize("case", CASES)
def test_a_restored_drive_continues_bit_by_bit(
    library: ctypes.CDLL, make: Callable[[], Drive], tmp_path: Path, case: str
) -> None:
    drive, gets = make(), names(library)
    plant = prepared(drive, case)
    state, rest = drive.save(), copy.deepcopy(plant)
    change(drive, case)
    samples = closed_loop(drive, plant, AFTER)
    assert len(np.unique(samples[:, 4])) > 2 or case == "commissioning"
    results = []
    for continued in (drive, make()):
        assert continued.restore(state) == OK
        assert continued.save() == state
        change(continued, case)
        code, out, values = continued.run(samples, None, gets)
        assert code == OK
        results.append((out, values, continued.memory()))
    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(np.frombuffer(bytes(one)), np.frombuffer(bytes(other)))
    again = make()
    assert again.restore(state) == OK
    change(again, case)
    np.testing.assert_array_equal(closed_loop(again, rest, AFTER), samples)
    assert digest(*results[0]) == digest_elsewhere(tmp_path, state, samples, case)
    assert_it_matters(make(), case, samples, results[0])


def assert_it_matters(new: Drive, case: str, samples: np.ndarray, result: tuple[np.ndarray, np.ndarray, bytes]) -> None:
    """A new drive with the same settings answers otherwise: the comparison above can fail."""
    for name, value in {"dead_time_compensation": 0.0, "enable": 1.0, **CASES[case][2], **CASES[case][3]}.items():
        assert name == "fault" or new.set(name, value) == OK
    assert not np.array_equal(new.run(samples, None, names(new.library))[2], result[1])


def digest(out: np.ndarray, values: np.ndarray, flash: bytes) -> str:
    return hashlib.sha256(out.tobytes() + values.tobytes() + flash).hexdigest()


ELSEWHERE = """
import sys
from pathlib import Path
import numpy as np
from sil import Drive, load, names
from test_state import change, digest
folder, case = Path(sys.argv[1]), sys.argv[2]
drive = Drive(load("paper"))
assert drive.restore((folder / "state").read_bytes()) == 0
change(drive, case)
code, out, values = drive.run(np.load(folder / "samples.npy"), None, names(drive.library))
print(digest(out, values, drive.memory()))
"""


def digest_elsewhere(folder: Path, state: bytes, samples: np.ndarray, case: str) -> str:
    """The same continuation in another process."""
    (folder / "state").write_bytes(state)
    np.save(folder / "samples.npy", samples)
    done = subprocess.run([sys.executable, "-c", ELSEWHERE, str(folder), case], capture_output=True, text=True,
                          check=False, cwd=Path(__file__).parent)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_the_flash_of_a_restored_drive_is_written_as_that_of_the_saved_one(make: Callable[[], Drive]) -> None:
    drive = make()
    plant = prepared(drive, "robust")
    assert drive.set("enable", 0.0) == OK
    plant.reference = 0.0
    closed_loop(drive, plant, 3003)
    # The record is saved 100 ms after switching has been disabled and the rotor stands.
    state, later = drive.save(), make()
    samples = closed_loop(drive, plant, 10000)
    assert drive.get("memory_saves") == 1.0
    assert later.restore(state) == OK
    assert later.get("memory_saves") == 0.0
    assert later.run(samples)[0] == OK
    assert later.get("memory_saves") == 1.0
    assert later.memory() == drive.memory() != b"\xff" * 4096


@pytest.mark.parametrize("at", [0, 17, 21, 25, 32, 400, 2000, -1])
def test_a_state_that_has_been_damaged_is_refused_and_changes_nothing(make: Callable[[], Drive], at: int) -> None:
    drive = make()
    state, before = drive.save(), make()
    prepared(before, "calibrated")
    there = before.save()
    damaged = bytearray(state)
    damaged[at] ^= 1
    assert before.restore(bytes(damaged)) == NO_STATE
    assert before.save() == there


def test_a_state_of_another_motor_or_size_is_refused(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    other = Drive(load("hsm1"))
    state = other.save()
    other.close()
    drive = make()
    assert drive.restore(state) == NO_STATE
    for size in (-1, 0, 1, len(state) - 1, len(state) + 1):
        assert library.fluxtrue_state_restore(drive.handle, state, size) == OUT_OF_RANGE
        assert library.fluxtrue_state_save(drive.handle, ctypes.create_string_buffer(len(state)), size) == OUT_OF_RANGE


def test_a_drive_on_a_bus_has_no_state(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    drive, state = make(), make().save()
    library.can_host_attach.argtypes = [ctypes.c_void_p]
    library.can_host_attach(drive.handle)
    buffer = ctypes.create_string_buffer(len(state))
    assert library.fluxtrue_state_save(drive.handle, buffer, len(buffer)) == NO_STATE
    assert drive.restore(state) == NO_STATE


def test_a_state_holds_no_address() -> None:
    """All pointers in a drive, by the debug information: those of the motor data, and those of a bus."""
    found = pointers(str(library_path("paper")))
    assert "drive.motor" in found
    cleared = ("data", "motor.", "drive.motor", "drive.period.flux_table.", "drive.data_check.motor")
    bus = ("ecu.",)  # of the same memory as `drive`; a drive on a bus is not saved
    assert [name for name in found if not name.startswith((*cleared, *bus))] == []
