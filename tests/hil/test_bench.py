# SPDX-License-Identifier: Apache-2.0
"""The suite as on a bench: with a given interface, without a plant that can be commanded, on the wall clock."""

import os
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import can
import cantools.database
import pytest
from progress import HANG_S
from rig import COMMAND, STATUS, Rig

from fluxtrue_tools.bus.scales import dbc_of, standard_factors
from fluxtrue_tools.vecu.process import HOST, VirtualEcu

pytestmark = pytest.mark.program
HERE = Path(__file__).parent


def suite(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-rs", "-c", str(HERE.parent / "pytest.ini"),
               "-p", "no:cacheprovider", *arguments]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, env=os.environ, check=False)


def over(ecu: VirtualEcu, *more: str) -> list[str]:
    return ["--can-interface=socketcand", "--can-channel=can0", f"--can-option=host={HOST}",
            f"--can-option=port={ecu.can_port}", "--can-option=tcp_tune=1", *more]  # fmt: skip


def test_without_a_plant_the_rest_of_the_suite_runs_and_says_what_it_left_out(program: Path, tmp_path: Path) -> None:
    # The bench channel only advances time: on the wall clock a computer that stalls for 30 ms would lose a command.
    with VirtualEcu(program) as ecu:
        done = suite(str(HERE / "test_boot.py"), f"--report={tmp_path}", f"--junitxml={tmp_path}/junit.xml",
                     *over(ecu, f"--clock={HOST}:{ecu.bench_port}"))  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "needs plant control, and this bench has none (--bench)" in done.stdout
    assert "3 passed, 3 skipped" in done.stdout
    assert (tmp_path / "report.html").is_file() and (tmp_path / "bus.mf4").is_file()
    assert (tmp_path / "junit.xml").is_file()


def test_without_any_bench_channel_time_is_the_wall_clock_s(database: cantools.database.Database) -> None:
    """On a bus without a virtual ECU: only that time passes is tested, not how fast this computer is."""
    with can.Bus(interface="virtual", channel="wall") as ours, can.Bus(interface="virtual", channel="wall") as other:
        rig = Rig(ours, database, None)
        status = rig.by_name[STATUS]
        other.send(can.Message(arbitration_id=status.frame_id, data=bytes(status.length), is_extended_id=False))
        begin_s = rig.now_s
        rig.advance(0.05)
        assert rig.now_s - begin_s >= 0.05
        assert rig.counted[STATUS] == 1
        sent = other.recv(0.0)
    assert sent is not None and sent.arbitration_id == rig.by_name[COMMAND].frame_id


def test_on_a_bench_nothing_is_switched_on_unless_that_was_allowed(program: Path, tmp_path: Path) -> None:
    one = f"{HERE}/test_states.py::test_enable_with_a_torque_request_is_refused"
    with VirtualEcu(program) as ecu:
        bench = over(ecu, f"--bench={HOST}:{ecu.bench_port}", f"--report={tmp_path}")
        without_power, allowed = suite(one, *bench), suite(one, *bench, "--allow-power")
    assert "only with --allow-power" in without_power.stdout and "1 skipped" in without_power.stdout
    assert "1 passed" in allowed.stdout, "also for a client that comes when the ECU has been running for a while"


def test_with_a_bench_channel_the_same_tests_run_as_with_the_suites_own_target(program: Path, tmp_path: Path) -> None:
    with VirtualEcu(program) as ecu:
        bench = f"--bench={HOST}:{ecu.bench_port}"
        done = suite(str(HERE / "test_boot.py"), f"--report={tmp_path}", *over(ecu, bench))
    assert done.returncode == 0, done.stdout
    assert "skipped" not in done.stdout


def test_an_inverter_of_another_scale_is_not_tested(program: Path, tmp_path: Path) -> None:
    dbc = tmp_path / "truck.dbc"
    dbc.write_text(dbc_of(standard_factors() | {"torque_Nm": Decimal("0.2")}))
    with VirtualEcu(program) as ecu:
        bench = over(ecu, f"--bench={HOST}:{ecu.bench_port}", f"--dbc={dbc}", f"--report={tmp_path}")
        done = suite(str(HERE / "test_boot.py"), *bench)
    said = done.stdout + done.stderr
    assert done.returncode == 2, said
    assert f"error: {dbc} (interface hash 0x" in said and "does not describe this inverter" in said


def test_without_any_target_it_says_what_it_wants(tmp_path: Path) -> None:
    done = suite(str(HERE / "test_boot.py"), f"--report={tmp_path}")
    assert done.returncode == 2
    assert "no target: give --vecu=PATH, or --can-interface and --can-channel" in done.stdout + done.stderr


@pytest.mark.parametrize(("arguments", "wanted"), [
    (("--can-interface=nonsense",), 'error: --can-interface nonsense, --can-channel can0: Unknown interface type'),
    (("--can-interface=socketcand",), "error: --can-interface socketcand: missing: --can-option host="),
    (("--can-interface=kvaser", "--can-channel=0"), "error: --can-interface kvaser, --can-channel 0: "),
    (("--can-interface=virtual", "--can-option=bitrate"), "error: --can-option bitrate: allowed: NAME=VALUE"),
    (("--can-interface=virtual", "--bench=here"), "error: --bench here: allowed: HOST:PORT"),
    (("--can-interface=virtual", "--clock=:1"), "error: --clock :1: allowed: HOST:PORT"),
    (("--can-interface=virtual", "--bench=127.0.0.1:1"), "error: bench channel 127.0.0.1:1: "),
    (("--vecu=/nowhere",), "error: virtual ECU /nowhere: No such file or directory"),
])  # fmt: skip
def test_a_target_that_is_not_there_is_one_clear_message(
    tmp_path: Path, arguments: tuple[str, ...], wanted: str
) -> None:
    done = suite(str(HERE / "test_boot.py"), f"--report={tmp_path}", *arguments)
    assert done.returncode == 2
    said = done.stdout + done.stderr
    assert wanted in said and "Traceback" not in said and len(said.splitlines()) < 10, said
