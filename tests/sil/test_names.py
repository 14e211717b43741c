# SPDX-License-Identifier: Apache-2.0
"""Version 2 of the interface: what the library says about itself and its names, and access by handles."""

import ctypes
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from sil import (
    BITS,
    CHOICE,
    COUNT,
    OK,
    OUT_OF_RANGE,
    READ_ONLY,
    ROOT,
    SWITCH,
    UNKNOWN_NAME,
    Drive,
    Info,
    info,
    load,
    names,  # fmt: skip
)

LIST = ROOT / "hal" / "host" / "name_list.h"
HEADER = ROOT / "hal" / "host" / "fluxtrue.h"
UNITS = {"_Nm": "Nm", "_A": "A", "_V": "V", "_W": "W", "_C": "degC", "_Vs": "Vs", "_ohm": "ohm", "_rpm": "rpm",
         "_rad": "rad", "_rad_s": "rad/s", "_Nm_per_s": "Nm/s"}  # fmt: skip


@pytest.fixture
def drive(library: ctypes.CDLL) -> Iterator[Drive]:
    made = Drive(library)
    yield made
    made.close()


def described(library: ctypes.CDLL) -> list[tuple[str, Info]]:
    return [(name, info(library, handle)) for handle, name in enumerate(names(library))]


@pytest.mark.parametrize("motor", ["hsm1", "paper"])
def test_the_library_says_its_version_its_motor_and_its_period(motor: str) -> None:
    library = load(motor)
    assert library.fluxtrue_abi() == int(re.findall(r"#define FLUXTRUE_ABI (\d+)", HEADER.read_text())[0]) == 2
    assert library.fluxtrue_motor().decode() == motor
    assert library.fluxtrue_period_s() == 1e-4


def test_every_call_of_version_1_is_still_there(library: ctypes.CDLL) -> None:
    for name in ("version", "create", "destroy", "set", "get", "name", "word", "explanation", "memory_read",
                 "memory_write", "step"):  # fmt: skip
        assert getattr(library, f"fluxtrue_{name}")


def test_a_handle_is_the_index_of_its_name_and_old_names_have_that_of_the_present_one(library: ctypes.CDLL) -> None:
    found = names(library)
    assert [library.fluxtrue_handle(name.encode()) for name in found] == list(range(len(found)))
    assert library.fluxtrue_handle(b"torque_command_Nm") == found.index("torque_requested_Nm")
    for name in (b"", b"torque", None, b"x" * 10000):
        assert library.fluxtrue_handle(name) == UNKNOWN_NAME


def test_access_by_handle_is_access_by_name(library: ctypes.CDLL, drive: Drive) -> None:
    for handle, name in enumerate(names(library)):
        assert library.fluxtrue_get_by(drive.handle, handle) == drive.get(name)
    handle = library.fluxtrue_handle(b"torque_requested_Nm")
    assert library.fluxtrue_set_by(drive.handle, handle, 12.5) == OK
    assert drive.get("torque_requested_Nm") == 12.5
    assert library.fluxtrue_set_by(drive.handle, handle, 1e6) == OUT_OF_RANGE
    for outside in (-1, -(2**31), len(names(library)), 2**31 - 1):
        assert library.fluxtrue_set_by(drive.handle, outside, 0.0) == UNKNOWN_NAME
        assert math.isnan(library.fluxtrue_get_by(drive.handle, outside))


def test_every_name_is_described_and_every_description_belongs_to_a_name(library: ctypes.CDLL) -> None:
    for name, about in described(library):
        assert about.name.decode() == name
        assert re.fullmatch(r"[A-Z0-9].{8,}\.", about.help.decode()), name
    lines = re.findall(r"^    X\((\w+),", LIST.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(lines) > 50
    assert [line for line in lines if "##" not in line and line not in names(library)] == []


def test_the_unit_is_the_one_in_the_name(library: ctypes.CDLL) -> None:
    for name, about in described(library):
        fitting = [unit for end, unit in UNITS.items() if name.endswith(end)]
        assert about.unit.decode() in (fitting or [""]), name


def test_the_range_is_what_is_accepted(library: ctypes.CDLL, drive: Drive) -> None:
    writable = 0
    for name, about in described(library):
        if not about.writable:
            assert math.isnan(about.lo) and math.isnan(about.hi), name
            assert drive.set(name, drive.get(name)) == READ_ONLY, name
            continue
        writable += 1
        assert about.lo < about.hi, name
        for inside in (about.lo, about.hi, max(about.lo, about.least)):
            assert drive.set(name, inside) == OK, (name, inside)
        lower, upper = np.float32(about.lo), np.float32(about.hi)  # the firmware's own bounds are floats
        for outside in (np.nextafter(lower, -np.inf), np.nextafter(upper, np.inf), math.nan, math.inf):
            assert drive.set(name, float(outside)) == OUT_OF_RANGE, (name, outside)
        if about.least > 0.0:
            assert drive.set(name, about.least / 2.0) == OUT_OF_RANGE, name
            assert drive.set(name, 0.0) == OK, name
    assert writable > 20


def test_the_initial_value_is_that_of_a_new_drive(library: ctypes.CDLL, drive: Drive) -> None:
    for name, about in described(library):
        assert about.initial == drive.get(name), name
        if about.writable:
            assert about.lo <= about.initial <= about.hi, name


def test_words_are_there_for_choices_and_bits_and_for_nothing_else(library: ctypes.CDLL, drive: Drive) -> None:
    word = ctypes.create_string_buffer(64)
    for name, about in described(library):
        known = [value for value in range(64) if library.fluxtrue_word(name.encode(), value, word, 64) == OK]
        assert bool(known) == (about.kind in (CHOICE, BITS)), name
        assert all(library.fluxtrue_explanation(name.encode(), value) for value in known)
        if about.kind == CHOICE:
            assert int(drive.get(name)) in known
        if about.kind in (SWITCH, COUNT):
            assert drive.get(name) in ((0.0, 1.0) if about.kind == SWITCH else (0.0,)), name
        if about.kind == SWITCH and about.writable:
            assert (about.lo, about.hi) == (0.0, 1.0), name


def test_a_caller_with_a_smaller_or_larger_description_gets_what_both_know(library: ctypes.CDLL) -> None:
    whole = info(library, 0)
    small = (ctypes.c_char * 64)(*b"\x55" * 64)
    size = Info.lo.offset
    assert library.fluxtrue_info(0, ctypes.cast(small, ctypes.POINTER(Info)), size) == OK
    assert small.raw[:size] == bytes(whole)[:size]
    assert small.raw[size:] == b"\x55" * (64 - size)
    large = (ctypes.c_char * 200)(*b"\x55" * 200)
    assert library.fluxtrue_info(0, ctypes.cast(large, ctypes.POINTER(Info)), 200) == OK
    assert large.raw[ctypes.sizeof(Info) :] == b"\x55" * (200 - ctypes.sizeof(Info))
    for handle, length, code in ((0, 0, OUT_OF_RANGE), (0, -1, OUT_OF_RANGE), (-1, 64, UNKNOWN_NAME)):
        assert library.fluxtrue_info(handle, ctypes.byref(whole), length) == code
