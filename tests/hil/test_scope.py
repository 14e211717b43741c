# SPDX-License-Identifier: Apache-2.0
"""The scope, over XCP: what it captures is what the plant did, period by period."""

import os
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest
from asammdf import MDF
from click.testing import CliRunner
from numpy.typing import NDArray
from report import Figures
from rig import MS, Rig

from fluxtrue_tools.a2l.cli import ANSWER_ID
from fluxtrue_tools.a2l.elf import Description
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope import export
from fluxtrue_tools.scope.cli import scope as command
from fluxtrue_tools.scope.scope import Capture, Scope
from fluxtrue_tools.scope.xcp import SET_MTA, UPLOAD, XcpMaster

ANSWER_MS = 50
TIME, TRUTH = "truth.time_s", ("truth.i_d_A", "truth.i_q_A", "truth.vdc_V")
CURRENTS = ["i_d_A", "i_q_A"]
NOISE_A = 0.5  # two and a half steps of the converter
SHARE = 0.25


class RigLine:
    """XCP frames beside the cyclic commands, in the rig's time."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.damage: Callable[[bytes, bytes], bytes] = lambda _, answer: answer

    def exchange(self, frame: can.Message) -> bytes:
        """One command and its answer."""
        taken = len(self._rig.others[ANSWER_ID])
        self._rig.send(frame.arbitration_id, bytes(frame.data))
        for _ in range(ANSWER_MS):
            self._rig.advance(MS)
            if len(self._rig.others[ANSWER_ID]) > taken:
                return self.damage(bytes(frame.data), self._rig.others[ANSWER_ID][taken].data)
        raise AssertionError("no answer")

    def pass_time(self, seconds: float) -> None:
        """Let simulated time pass."""
        self._rig.advance(seconds)


@pytest.fixture
def line(rig: Rig) -> RigLine:
    return RigLine(rig)


@pytest.fixture
def scope(line: RigLine, description: Description) -> Scope:
    return Scope(XcpMaster(line), description)


def distance(capture: Capture, truth: NDArray[np.float64], begin: int) -> float:
    """The largest difference of a current from the plant's, if the first sample is of this recorded period."""
    count = len(capture.time_s)
    measured = np.column_stack([capture.columns[name] for name in CURRENTS])
    return float(np.abs(measured - truth[begin : begin + count]).max())


def place(capture: Capture, truth: NDArray[np.float64]) -> tuple[int, float]:
    """Where in the plant's recording the capture is, by the currents themselves, and how far they are apart there."""
    begins = range(len(truth) - len(capture.time_s) + 1)
    begin = min(begins, key=lambda k: distance(capture, truth, k))
    return begin, distance(capture, truth, begin)


@pytest.mark.plant
def test_a_torque_step_is_captured_as_the_plant_made_it(
    rig: Rig, scope: Scope, figures: Figures, tmp_path: Path
) -> None:
    rig.turn(2000.0)
    rig.start(0.0)
    rig.advance(0.3)
    scope.configure([*CURRENTS, "v_dc_V", "i_q_ref_A"], "rising", "i_q_A", 40.0, SHARE, 400)
    armed = scope.arm()
    trace = rig.record([TIME, *TRUTH], 1)
    rig.advance(0.05)
    assert scope.status().state == "armed"
    rig.ask(torque_Nm=60.0)
    status = scope.until_complete(1.0)
    rig.record([])
    capture = scope.read()
    assert status.state == "done" and status.number == armed.number and scope.status().state == "idle"
    assert len(capture.time_s) == 400 and capture.trigger == 100
    assert np.allclose(np.diff(capture.time_s), 1e-4) and capture.time_s[100] == 0.0
    assert capture.columns["i_q_A"][99] < 40.0 <= capture.columns["i_q_A"][100]

    truth = np.column_stack([trace[name] for name in TRUTH])
    begin, apart_A = place(capture, truth[:, :2])
    figures.plot("Torque step, captured in every PWM period", [("i_q, A", [
        ("captured", capture.time_s, capture.columns["i_q_A"]),
        ("plant", capture.time_s, truth[begin : begin + 400, 1]),
    ])])  # fmt: skip
    figures.promise("captured currents less the plant's", apart_A, NOISE_A, "A")
    assert distance(capture, truth[:, :2], begin + 1) > 1.5 * apart_A, "the step tells one period from the next"
    assert np.abs(capture.columns["v_dc_V"] - truth[begin : begin + 400, 2]).max() < 5.0
    # In steady state the current is at its reference; the reference is constant within a step of the task.
    assert capture.columns["i_q_A"][-100:].mean() == pytest.approx(capture.columns["i_q_ref_A"][-1], abs=0.5)
    # A period that ends while the task is about to copy belongs to the one or the other step.
    changes = np.flatnonzero(np.diff(capture.columns["i_q_ref_A"]))
    assert len(changes) > 5 and np.abs((np.diff(changes) + 1) % 10 - 1).max() <= 1
    expect_exports(capture, tmp_path)


def expect_exports(capture: Capture, folder: Path) -> None:
    """What was written, read back, is the capture."""
    export.write_csv(capture, folder / "step.csv")
    export.write_mdf(capture, folder / "step.mf4")
    table = np.genfromtxt(folder / "step.csv", delimiter=",", names=True)
    assert np.allclose(table["time_s"], capture.time_s, atol=1e-9)
    with MDF(folder / "step.mf4") as mdf:
        for name, column in capture.columns.items():
            assert np.allclose(table[name], column, rtol=1e-8)
            signal = mdf.get(name)
            assert np.array_equal(signal.samples, column) and signal.unit == capture.units[name]
            assert np.allclose(signal.timestamps, capture.time_s - capture.time_s[0], atol=1e-12)


@pytest.mark.plant
def test_a_fault_leaves_the_periods_around_it(rig: Rig, scope: Scope) -> None:
    rig.turn(3000.0)
    rig.start(80.0)
    rig.advance(0.3)
    rig.expected.faults = True
    trace = rig.record([TIME, *TRUTH], 1)
    rig.advance(0.02)
    rig.stand.set(board_gate_fault=1.0)
    rig.advance(0.02)
    rig.record([])
    assert scope.status().is_freeze_frame
    with pytest.raises(FluxtrueError, match="in use"):
        scope.configure(CURRENTS)
        scope.arm()
    frame = scope.read(release=False)
    assert frame.is_freeze_frame and frame.trigger == 32 and len(frame.time_s) == 64
    _, apart_A = place(frame, np.column_stack([trace[name] for name in TRUTH[:2]]))
    assert apart_A < NOISE_A
    # Torque until the fault, none at the end.
    assert frame.columns["i_q_A"][:32].mean() > 50.0 and abs(frame.columns["i_q_A"][-1]) < NOISE_A
    scope.stop()
    rig.stand.set(board_gate_fault=0.0)


@pytest.mark.plant
def test_what_is_not_complete_cannot_be_read_and_a_bad_set_up_is_refused(scope: Scope) -> None:
    scope.configure(CURRENTS, "above", "i_q_A", 390.0)
    scope.arm()
    with pytest.raises(FluxtrueError, match="the scope is armed: there is no capture to read"):
        scope.read()
    with pytest.raises(FluxtrueError, match="no complete capture within 0.1 s"):
        scope.until_complete(0.1)
    with pytest.raises(FluxtrueError, match="the scope is in use .armed."):
        scope.arm()
    scope.stop()
    with pytest.raises(FluxtrueError, match="the scope is idle"):
        scope.read()
    for wrong, why in (
        ({"signals": []}, "0 signals"), ({"signals": ["i_d_A"] * 9}, "9 signals"),
        ({"signals": ["i_x"]}, "no signal 'i_x'"), ({"samples": 3073}, "3073 samples"),
        ({"before": 1.0}, "share 1 before"), ({"divisor": 0}, "divisor 0"), ({"trigger": "sometimes"}, "trigger"),
        ({"trigger": "rising", "level": 1e6}, "level 1e.06"), ({"trigger": "rising", "level": float("nan")}, "level"),
    ):  # fmt: skip
        with pytest.raises(FluxtrueError, match=why):
            scope.configure(**({"signals": CURRENTS} | wrong))  # type: ignore[arg-type]


@pytest.mark.plant
def test_a_capture_with_the_settings_of_another_tool_is_ended(
    line: RigLine, scope: Scope, description: Description
) -> None:
    scope.configure(CURRENTS, samples=50)
    Scope(XcpMaster(line), description).configure(CURRENTS, samples=60)
    with pytest.raises(FluxtrueError, match="another XCP master has changed what the scope captures"):
        scope.arm()
    assert scope.status().state == "idle"
    scope.configure(CURRENTS, samples=50)
    assert scope.arm().state == "armed"
    scope.stop()


@pytest.mark.plant
def test_a_block_that_was_damaged_on_the_way_is_read_again(
    line: RigLine, scope: Scope, description: Description
) -> None:
    scope.configure(CURRENTS, samples=50)
    scope.arm()
    scope.pass_periods(60)
    scope.trigger()
    scope.until_complete(1.0)
    whole = scope.read(release=False)
    memory = next(value.address for value in description.scope if value.name == "scope_memory")
    here, left = [False], [1]

    def damage(sent: bytes, answer: bytes) -> bytes:
        if sent[0] == SET_MTA:
            here[0] = int.from_bytes(sent[4:8], "little") == memory
        if sent[0] != UPLOAD or not here[0] or left[0] == 0:
            return answer
        left[0] -= 1
        return answer[:3] + bytes([answer[3] ^ 4]) + answer[4:]

    line.damage = damage
    again = scope.read(release=False)
    assert left[0] == 0 and np.array_equal(again.columns["i_q_A"], whole.columns["i_q_A"])
    left[0] = 1000
    with pytest.raises(FluxtrueError, match="another checksum in the ECU, 3 times"):
        scope.read()
    scope.stop()


@pytest.mark.program
def test_the_command_warns_once_of_samples_that_the_inverter_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The counter is set in what the tool reads: the virtual ECU loses none."""
    log, header = tmp_path / "a.mf4", Scope._header
    warning = "the inverter lost samples 2 times"
    code, said = run("--signal", "i_d_A", "--samples", "60", "--mdf", str(log))
    assert code == 0 and warning not in said
    with MDF(log) as mdf:
        assert warning not in mdf.groups[0].channel_group.comment
    monkeypatch.setattr(Scope, "_header", lambda scope: header(scope) | {"lost": 2})
    code, said = run("--signal", "i_d_A", "--samples", "60", "--mdf", str(log))
    assert code == 0 and said.count(warning) == 1
    with MDF(log) as mdf:
        assert warning in mdf.groups[0].channel_group.comment


@pytest.mark.plant
def test_a_capture_changes_no_duty(rig: Rig, description: Description) -> None:
    def drive(capture: bool) -> str:
        rig.power_cycle(seed=3)
        rig.turn(2000.0)
        rig.start(40.0)
        begun_s = rig.now_s
        if capture:
            scope = Scope(XcpMaster(RigLine(rig)), description)
            scope.configure(["i_d_A", "i_q_A", "u_d_V", "u_q_V"], "above", "i_q_A", 20.0, samples=200)
            scope.arm()
            scope.until_complete(0.2)
            scope.read()
        rig.advance(2.0 - (rig.now_s - begun_s))
        return rig.stand.duty_hash()

    quiet = drive(False)
    assert drive(True) == quiet


def run(*arguments: str) -> tuple[int, str]:
    """`tools/fluxtrue scope` on a virtual ECU of its own: exit code, and what it prints."""
    done = CliRunner().invoke(command, ["--build-dir", os.environ["FLUXTRUE_BUILD_DIR"], *arguments])
    return done.exit_code, done.output + (str(done.exception) if done.exception is not None else "")


@pytest.mark.program
def test_the_command_writes_the_same_samples_as_csv_and_mdf4(tmp_path: Path) -> None:
    text, log, picture = tmp_path / "a.csv", tmp_path / "a.mf4", tmp_path / "a.png"
    code, said = run("--signal", "i_d_A", "--signal", "v_dc_V", "--samples", "60", "--divisor", "3", "--before", "0.5",
                     "--csv", str(text), "--mdf", str(log), "--plot", str(picture))  # fmt: skip
    assert code == 0 and "60 samples, 30 before the trigger" in said
    table = np.genfromtxt(text, delimiter=",", names=True)
    assert table.dtype.names == ("time_s", "i_d_A", "v_dc_V")
    assert np.allclose(np.diff(table["time_s"]), 3e-4) and table["time_s"][30] == 0.0
    assert np.abs(table["i_d_A"]).max() < NOISE_A, "switching is disabled"
    with MDF(log) as mdf:
        for name in ("i_d_A", "v_dc_V"):
            assert np.allclose(mdf.get(name).samples, table[name], rtol=1e-8)
    assert picture.stat().st_size > 1000


@pytest.mark.program
@pytest.mark.parametrize(("arguments", "why"), [
    (["--signal", "i_x"], "no signal 'i_x', allowed: i_d_A, "),
    (["--signal", "i_d_A", "--samples", "6145"], "6145 samples, allowed with 1 signal: 1 to 6144"),
    (["--trigger", "above", "--level", "9999"], "level 9999 A of i_d_A"),
    (["--trigger", "above", "--level", "390", "--wait", "0.05"],
     "no complete capture within 0.05 s (the scope is armed: the trigger has not come)"),
    (["--level", "3"], "with --trigger manual"),
    (["--freeze-frame"], "the scope is idle: there is no capture to read"),
    (["--freeze-frame", "--samples", "3"], "with --freeze-frame"),
    (["--bench", "127.0.0.1:1"], "without --can-interface"),
    (["--csv", "a.txt"], "a.txt"),
])  # fmt: skip
def test_bad_input_gives_one_clear_message(arguments: list[str], why: str) -> None:
    code, said = run(*arguments)
    assert code != 0 and why in said, said


@pytest.mark.program
def test_the_list_names_every_signal(description: Description) -> None:
    code, said = run("--list")
    assert code == 0 and [line.split()[0] for line in said.splitlines()] == [s.name for s in description.signals]
