# SPDX-License-Identifier: Apache-2.0
"""Recorded samples through the firmware in one call: what it measures, and which fault it finds and when.

FLUXTRUE_SIL=build/host/motors/hsm1/libfluxtrue_sil.so python docs/howto/sil/replay.py
"""

import ctypes
import os

import numpy as np

DOUBLES, INTS = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int)
PERIODS, POLE_PAIRS, SPEED_RPM, CURRENT_A, BROKEN_AT = 10000, 3, 1000.0, 80.0, 7500


class Batch(ctypes.Structure):
    """fluxtrue_batch_t of hal/host/fluxtrue.h."""

    _fields_ = (
        ("periods", ctypes.c_int), ("samples", DOUBLES), ("out", DOUBLES),
        ("sets", ctypes.c_int), ("set", INTS), ("set_values", DOUBLES),
        ("gets", ctypes.c_int), ("get", INTS), ("get_values", DOUBLES),
    )  # fmt: skip


lib = ctypes.CDLL(os.environ["FLUXTRUE_SIL"])
lib.fluxtrue_create.restype = ctypes.c_void_p
lib.fluxtrue_period_s.restype = ctypes.c_double
lib.fluxtrue_motor.restype = lib.fluxtrue_explanation.restype = ctypes.c_char_p
lib.fluxtrue_set.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double]
lib.fluxtrue_run.argtypes = [ctypes.c_void_p, ctypes.POINTER(Batch)]
assert lib.fluxtrue_abi() >= 2

# A recording would be read from a file. This one is made here: i_q at a constant speed, and an open sensor in phase b.
time_s = lib.fluxtrue_period_s() * np.arange(PERIODS)
theta_m = SPEED_RPM * 2 * np.pi / 60 * time_s
samples = np.empty((PERIODS, 6))
for phase in range(3):
    samples[:, phase] = -CURRENT_A * np.sin(POLE_PAIRS * theta_m - phase * 2 * np.pi / 3)
samples[BROKEN_AT:, 1] = 0.0
samples[:, 3:] = np.column_stack([np.full(PERIODS, 350.0), theta_m, np.full(PERIODS, 20.0)])

names = ("id_A", "iq_A", "speed_rpm", "fault_word")
handles = np.array([lib.fluxtrue_handle(name.encode()) for name in names], dtype=np.int32)
values = np.zeros((PERIODS, len(names)))
drive = ctypes.c_void_p(lib.fluxtrue_create())
lib.fluxtrue_set(drive, b"enable", 1.0)
lib.fluxtrue_set(drive, b"machine_monitors", 0.0)  # the currents of a recording do not follow the duties
batch = Batch(periods=PERIODS, samples=samples.ctypes.data_as(DOUBLES), gets=len(names),
              get=handles.ctypes.data_as(INTS), get_values=values.ctypes.data_as(DOUBLES))  # fmt: skip
assert lib.fluxtrue_run(drive, ctypes.byref(batch)) == 0

print(f"motor {lib.fluxtrue_motor().decode()}, {PERIODS} periods of {1e6 * lib.fluxtrue_period_s():g} us")
for name, column in zip(names[:3], values.T, strict=False):
    print(f"{name} {column[BROKEN_AT - 1000 : BROKEN_AT].mean():.1f}")
word = ctypes.create_string_buffer(64)
for bit in range(32):
    found = np.flatnonzero(values[:, 3].astype(np.uint32) & (1 << bit))
    if found.size and lib.fluxtrue_word(b"fault_word", bit, word, len(word)) == 0:
        late_ms = 1e3 * (time_s[found[0]] - time_s[BROKEN_AT])
        print(f"{word.value.decode()} after {late_ms:.1f} ms: {lib.fluxtrue_explanation(b'fault_word', bit).decode()}")
lib.fluxtrue_destroy(drive)
