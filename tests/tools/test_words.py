# SPDX-License-Identifier: Apache-2.0
"""The checker of words finds words that are not terms of the field, and says which to use instead."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "words.py"


def check(root: Path) -> tuple[int, list[str]]:
    """Exit code and messages."""
    command = [sys.executable, str(SCRIPT), "--root", str(root)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def write(root: Path, name: str, text: str) -> Path:
    """The project with this file."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text)
    return root


@pytest.mark.parametrize(
    ("text", "word", "instead"),
    [
        ("A contradiction lowers the confidence.", "contradiction", "mismatch"),
        ("The loop stays closed by its own distrust.", "distrust", "low confidence"),
        ("The monitors judge it.", "judge", "check, evaluate, classify"),
        ("What was learnt is kept.", "learnt", "identify, adapt"),
        ("A reset forgets the faults.", "forgets", "clear, reset, discard"),
        ("Nobody listens.", "Nobody", "the part that is meant, or the passive voice"),
        ("The sample is checked carefully.", "carefully", "checked, or what is checked"),
        ("An unsettled period.", "unsettled", "not settled"),
        ("It localises the flux error.", "localises", "local flux error, or what is found"),
        ("A calm drive.", "calm", "smooth, idle"),
        ("The rooms of the firmware.", "rooms", "free space, margin, limit, folder"),
        ("The task looks at the sample.", "looks at", "check, read, evaluate"),
        ("The angle is believed.", "believed", "use, rely on, count"),
        ("Down there the voltage is unknown.", "Down there", "the condition, for example: below v_min"),
        ("A number that is none is refused.", "number that is none", "NaN or infinity"),
        ("It is an identify_pair_t.", "identify_pair_t", "the vector's type with its format, for example dq_q30_t"),
        ("The gates are closed.", "gates are closed", "switching enabled, disabled"),
        ("The fault opens the gates.", "opens the gates", "switching enabled, disabled"),
    ],
)
def test_a_word_is_refused_in_every_kind_of_file(tmp_path: Path, text: str, word: str, instead: str) -> None:
    names = ("README.md", "firmware/drive/drive.h", "tests/loop/run.toml", "tools/check.py", "tools/demo")
    for name in names:
        write(tmp_path, name, f"one\n{text}\n")
    code, messages = check(tmp_path)
    assert code == 1
    assert messages == [f"{name}:2: '{word}', use instead: {instead}" for name in names]


@pytest.mark.parametrize("name", ["static int judge_sample(int x)", "void test_a_jump_is_judged(void)", "int ROOM_C;"])
def test_a_part_of_a_name_is_refused(tmp_path: Path, name: str) -> None:
    assert check(write(tmp_path, "tests/unit/test_x.c", f"{name}\n"))[0] == 1


def test_an_odd_name_is_refused_in_firmware_and_ports_only(tmp_path: Path) -> None:
    for name in ("firmware/ecu/ecu.c", "hal/host/port.c"):
        code, messages = check(write(tmp_path / "odd", name, "int most = 3;\n"))
        assert code == 1 and f"{name}:1: the name 'most', use instead: max" in messages
    for name in ("firmware/ecu/ecu.c", "tests/plant/plant.c"):
        text = "/* most of them */ int max; /* at most\n * two, the most */\n" if "ecu" in name else "int most;\n"
        assert check(write(tmp_path / "good", name, text)) == (0, [])


@pytest.mark.parametrize(
    "text",
    [
        "an innovation beyond the gate, a gate driver, a closed loop, an open contactor",
        "a look-up in two dimensions looks up the flux; most of the time; one turn of the rotor",
        "headroom, mushroom",
        "gate fault; the gate of the test; regulates",
    ],
)
def test_terms_of_the_field_pass(tmp_path: Path, text: str) -> None:
    assert check(write(tmp_path, "docs/page.md", text + "\n")) == (0, [])


def test_pages_that_are_about_a_word_and_data_may_have_it(tmp_path: Path) -> None:
    write(tmp_path, "CHANGELOG.md", "| `contradiction` | `mismatch_share` |\n")
    write(tmp_path, "docs/theory/mrai.md", "While the gates are open the parameters adapt.\n")
    write(tmp_path, "docs/map.csv", "nobody\n")
    assert check(tmp_path) == (0, [])
