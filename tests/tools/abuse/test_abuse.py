# SPDX-License-Identifier: Apache-2.0
"""Mutated files and command lines: every command ends with one message and exit code 2, or with a complete result.

No input may cause a traceback or a partial output. FLUXTRUE_ABUSE is the number of inputs of each test: 12 by default;
CONTRIBUTING.md has the command for the full count. Functions that would start a program, a server or a long run are
replaced by one that refuses with the message "accepted".
"""

import contextlib
import io
import os
import shutil
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir

from fluxtrue_tools import cli
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.map_import.cli import IMPORTED

COUNT = int(os.environ.get("FLUXTRUE_ABUSE", "12"))
ROOT = Path(__file__).resolve().parents[3]
set_hypothesis_home_dir(ROOT / "build" / "hypothesis")  # Hypothesis writes files there even without a database
ABUSED = settings(max_examples=COUNT, deadline=None, derandomize=True, database=None,
                  suppress_health_check=list(HealthCheck))  # fmt: skip

SCENARIO = """motor = "paper"
duration_s = 0.01
seed = 3
record_every_s = 1e-3
[controller]
torque_loop = true
[profile]
torque_Nm = [[0, 0], [0.005, 20]]
speed_rpm = 500
vdc_V = 340
[plant]
current_gain = [1.0, 1.01, 1.0]
dead_time_s = 1e-6
[[event]]
t = 0.005
set = { identification = false, "plant.magnet_scale" = 0.9 }
[window]
from_s = 0.002
to_s = 0.009
"""
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
CAMPAIGN = """motor = "paper"
cases = 4
seed = 7
[spread]
lq_scale = [0.9, 1.1]
[plant]
angle_bits = 12
[drive]
duration_s = 2
[windows]
speed_rpm = [[500, 5500, 1]]
low_speed_rpm = [250]
torque_min_Nm = 10
[[controller]]
name = "tables"
set = { torque_loop = false, identification = false }
[check]
controllers = ["tables"]
"""
FAULTS = """fmea = "fmea.csv"
points = [[0.2, 0.5], [0.8, -0.5]]
signs = [1, -1]
[[machine]]
motor = "paper"
current_A = 1000
vdc_V = 500
"""
FMEA_HEAD = """id,element,failure,setup,injection,points,reaction,expected,detect_ms,torque_Nm,torque_ms,current_share,
vdc_share,watch_ms,status,witness,result,reference"""
FMEA = (
    FMEA_HEAD.replace("\n", "")
    + """
open,sensor,input open,request=0,plant.current_open_a=1;plant.vdc_gain=x0.7@5..9,rpm>=500;torque!=0,safe_state,\
over_current,5,,50,,,60,open,paper/0/+,measured,
"""
)
MAP = "id_A,iq_A,psi_d_Vs,psi_q_Vs\n" + "".join(
    f"{d},{q},{0.084 + 2e-4 * d:.6g},{5e-4 * q:.6g}\n"
    for d in (-300, -200, -100, 0) for q in (0, 100, 200, 300)
)  # fmt: skip
ODD_VALUES = ("nan", "inf", "-1", "0", "1e300", "-1e300", "1e-300", "true", '"text"', '""', "[]", "{}", "[1]",
              "[[0, 1]]",
              "99999999999999999999", "1979-05-27", "'\\u0000'", '"' + "x" * 300 + '"', "0.5", "3")  # fmt: skip
ODD_PATHS = ("", "-", ".", "/", "..", "loop", "folder", "missing/x", "/dev/null", "/dev/zero", "/proc/x", "a" * 300,
             "in.toml", "in.toml/x",
             "link", "new.csv", "new.png", "new.json", "~", "~nobody/x", "a;b", "a\nb", "🙂.csv", "--out")  # fmt: skip


ODD_CELLS = ("nan", "1e300", "-1e300", "", "x", "0", "1e-300", "1_0", "-5", "1e5", "٣")


class Accepted(FluxtrueError):
    """Raised in place of the work that would follow once the input has been accepted."""


def accepted(*_: Any, **__: Any) -> Any:
    raise Accepted("accepted")


@pytest.fixture(scope="module", autouse=True)
def stubs() -> Iterator[None]:
    """Replace everything that builds, serves, starts another program or runs for long."""
    import fluxtrue_tools.bench as bench
    import fluxtrue_tools.campaign.run as campaign_run
    import fluxtrue_tools.demo.all as demo_all
    import fluxtrue_tools.fault_campaign.run as fault_run
    import fluxtrue_tools.live.cli as live_cli
    import fluxtrue_tools.motor.map_import.plot as import_plot
    from fluxtrue_tools.emulate import build as emulate_build
    from fluxtrue_tools.sim import build as sim_build

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "execv", accepted)
        patch.setattr(os, "execve", accepted)
        patch.setattr(sim_build, "_make", accepted)
        patch.setattr(emulate_build, "prepare", accepted)
        patch.setattr(bench, "run", accepted)
        patch.setattr(campaign_run, "run_case", accepted)
        patch.setattr(campaign_run, "_simulate", accepted)
        patch.setattr(fault_run, "whole", accepted)
        patch.setattr(fault_run, "one_line", accepted)
        patch.setattr(demo_all, "demonstrate", accepted)
        patch.setattr(live_cli, "_session", accepted)
        patch.setattr(live_cli, "VirtualEcu", accepted)
        patch.setattr(import_plot, "write", lambda _, path: path.write_bytes(b"a picture"))  # takes a second
        yield


def snapshot(folder: Path) -> dict[str, bytes | str]:
    found: dict[str, bytes | str] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        found[name] = str(path.readlink()) if path.is_symlink() else path.read_bytes() if path.is_file() else "folder"
    return found


@contextlib.contextmanager
def workplace(files: dict[str, str | bytes]) -> Iterator[Path]:
    before, folder = Path.cwd(), Path(tempfile.mkdtemp(prefix="abuse-"))
    try:
        for name, content in files.items():
            data = content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data)
        (folder / "loop").symlink_to("loop")
        (folder / "link").symlink_to("in.toml")
        (folder / "folder").mkdir()
        os.chdir(folder)
        yield folder
    finally:
        os.chdir(before)
        shutil.rmtree(folder, ignore_errors=True)


def abuse(files: dict[str, str | bytes], arguments: list[str], outputs: list[str], must_fail: bool = False) -> None:
    """Run the command and check exit code, messages, inputs and outputs."""
    with workplace(files) as folder:
        before, out, err = snapshot(folder), io.StringIO(), io.StringIO()
        told = f"fluxtrue {arguments!r}"
        with (contextlib.redirect_stdout(out), contextlib.redirect_stderr(err),
              warnings.catch_warnings(record=True) as said):  # fmt: skip
            warnings.simplefilter("always")
            try:
                code = cli.run(arguments)
            except BaseException:
                pytest.fail(f"{told}\n{traceback.format_exc()}")
        after, text = snapshot(folder), err.getvalue()
        noisy = [str(one.message) for one in said if issubclass(one.category, RuntimeWarning)]
        assert not noisy, f"{told}: {noisy}"
        assert "Traceback" not in text, f"{told}: {text}"
        assert code in (0, 1, 2), told
        if code == 2:
            assert text.startswith(("error: ", "Usage: ")), f"{told}: {text!r}"
            assert text.startswith("Usage: ") or text.count("\n") == 1, f"{told}: {text!r}"
            assert after == before, f"{told}: left {sorted(set(after) ^ set(before))}"
            return
        assert not must_fail, f"{told}: exit {code} although the input is wrong"
        assert {name: after.get(name) for name in before} == before, f"{told}: an input has changed"
        assert not [name for name in after if ".fluxtrue-" in name], told
        for name in outputs:
            assert after.get(name), f"{told}: {name} is missing"


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
    if kind == "value":
        at = at_key(draw, lines)
        lines[at] = lines[at].split(" = ")[0] + " = " + draw(st.sampled_from(ODD_VALUES))
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
    return with_other_bytes(draw, text) if kind == "bytes" else text, kind in ("unknown", "twice")


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


def arrays() -> dict[str, Any]:
    """The map by the names of every layout."""
    import numpy as np

    d, q, psi_d, psi_q = np.array([[float(cell) for cell in line.split(",")] for line in MAP.splitlines()[1:]]).T
    return {"i_s": d + 1j * q, "psi_s": psi_d + 1j * psi_q, "Id": d, "Iq": q, "Fd": psi_d, "Fq": psi_q,
            "OP_matrix": np.column_stack((d, d, q)) / 2**0.5,
            "Phi_dqh_mean": np.column_stack((psi_d, psi_q, d))}  # fmt: skip


def npz() -> bytes:
    import numpy as np

    file = io.BytesIO()
    np.savez(file, **arrays())
    return file.getvalue()


def mat() -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, arrays())
    return file.getvalue()


@st.composite
def mutated_map(draw: Callable[..., Any]) -> str | bytes:
    """A flux map with one mutation."""
    kinds = ["cell", "cell", "drop", "twice", "column", "separator", "scale", "sign", "offset", "bytes"]
    kind = draw(st.sampled_from(kinds))
    rows = with_other_cells(draw, [line.split(",") for line in MAP.splitlines()], kind, ODD_CELLS)
    if kind in ("scale", "sign", "offset"):
        column = draw(LINES) % 4
        number = draw(st.sampled_from((1e3, 1e-3, 1e6))) if kind == "scale" else -1.0 if kind == "sign" else 0.0
        for cells in rows[1:]:
            cells[column] = repr(float(cells[column]) + 0.5 if kind == "offset" else number * float(cells[column]))
    text = "\n".join((draw(st.sampled_from(";\t |")) if kind == "separator" else ",").join(r) for r in rows) + "\n"
    return with_other_bytes(draw, text) if kind == "bytes" else text


@ABUSED
@given(mutated(SCENARIO))
def test_scenarios(changed: tuple[str | bytes, bool]) -> None:
    command = ["sim", "in.toml", "--out", "o.csv", "--json", "o.json"]
    abuse({"in.toml": changed[0]}, command, ["o.csv", "o.json"], changed[1])


@ABUSED
@given(mutated(MOTOR))
def test_motor_files(changed: tuple[str | bytes, bool]) -> None:
    files = {"m/motor.toml": changed[0], "m/flux_map.csv": MAP}
    abuse(files, ["motor", "build", "m", "--out", "o", "--no-report"], ["o/motor_tables.c", "o/motor.json"], changed[1])


@ABUSED
@given(mutated_map())
def test_flux_maps(changed: str | bytes) -> None:
    abuse({"m/motor.toml": MOTOR, "m/flux_map.csv": changed}, ["motor", "check", "m"], [])


@ABUSED
@given(mutated(CAMPAIGN))
def test_campaigns(changed: tuple[str | bytes, bool]) -> None:
    abuse({"in.toml": changed[0]}, ["campaign", "in.toml", "--out", "o"], [], must_fail=True)


@ABUSED
@given(mutated(FAULTS))
def test_fault_campaigns(changed: tuple[str | bytes, bool]) -> None:
    abuse({"in.toml": changed[0], "fmea.csv": FMEA}, ["faults", "in.toml", "--out", "o"], [], must_fail=True)


@ABUSED
@given(mutated_table(FMEA))
def test_tables_of_faults(changed: str | bytes) -> None:
    abuse({"in.toml": FAULTS, "fmea.csv": changed}, ["faults", "in.toml", "--out", "o"], [], must_fail=True)


IMPORT = ("--format", "csv", "--motor", "m/motor.toml", "--out", "o")


@ABUSED
@given(mutated_map() | mutated_table("# made\nId;Iq;Psi d;Psi q\nA;A;Vs;Vs\n" + MAP.partition("\n")[2]))
def test_imported_maps(changed: str | bytes) -> None:
    files: dict[str, str | bytes] = {"m/motor.toml": MOTOR, "map.csv": changed}
    abuse(files, ["motor", "import", "map.csv", *IMPORT], [f"o/{name}" for name in IMPORTED])


@ABUSED
@given(st.data(), st.sampled_from(["map.npz", "map.mat"]), st.sampled_from(["arrays", "syre", "motulator", "pyleecan"]))
def test_imported_arrays(data: st.DataObject, name: str, kind: str) -> None:
    good = bytearray((npz if name.endswith("npz") else mat)())
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(LINES) % len(good)
        good[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=6))
    files: dict[str, str | bytes] = {"m/motor.toml": MOTOR, name: bytes(good)}
    options = ["--format", kind, "--motor", "m/motor.toml", "--out", "o"]
    abuse(files, ["motor", "import", name, *options], [f"o/{file}" for file in IMPORTED])


COMMANDS = (
    ("sim",), ("campaign",), ("faults",), ("motor", "check"), ("motor", "build"), ("motor", "import"),
    ("motor", "start"), ("emulate",), ("vecu",), ("fuzz",), ("live",), ("log",), ("a2l",), ("bench",), ("demo",),
    ("target", "registers"), ("target", "seal"), ("target", "size"),
)  # fmt: skip
NEEDED = {("sim",): ["in.toml"], ("campaign",): ["in.toml"], ("faults",): ["in.toml"], ("motor", "check"): ["m"],
          ("motor", "build"): ["m"], ("motor", "import"): ["m/flux_map.csv", *IMPORT],
          ("target", "seal"): ["in.toml"], ("log",): ["in.toml"], ("a2l",): ["in.toml"]}  # fmt: skip
NOT_RUN = {"--check", "--update", "--scheduler", "--can-interface"}  # would run for minutes or need a network


def options(name: tuple[str, ...]) -> list[str]:
    """Every option of a command."""
    import click

    command: click.Command = cli.main
    for part in name:
        assert isinstance(command, click.Group)
        found = command.get_command(click.Context(command), part)
        assert found is not None
        command = found
    opts = [opt for param in command.params if isinstance(param, click.Option) for opt in param.opts]
    return [opt for opt in opts if opt not in NOT_RUN]


@pytest.mark.parametrize("name", COMMANDS, ids=" ".join)
def test_command_lines(name: tuple[str, ...]) -> None:
    known = [*options(name), "--nonsense", "-x"]
    words = st.sampled_from(known) | st.sampled_from(ODD_PATHS) | st.sampled_from(("1", "-1", "x", "1e9", "in.toml"))

    files: dict[str, str | bytes] = {"in.toml": {"campaign": CAMPAIGN, "faults": FAULTS}.get(name[0], SCENARIO)}
    files |= {"fmea.csv": FMEA, "m/motor.toml": MOTOR, "m/flux_map.csv": MAP}
    # Half of the command lines have valid inputs and one option with an odd value, the rest any words.
    pairs = st.tuples(st.sampled_from(options(name) or ["-x"]), st.sampled_from(ODD_PATHS))

    @ABUSED
    @given(pairs.map(lambda pair: [*NEEDED.get(name, ()), *pair]) | st.lists(words, min_size=1, max_size=6))
    def lines(arguments: list[str]) -> None:
        abuse(files, [*name, *arguments], [])

    lines()
