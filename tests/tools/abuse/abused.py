# SPDX-License-Identifier: Apache-2.0
"""Runs a command on mutated files in a folder of its own, and mutates texts and tables.

No input may cause a traceback or a partial output. FLUXTRUE_ABUSE is the number of inputs of each test: 12 by default;
CONTRIBUTING.md has the command for the full count.
"""

import contextlib
import io
import os
import resource
import shutil
import sys
import tempfile
import traceback
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir

from fluxtrue_tools import cli

Content = str | bytes
GATE = 12  # inputs of each test
COUNT = int(os.environ.get("FLUXTRUE_ABUSE", GATE))
MEMORY = Path("/dev/shm")  # thousands of folders: a disk takes longer for them than the commands do
ROOT = Path(__file__).resolve().parents[3]
set_hypothesis_home_dir(ROOT / "build" / "hypothesis")  # Hypothesis writes files there even without a database
ABUSED = settings(max_examples=COUNT, deadline=None, derandomize=True, database=None,
                  phases=[Phase.generate], suppress_health_check=list(HealthCheck))  # fmt: skip
# For inputs of which many take half a second to refuse: fewer in the gate, as many in the full count.
ABUSED_LESS = settings(ABUSED, max_examples=COUNT if COUNT > GATE else 4)

MOTOR = """[machine]
name = "bench"
pole_pairs = 4
r_ohm = 0.02
r_temp_coeff_per_K = 0.00393
i_max_A = 250.0
torque_max_Nm = 100.0
speed_max_rpm = 6000.0
inertia_kgm2 = 0.05
flux_map = "flux_map.csv"
[inverter]
vdc_V = 350.0
pwm_hz = 10000.0
dead_time_s = 2e-6
current_full_scale_A = 400.0
adc_bits = 12
"""
MAP = "id_A,iq_A,psi_d_Vs,psi_q_Vs\n" + "".join(
    f"{d},{q},{0.084 + 2e-4 * d:.6g},{5e-4 * q:.6g}\n"
    for d in (-300, -200, -100, 0) for q in (0, 100, 200, 300)
)  # fmt: skip
ODD_VALUES = ("nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "true", '"text"', '""', "[]", "{}", "[1]",
              "[[0, 1]]",
              "99999999999999999999", "1979-05-27", "'\\u0000'", '"' + "x" * 300 + '"', "0.5", "3")  # fmt: skip
# What no key that takes a number, a text, a list or a table can mean.
NO_NUMBER = {"nan", "inf", "1e300", "-1e300", '"text"', '""', "[]", "{}", "[1]", "99999999999999999999", "1979-05-27",
             "'\\u0000'", '"' + "x" * 300 + '"'}  # fmt: skip
NO_TEXT = {"nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "true", '""', "[]", "{}", "[1]", "[[0, 1]]",
           "99999999999999999999", "1979-05-27", "'\\u0000'", "0.5", "3"}  # fmt: skip
NO_LIST = NO_NUMBER - {"[]", "[1]"}  # where a list is right, a profile takes a number, too
NO_TABLE = NO_TEXT - {"{}"} | {'"text"'}
ODD_CELLS = ("nan", "1e300", "-1e300", "", "x", "0", "1e-300", "1_0", "-5", "1e5", "٣")


class Blob(bytes):
    """The content of a binary file, which a report shows by its length and checksum."""

    def __repr__(self) -> str:
        return f"{len(self)} bytes, {zlib.crc32(self):#010x}"


class Accepted(BaseException):
    """Raised in place of the work that would follow; only the test catches it."""


def accepted(*_: Any, **__: Any) -> Any:
    """Stands for work that takes long."""
    raise Accepted


def surely_wrong(value: str, other: str) -> bool:
    """Whether another value cannot be meant where this one is right."""
    kind = NO_TEXT if value.startswith('"') else NO_LIST if value.startswith("[") else NO_TABLE if (
        value.startswith("{")) else NO_NUMBER  # fmt: skip
    return other in kind and not (value in ("true", "false") and other == "0")


@contextlib.contextmanager
def disk(left: int | None) -> Iterator[None]:
    """No file may become larger than this: what writes more gets an error, as on a full disk."""
    if left is None:
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (left, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def snapshot(folder: Path, above: str = "") -> dict[str, bytes | str]:
    """Everything in the folder by its name."""
    found: dict[str, bytes | str] = {}
    for entry in sorted(os.scandir(folder), key=lambda one: one.name):
        name, path = above + entry.name, Path(entry.path)
        if entry.is_symlink():
            found[name] = str(path.readlink())
        elif entry.is_dir():
            found |= {name: "folder"} | snapshot(path, f"{name}/")
        else:
            found[name] = path.read_bytes()
    return found


@contextlib.contextmanager
def workplace(files: dict[str, Content]) -> Iterator[Path]:
    before, folder = Path.cwd(), Path(tempfile.mkdtemp(prefix="abuse-", dir=MEMORY if MEMORY.is_dir() else None))
    try:
        for name, content in files.items():
            data = content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        (folder / "loop").symlink_to("loop")
        (folder / "link").symlink_to("in.toml")
        (folder / "folder").mkdir()
        (folder / "file").write_text("a file\n")
        os.chdir(folder)
        yield folder
    finally:
        os.chdir(before)
        shutil.rmtree(folder, ignore_errors=True)


def outcome(arguments: list[str], told: str, left: int | None) -> tuple[int | None, str]:
    """Exit code, None where the input was accepted and the work would begin, and the messages."""
    out, err = io.StringIO(), io.StringIO()
    with (contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), disk(left),
          warnings.catch_warnings(record=True) as said):  # fmt: skip
        warnings.simplefilter("always")
        before, ignored = sys.unraisablehook, []  # a traceback on the terminal, too
        sys.unraisablehook = lambda one: ignored.append(str(one.exc_value))
        try:
            code: int | None = cli.run(arguments)
        except Accepted:
            code = None
        except BaseException:
            pytest.fail(f"{told}\n{traceback.format_exc()}")
        finally:
            sys.unraisablehook = before
    assert not ignored, f"{told}: {ignored}"
    noisy = [str(one.message) for one in said if issubclass(one.category, RuntimeWarning)]
    assert not noisy, f"{told}: {noisy}"
    assert "Traceback" not in err.getvalue(), f"{told}: {err.getvalue()}"
    assert code in (None, 0, 1, 2), told
    return code, err.getvalue()


def abuse(files: dict[str, Content], arguments: list[str], outputs: Sequence[str] = (), must_fail: bool = False,
          inspect: Callable[[Path, str], None] | None = None, left: int | None = None) -> str:  # fmt: skip
    """Run the command and check exit code, messages, inputs and outputs; the messages.

    must_fail   the input is wrong: a success, or the begin of the work, is a failure
    inspect     gets the folder and the messages of a success
    left        bytes that can be written to a file
    """
    with workplace(files) as folder:
        before, told = snapshot(folder), f"fluxtrue {arguments!r}"
        code, text = outcome(arguments, told, left)
        after = snapshot(folder)
        if code == 2:
            assert text.startswith(("error: ", "Usage: ")), f"{told}: {text!r}"
            assert text.startswith("Usage: ") or text.count("\n") == 1, f"{told}: {text!r}"
            assert after == before, f"{told}: left {sorted(set(after) ^ set(before))}"
            return text
        assert not must_fail, f"{told}: {'accepted' if code is None else f'exit {code}'} although the input is wrong"
        kept = {name: content for name, content in before.items() if code is None or name not in outputs}
        assert {name: after.get(name) for name in kept} == kept, f"{told}: an input has changed"
        assert not [name for name in after if ".fluxtrue-" in name], told
        for name in outputs if code is not None else ():
            assert after.get(name), f"{told}: {name} is missing"
        if inspect is not None and code is not None:
            inspect(folder, text)
        return text


LINES = st.integers(0, 10**6)


def at_key(draw: Callable[..., Any], lines: list[str]) -> int:
    """A line of the form key = value."""
    keys = [k for k, line in enumerate(lines) if " = " in line]
    return keys[draw(LINES) % len(keys)]


def with_other_bytes(draw: Callable[..., Any], text: str) -> bytes:
    data, place = bytearray(text.encode()), draw(LINES) % len(text)
    data[place : place + draw(st.integers(0, 4))] = draw(st.binary(max_size=6))
    return bytes(data)


@st.composite
def mutated(draw: Callable[..., Any], good: str) -> tuple[str | bytes, bool]:
    """The text of a file with one mutation, and whether the file must be refused because of it."""
    lines = good.splitlines()
    kind = draw(st.sampled_from(["value", "value", "value", "unknown", "twice", "drop", "cut", "bytes", "swap"]))
    at = draw(LINES) % len(lines)
    wrong = kind in ("unknown", "twice")
    if kind == "value":
        at = at_key(draw, lines)
        key, value = lines[at].split(" = ", 1)
        other = draw(st.sampled_from(ODD_VALUES))
        lines[at], wrong = f"{key} = {other}", surely_wrong(value, other)
    elif kind == "unknown":
        lines.insert(at, f"{draw(st.text('abcdefgh_', min_size=3, max_size=9))}x = 1")
    elif kind == "twice":
        at = at_key(draw, lines)
        lines.insert(at, lines[at])
    elif kind == "drop":
        del lines[at]
    elif kind == "swap":
        other = draw(LINES) % len(lines)
        lines[at], lines[other] = lines[other], lines[at]
    text = "\n".join(lines) + "\n"
    if kind == "cut":
        return text[: draw(LINES) % len(text)], False
    return with_other_bytes(draw, text) if kind == "bytes" else text, wrong


def with_other_cells(
    draw: Callable[..., Any], rows: list[list[str]], kind: str, cells: tuple[str, ...]
) -> list[list[str]]:
    """One cell has another value, one row is missing or there twice, or one column is missing."""
    row = draw(LINES) % len(rows)
    column = draw(LINES) % len(rows[row])
    if kind == "cell":
        rows[row][column] = draw(st.sampled_from(cells))
    elif kind == "drop":
        del rows[row]
    elif kind == "twice":
        rows.insert(row, rows[row])
    elif kind == "column":
        return [line[:column] + line[column + 1 :] for line in rows]
    return rows


@st.composite
def mutated_table(draw: Callable[..., Any], good: str) -> str | bytes:
    """A table of text and numbers with one mutation."""
    kind = draw(st.sampled_from(["cell", "cell", "cell", "drop", "twice", "column", "cut", "bytes"]))
    cells = (*ODD_CELLS, '"', "=", "a=x", "b=^1@5..2", "rpm", "bus.lost=1@")
    rows = with_other_cells(draw, [line.split(",") for line in good.splitlines()], kind, cells)
    text = "\n".join(",".join(row) for row in rows) + "\n"
    if kind == "cut":
        return text[: draw(LINES) % len(text)]
    return with_other_bytes(draw, text) if kind == "bytes" else text
