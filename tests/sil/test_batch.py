# SPDX-License-Identifier: Apache-2.0
"""Several periods in one call, and the reset: each must equal single steps and a new drive to the last bit."""

import ctypes
import math
from collections.abc import Callable

import numpy as np
import pytest
from sil import OK, OUT_OF_RANGE, READ_ONLY, UNKNOWN_NAME, Batch, Drive, names, pointer

PERIODS = 600


def recorded() -> np.ndarray:
    """Samples of a turning machine with noise; the currents do not follow the duties."""
    rng = np.random.default_rng(4)
    theta = 0.02 * np.arange(PERIODS)
    phases = [-60.0 * np.sin(3 * theta - k * 2 * np.pi / 3) + rng.normal(0, 0.5, PERIODS) for k in range(3)]
    return np.column_stack([*phases, np.full(PERIODS, 350.0), theta, np.full(PERIODS, 25.0)])


def sets() -> dict[str, np.ndarray]:
    """Enable from the start, torque from period 200 on, another slew limit in the middle, and a reset of faults."""
    periods = np.arange(PERIODS)
    return {
        "machine_monitors": np.zeros(PERIODS),
        "enable": np.ones(PERIODS),
        "torque_requested_Nm": np.where(periods < 200, 0.0, 30.0),
        "torque_slew_Nm_per_s": np.where(periods < 400, 1000.0, 3000.0),
        "identification_reset": (periods == 300).astype(float),
    }


def test_a_batch_is_the_same_as_single_steps(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    gets = names(library)
    samples, given = recorded(), sets()
    code, out, values = make().run(samples, given, gets)
    assert code == OK
    single = make()
    before: dict[str, float] = {}
    for k in range(PERIODS):
        for name, column in given.items():
            if before.get(name) != column[k]:
                assert single.set(name, float(column[k])) == OK
                before[name] = column[k]
        assert tuple(out[k]) == single.step(tuple(samples[k]))
        assert [single.get(name) for name in gets] == list(values[k])
    assert single.get("fault_word") == 0.0
    assert np.ptp(values[:, gets.index("torque_commanded_Nm")]) > 20.0
    assert len(np.unique(out[:, 0])) > 100


def test_outputs_and_values_may_be_left_out(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    whole, short = make(), make()
    samples = recorded()
    assert whole.run(samples)[0] == OK
    batch = Batch(PERIODS, pointer(samples), None, 0, None, None, 0, None, None)
    assert library.fluxtrue_run(short.handle, ctypes.byref(batch)) == OK
    assert [short.get(name) for name in names(library)] == [whole.get(name) for name in names(library)]
    assert library.fluxtrue_run(short.handle, ctypes.byref(Batch())) == OK  # no period at all


@pytest.mark.parametrize(
    ("name", "row", "value", "code"),
    [
        ("torque_requested_Nm", PERIODS - 1, 1e6, OUT_OF_RANGE),
        ("torque_requested_Nm", 0, math.nan, OUT_OF_RANGE),
        ("enable", 10, math.inf, OUT_OF_RANGE),
        ("fault_word", 0, 0.0, READ_ONLY),
        ("nonsense", 0, 0.0, UNKNOWN_NAME),
    ],
)
def test_a_batch_with_a_value_that_is_refused_does_not_run_at_all(
    library: ctypes.CDLL, make: Callable[[], Drive], name: str, row: int, value: float, code: int
) -> None:
    drive = make()
    assert drive.set("torque_requested_Nm", 5.0) == OK
    before = drive.save()
    given = {"enable": np.ones(PERIODS), name: np.zeros(PERIODS)}
    given[name] = given[name].copy()
    given[name][row] = value
    refused, out, _ = drive.run(recorded(), given)
    assert refused == code
    assert (out == 9.0).all()
    assert drive.save() == before


def test_a_batch_with_impossible_numbers_is_refused(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    drive = make()
    samples, handles, values = recorded(), np.array([10**6], np.int32), np.zeros((PERIODS, 1))
    for bad, code in ((Batch(periods=-1), OUT_OF_RANGE), (Batch(sets=-1), OUT_OF_RANGE), (Batch(gets=-1), OUT_OF_RANGE),
                      (Batch(PERIODS, pointer(samples), None, 0, None, None, 1, pointer(handles), pointer(values)),
                       UNKNOWN_NAME)):  # fmt: skip
        assert library.fluxtrue_run(drive.handle, ctypes.byref(bad)) == code


def test_after_a_reset_a_drive_is_as_created(library: ctypes.CDLL, make: Callable[[], Drive]) -> None:
    drive, new = make(), make()
    assert drive.run(recorded(), sets())[0] == OK
    assert drive.set("enable", 0.0) == OK
    assert drive.run(recorded()[:1])[0] == OK
    assert drive.save() != new.save()
    drive.reset()
    assert drive.memory() == b"\xff" * 4096
    given = sets()
    again, first = drive.run(recorded(), given, names(library)), new.run(recorded(), given, names(library))
    np.testing.assert_array_equal(again[1], first[1])
    np.testing.assert_array_equal(again[2], first[2])
