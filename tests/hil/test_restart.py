# SPDX-License-Identifier: Apache-2.0
"""The virtual ECU's flash in a file: a new process has the values identified by the previous one."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import cantools.database
import pytest
from rig import Rig

from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import connect

FLASH_BYTES = 4096
IDENTIFIED = ("psi_f_Vs", "lq_scale", "ld_scale")

pytestmark = pytest.mark.program


def test_a_second_process_starts_with_what_the_first_has_identified(
    make_vecu: Callable[..., VirtualEcu], database: cantools.database.Database, tmp_path: Path
) -> None:
    flash = tmp_path / "flash.bin"
    with make_vecu(nvm=flash) as ecu:
        bus = connect(ecu.can_port)
        rig = Rig(bus, database, Channel(HOST, ecu.bench_port))
        rig.wait_for("standby")
        rig.stand.set(magnet_scale=0.88)
        rig.start()
        rig.warm_up(15.0)
        assert not flash.exists()  # the file is not written while switching is enabled
        rig.ask(enable=False, mode="off", torque_Nm=0.0)
        rig.turn(0.0, 1.0)
        rig.advance(0.5)
        before = rig.stand.get(*IDENTIFIED)
        bus.shutdown()
    assert flash.stat().st_size == FLASH_BYTES
    with make_vecu(nvm=flash) as ecu:
        stand = Channel(HOST, ecu.bench_port)
        assert stand.get("memory_recalled") == [1.0]
        stand.run(5.0)
        # The flux is on the bus after 1 ms. While switching is disabled, only the leak changes it.
        assert stand.get(*IDENTIFIED) == pytest.approx(before, rel=2e-3)
        assert before[0] < 0.94 * 0.0717
        stand.close()


def test_a_file_that_is_no_flash_is_refused_with_its_name(program: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.bin"
    wrong.write_bytes(bytes(FLASH_BYTES - 1))
    command = [program, "--port", "0", "--bench-port", "0", "--nvm", wrong]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert result.stderr == f"error: --nvm {wrong}: no flash contents, allowed: a file of 4096 bytes, or none yet\n"
    assert wrong.stat().st_size == FLASH_BYTES - 1
