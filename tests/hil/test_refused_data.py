# SPDX-License-Identifier: Apache-2.0
"""Motor data that the drive refuses: the bus, XCP and the virtual ECU say which check failed."""

import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cantools.database
import health
import pytest
from damage import BAD_FLUX, BAD_REFERENCE, damaged
from rig import Rig
from xcp_master import Master

from fluxtrue_tools.a2l.elf import Description, read
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import connect

CONFIG = "INV_Configuration"
DAMAGE = {"flux_table_value": BAD_FLUX, "reference_table_value": BAD_REFERENCE}

pytestmark = pytest.mark.program


@pytest.fixture(params=DAMAGE)
def refused(request: pytest.FixtureRequest, program: Path, tmp_path: Path) -> tuple[Path, str]:
    """A program whose motor data fail a check, and that check's name."""
    return damaged(program, tmp_path / "refused", *DAMAGE[request.param]), request.param


@pytest.fixture
def rig_of(refused: tuple[Path, str], database: cantools.database.Database) -> Iterator[Rig]:
    """The bus of that program, 0.3 s after its start."""
    with VirtualEcu(refused[0]) as ecu:
        bus, stand = connect(ecu.can_port), Channel(HOST, ecu.bench_port)
        rig = Rig(bus, database, stand)
        rig.advance(0.3)
        yield rig
        stand.close()
        bus.shutdown()


def test_the_bus_names_the_check_that_failed_while_the_fault_stands(rig_of: Rig, refused: tuple[Path, str]) -> None:
    signal = rig_of.by_name[CONFIG].get_signal_by_name("MotorCheck")
    assert rig_of.state == "fault"
    assert str(signal.choices[int(rig_of.signal(CONFIG, "MotorCheck"))]) == refused[1]
    assert f"{refused[1]}: " in signal.comment
    rig_of.ask(reset=True)  # changes nothing, because the data stay wrong
    sent = rig_of.counted[CONFIG]
    rig_of.advance(1.0)
    assert rig_of.counted[CONFIG] - sent == 10
    assert rig_of.state == "fault"
    assert str(signal.choices[int(rig_of.signal(CONFIG, "MotorCheck"))]) == refused[1]


def test_what_is_said_after_a_test_names_fault_and_check(rig_of: Rig, refused: tuple[Path, str]) -> None:
    said = health.problems(rig_of, {"counters": {}, "hub": rig_of.stand.counters()})
    assert said[0] == "DriveFaults: config"
    assert said[1].startswith(f"motor data refused: {refused[1]}: A ")


def test_xcp_and_the_freeze_frame_have_the_same_word(rig_of: Rig, refused: tuple[Path, str]) -> None:
    description: Description = read(refused[0])
    words = {word.value: word.name for word in description.words if word.base == "MOTOR_CHECK"}
    frozen = {value.name: value for value in description.frozen}["freeze_motor_check"]
    described = replace(description, measurements=(*description.measurements, frozen))
    master = Master(rig_of, described)
    for name in ("motor_check", "freeze_motor_check"):
        assert words[int(master.measurement(name))] == refused[1]


def test_the_virtual_ecu_says_it_when_it_starts(refused: tuple[Path, str]) -> None:
    command = [str(refused[0]), "--fast", "--port", "0", "--bench-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(f"motor data refused: {refused[1]}: A ")
        process.terminate()


def test_data_that_pass_are_told_as_ok(rig: Rig) -> None:
    signal = rig.by_name[CONFIG].get_signal_by_name("MotorCheck")
    assert str(signal.choices[int(rig.signal(CONFIG, "MotorCheck"))]) == "ok"
