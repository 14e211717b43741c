# SPDX-License-Identifier: Apache-2.0
"""`fluxtrue log` reads a recorded drive without loss: signals, table, plot."""

from decimal import Decimal
from pathlib import Path

import can
import numpy as np
import pandas as pd
import pytest
from asammdf import MDF, Signal
from click.testing import CliRunner, Result

from fluxtrue_tools.bus.interface import Interface, read_interface
from fluxtrue_tools.bus.scales import dbc_of, standard_factors
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.replay import load
from fluxtrue_tools.log.cli import log
from fluxtrue_tools.log.decode import signals_of
from fluxtrue_tools.log.recording import read_recording
from fluxtrue_tools.vecu.mdf import BusLog

STATUS = {"Crc": 0, "Counter": 0, "State": 4, "TorqueEstimated": 0.0, "TorqueCommanded": 40.0, "Speed": 2000.0}


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Half a second: the estimate rises to 40 N·m; one frame has an identifier not in the DBC, one is too short."""
    message = read_interface().message("INV_Status")
    recorder = BusLog()
    for k in range(50):
        data = message.encode(STATUS | {"TorqueEstimated": min(k, 40)})
        recorder(can.Message(timestamp=7.0 + 0.01 * k, arbitration_id=0x210, data=data, is_extended_id=False))
    recorder(can.Message(timestamp=7.5, arbitration_id=0x7FF, data=b"12345678", is_extended_id=False))
    recorder(can.Message(timestamp=7.5, arbitration_id=0x210, data=b"123", is_extended_id=False))
    path = tmp_path_factory.mktemp("log") / "drive.mf4"
    recorder.write(path, read_interface())
    return path


def _recording(path: Path, interface: Interface, told: int) -> Path:
    """One frame with 2.5 N·m and one with the inverter's hash, beside the DBC."""
    recorder = BusLog()
    values = {
        "INV_Status": STATUS | {"TorqueEstimated": 2.5},
        "INV_Configuration": {"MotorCheck": 0, "InterfaceHash": told},
    }
    for name, signals in values.items():
        message = interface.message(name)
        recorder(can.Message(timestamp=1.0, arbitration_id=message.frame_id, data=message.encode(signals),
                             is_extended_id=False))  # fmt: skip
    recorder.write(path, interface)
    return path


def _servo() -> Interface:
    return Interface("servo", dbc_of(standard_factors() | {"torque_Nm": Decimal("0.002")}))


def test_a_recording_is_read_in_the_scale_of_the_dbc_that_is_attached_to_it(tmp_path: Path) -> None:
    servo = _servo()
    path = _recording(tmp_path / "servo.mf4", servo, servo.hash)
    assert signals_of(path)["INV_Status.TorqueEstimated"].iloc[0] == pytest.approx(2.5)
    assert read_recording(path).interface.hash == servo.hash != read_interface().hash


def test_a_recording_with_the_dbc_of_another_motor_is_refused(tmp_path: Path) -> None:
    path = _recording(tmp_path / "wrong.mf4", _servo(), read_interface().hash)
    with pytest.raises(
        FluxtrueError, match=r"fluxtrue\.dbc in wrong\.mf4 \(interface hash .*does not describe this inv"
    ):
        signals_of(path)


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(log, [str(argument) for argument in arguments], catch_exceptions=True)


def test_every_signal_comes_back_with_its_time(drive: Path) -> None:
    estimate = signals_of(drive)["INV_Status.TorqueEstimated"]
    assert list(estimate) == [float(min(k, 40)) for k in range(50)]
    assert list(estimate.index) == pytest.approx([0.01 * k for k in range(50)])


def test_the_command_tells_plots_and_exports(drive: Path, tmp_path: Path) -> None:
    done = _run(drive, "--plot", tmp_path / "p.png", "--export", tmp_path / "t.csv")
    assert done.exit_code == 0, done.output
    row = next(line for line in done.output.splitlines() if line.startswith("INV_Status.TorqueEstimated"))
    assert row.split()[1:] == ["50", "0", "40", "40", "Nm"]
    assert (tmp_path / "p.png").stat().st_size > 10000
    table = pd.read_csv(tmp_path / "t.csv")
    assert len(table) == 50 and table["INV_Status.Speed"].iloc[-1] == 2000.0


def test_one_signal_can_be_chosen_and_written_as_parquet(drive: Path, tmp_path: Path) -> None:
    assert _run(drive, "--signal", "INV_Status.Speed", "--export", tmp_path / "t.parquet").exit_code == 0
    assert list(pd.read_parquet(tmp_path / "t.parquet").columns) == ["INV_Status.Speed"]


@pytest.mark.parametrize(("options", "wanted"), [
    (("--signal", "INV_Status.Power"), "INV_Status.Power: not in this file"),
    (("--plot", "p.bmp"), "allowed: a file ending in .png"),
    (("--export", "t.xlsx"), "allowed: a file ending in .csv"),
    (("--export", "no/such/folder/t.csv"), "t.csv: cannot be written (no folder "),
])  # fmt: skip
def test_bad_options_are_refused_by_name(drive: Path, options: tuple[str, ...], wanted: str) -> None:
    done = _run(drive, *options)
    assert done.exit_code != 0 and wanted in str(done.exception)


@pytest.mark.parametrize("content", [None, b"", b"not a log", b"MDF     4.10    "])
def test_a_file_that_is_no_log_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "bad.mf4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FluxtrueError, match="bad.mf4"):
        signals_of(path)


def test_a_recording_of_something_else_under_that_name_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.mf4"
    with MDF(version="4.10") as recorded:
        recorded.append(Signal(name="CAN_DataFrame", samples=np.arange(5.0), timestamps=np.arange(5.0)))
        recorded.save(path)
    with pytest.raises(FluxtrueError, match=r"other.mf4: not an MDF4 bus log \(no CAN_DataFrame.DataBytes\)"):
        signals_of(path)


def test_frames_of_several_buses_come_in_the_order_of_their_times(tmp_path: Path) -> None:
    with MDF(version="4.10") as both:
        for first_s in (0.01, 0.0):
            recorder, one = BusLog(), tmp_path / "one.mf4"
            for k in range(5):
                recorder(can.Message(timestamp=first_s + 0.02 * k, arbitration_id=k, data=bytes([k])))
            recorder.write(one)
            with MDF(one) as bus:
                both.append(bus.get("CAN_DataFrame"))
        both.save(tmp_path / "both.mf4")
    found = read_recording(tmp_path / "both.mf4")
    assert list(found.time_s) == pytest.approx([0.01 * k for k in range(10)])
    assert list(found.ids) == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4] and found.data.shape == (10, 8)
    played = load(tmp_path / "both.mf4")
    assert played.times_s == pytest.approx(list(found.time_s))
    assert [frame.data for frame in played.frames] == [bytes([k]) for k in found.ids]
