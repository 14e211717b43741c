# SPDX-License-Identifier: Apache-2.0
"""Faults, states, reasons and results have the names and explanations of the firmware's lists on every channel."""

import ctypes
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ecu import BUILD, load_dbc

from fluxtrue_tools import faults
from fluxtrue_tools.a2l import elf
from fluxtrue_tools.a2l.cli import render
from fluxtrue_tools.bus import words
from fluxtrue_tools.errors import FluxtrueError

LISTS = words.read()
MOTOR = BUILD / "motors" / "hsm1"
LIBRARY_LISTS = {"fault_word": "FAULT_LIST", "derating": "DERATING_LIST", "run_state": "RUN_STATE_LIST",
                 "commission": "COMMISSION_PHASE_LIST", "commission_failure": "COMMISSION_FAILURE_LIST",
                 "pulses": "PULSES_PHASE_LIST", "pulses_failure": "PULSES_FAILURE_LIST",
                 "spin_failure": "SPIN_FAILURE_LIST", "motor_check": "MOTOR_CHECK_LIST"}  # fmt: skip
DESCRIBED = {
    "FAULT": "FAULT_LIST",
    "ECU_FAULT": "ECU_FAULT_LIST",
    "ECU_STATE": "ECU_STATE_LIST",
    "MOTOR_CHECK": "MOTOR_CHECK_LIST",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of everything that the lists are read from and written to."""
    places = {*words.SOURCES.values(), *words.PAGES, words.DBC.relative_to(words.ROOT).as_posix()}
    for place in places:
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(words.ROOT / place, tmp_path / place)
    return tmp_path


def differing(tree: Path) -> set[str]:
    return {path.name for path, before, after in words.wanted(tree) if before != after}


def change(path: Path, before: str, after: str) -> None:
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))


def test_the_dbc_and_the_pages_say_what_the_lists_say() -> None:
    done = subprocess.run([sys.executable, "-m", "fluxtrue_tools.bus.words", "--check"],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_a_new_fault_bit_and_a_changed_explanation_are_missed_by_dbc_and_page(tree: Path) -> None:
    assert differing(tree) == set()
    header = tree / words.SOURCES["FAULT_LIST"]
    change(header, "X(GATE, 15,", 'X(EARTH, 16, "The insulation has failed.") \\\n    X(GATE, 15,')
    assert differing(tree) == {"fluxtrue.dbc", "architecture.md"}
    shutil.copy(words.ROOT / words.SOURCES["FAULT_LIST"], header)
    assert differing(tree) == set()
    change(header, "exceeds the trip level", "is too large")
    assert differing(tree) == {"fluxtrue.dbc", "architecture.md"}


@pytest.mark.parametrize(("before", "after", "where"), [
    ('VAL_ 529 RefusedReason 0 "none"', 'VAL_ 529 RefusedReason 0 "nothing"', "firmware/comm/fluxtrue.dbc"),
    ("Bit 15 gate:", "Bit 14 gate:", "firmware/comm/fluxtrue.dbc"),
    ("| 4 | `sensor_implausible`", "| 5 | `sensor_implausible`", "docs/howto/can.md"),
    ("| 2 | `moved` | The rotor moved |\n", "", "docs/howto/commission.md"),
])  # fmt: skip
def test_an_edit_by_hand_is_found(tree: Path, before: str, after: str, where: str) -> None:
    change(tree / where, before, after)
    assert differing(tree) == {Path(where).name}


@pytest.mark.parametrize(("before", "after", "message"), [
    ("X(GATE, 15,", "X(GATE, 1 + 14,", "15 rows understood of 16"),
    ("X(GATE, 15,", "X(GATE, 14,", "a name or value comes twice"),
    ("X(GATE, 15,", "X(TORQUE, 15,", "a name or value comes twice"),
    ("FAULT_LIST(X)", "FAULTS(X)", "no FAULT_LIST"),
])  # fmt: skip
def test_a_list_that_is_not_understood_is_an_error(tree: Path, before: str, after: str, message: str) -> None:
    change(tree / words.SOURCES["FAULT_LIST"], before, after)
    with pytest.raises(FluxtrueError, match=message):
        list(words.wanted(tree))


def test_every_value_of_a_table_can_be_sent() -> None:
    database = load_dbc()
    for path in words.CHOICES:
        message, signal = path.split(".")
        described = database.get_message_by_name(message).get_signal_by_name(signal)
        told = {value: str(name) for value, name in (described.choices or {}).items()}
        assert told == words.choices(LISTS, path)
        assert max(told) <= described.maximum, path


def test_the_comment_of_a_fault_word_explains_every_bit() -> None:
    message = load_dbc().get_message_by_name("INV_Faults")
    for signal, name in (("DriveFaults", "FAULT_LIST"), ("EcuFaults", "ECU_FAULT_LIST")):
        comment = message.get_signal_by_name(signal).comment
        for word in LISTS[name]:
            assert f"Bit {word.value} {word.name}: {word.text}" in comment


def test_the_tools_name_faults_as_the_list_does() -> None:
    assert faults.named(0xFFFF) == [word.name for word in sorted(LISTS["FAULT_LIST"], key=lambda word: word.value)]


def test_the_library_has_the_compiler_s_view_of_the_same_lists() -> None:
    library = ctypes.CDLL(str(MOTOR / "libfluxtrue_sil.so"))
    library.fluxtrue_explanation.restype = ctypes.c_char_p
    text = ctypes.create_string_buffer(64)
    for name, wanted in LIBRARY_LISTS.items():
        found = []
        for value in range(256):
            if library.fluxtrue_word(name.encode(), value, text, len(text)) == 0:
                explanation = library.fluxtrue_explanation(name.encode(), value).decode()
                found.append(words.Word(text.value.decode(), value, explanation))
        assert found == sorted(LISTS[wanted], key=lambda word: word.value), name


def test_the_library_names_nothing_that_is_not_there() -> None:
    library = ctypes.CDLL(str(MOTOR / "libfluxtrue_sil.so"))
    library.fluxtrue_explanation.restype = ctypes.c_char_p
    text = ctypes.create_string_buffer(b"untouched", 64)
    for name, value in ((b"fault_word", 16), (b"fault_word", -1), (b"speed_rpm", 0), (b"", 0), (None, 0)):
        assert library.fluxtrue_word(name, value, text, len(text)) == -1
        assert library.fluxtrue_explanation(name, value) is None
    for size in (0, -1, len("over_current")):
        assert library.fluxtrue_word(b"fault_word", 0, text, size) == -2
    assert text.value == b"untouched"
    assert library.fluxtrue_word(b"fault_word", 0, text, len("over_current") + 1) == 0


def test_the_description_file_has_the_same_words() -> None:
    description = elf.read(MOTOR / "fluxtrue_vecu")
    for base, name in DESCRIBED.items():
        found = [words.Word(word.name, word.value, word.text) for word in description.words if word.base == base]
        assert found == LISTS[name]
    text = render(description, "fluxtrue_vecu")
    for measurement in ("fault_word", "freeze_fault_word", "freeze_ecu_faults", "freeze_state"):
        (block,) = re.findall(rf"/begin MEASUREMENT {measurement} .*?/end MEASUREMENT", text, re.DOTALL)
        assert "words_ECU_STATE" in block or "/begin ANNOTATION_TEXT" in block
    (states,) = re.findall(r"/begin COMPU_VTAB table_ECU_STATE .*?/end COMPU_VTAB", text, re.DOTALL)
    assert '6 "safe_state"' in states
