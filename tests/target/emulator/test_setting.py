# SPDX-License-Identifier: Apache-2.0
"""What is set by name reaches the image's memory, and nothing else in it changes, whatever the image has written
meanwhile."""

import struct
from collections.abc import Iterator

import pytest

from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import library
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.emulate.preempt import TASK
from fluxtrue_tools.sim.library import Loop

REQUEST, MODULATE, COMPLEMENTS, FIRST = 0, 1, 2, 4  # parts of layout.h; FIRST: the first of the parameters
DEAD_TIME = 16  # offset in modulate_config_t
LIMITS, ENABLE = 12, 20  # offsets in request_t
INSIDE = 1000  # instructions of the task


def address(core: Core, parts: Parts, part: int) -> int:
    """Where a part of the drive lies in the image's memory."""
    offset: int = struct.unpack_from("<I", parts.layout.read_bytes(), 8 * part)[0]
    return core.symbol("ecu") + offset


class DeadTime:
    """The dead time in the image's memory and its complement, which the task writes one after the other."""

    def __init__(self, core: Core, parts: Parts) -> None:
        self._core = core
        places = [address(core, parts, part) for part in range(FIRST + 1)]
        self._live = places[MODULATE] + DEAD_TIME
        self._complement = self._live + places[COMPLEMENTS] - places[FIRST]
        assert self.words == (self.words[0], ~self.words[0])

    @property
    def words(self) -> tuple[int, int]:
        """The word and its complement, as signed numbers."""
        word, complement = (struct.unpack("<i", self._core.read(at, 4))[0] for at in (self._live, self._complement))
        return word, complement

    def write(self, value: int) -> None:
        """The first of the task's two stores."""
        self._core.write(self._live, struct.pack("<i", value))

    def accept(self, value: int) -> None:
        """The second one."""
        self._core.write(self._complement, struct.pack("<i", ~value))


def run_into_task(loop: Loop, core: Core) -> None:
    """Run until a period ends within the task: what is set then waits for the end of the next one."""
    core.on_exception(lambda vector, entered: core.break_after(INSIDE) if vector == TASK and entered else None)
    for _ in range(20):
        loop.run(1)
        if core.active_vector == TASK:
            break
    assert core.active_vector == TASK
    core.on_exception(lambda *_: None)


@pytest.fixture
def drive(parts: Parts) -> Iterator[Loop]:
    """A drive that switches at 3000 rpm and does not trim the dead time itself; every instruction is counted."""
    motor = parts.emulated(library.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        for name, value in (("trim", 0), ("torque_loop", 1), ("identification", 1), ("enable", 1)):
            loop.set(name, value)
        loop.run(1000)
        yield loop


@pytest.mark.parametrize("stores_before", [0, 1, 2])
def test_what_the_task_writes_while_something_set_is_waiting_stays(
    drive: Loop, parts: Parts, stores_before: int
) -> None:
    core = Stand(drive).core
    dead_time = DeadTime(core, parts)
    value = dead_time.words[0] - 2
    stores = [dead_time.write, dead_time.accept]
    run_into_task(drive, core)
    for store in stores[:stores_before]:
        store(value)
    drive.set("torque_requested_Nm", 20)
    for store in stores[stores_before:]:
        store(value)
    drive.run(300)  # every word is checked at least once
    assert dead_time.words == (value, ~value)
    assert drive.get("fault_word") == 0
    assert drive.get("truth.torque_Nm") == pytest.approx(20, abs=3)


def test_what_is_set_before_and_while_the_task_runs_reaches_the_image(drive: Loop) -> None:
    """The flags of the request have a check word of their own, which the host renews."""
    core = Stand(drive).core
    run_into_task(drive, core)
    for name, value in (("torque_requested_Nm", 30), ("torque_loop", 0), ("torque_loop", 1), ("identification", 0)):
        drive.set(name, value)
    drive.run(300)
    assert drive.get("truth.torque_Nm") == pytest.approx(30, abs=3)
    run_into_task(drive, core)
    drive.set("enable", 0)
    drive.run(30)
    assert core.outputs == 0
    drive.set("enable", 1)
    drive.set("current_mode", 1)
    drive.run(300)
    assert core.outputs == 0x3F
    assert drive.get("truth.torque_Nm") == pytest.approx(0, abs=3)
    assert drive.get("fault_word") == 0


@pytest.mark.parametrize(
    ("found", "by_the_image", "wanted"),
    [(0x00FE, 0x0100, 0x00FC), (2, -2, 4)],
    ids=["bytes", "half words"],
)
def test_a_word_that_both_have_changed_is_not_mixed(
    drive: Loop, parts: Parts, found: int, by_the_image: int, wanted: int
) -> None:
    """The host's values differ in a part of the word only, the image's in more."""
    core = Stand(drive).core
    dead_time = DeadTime(core, parts)
    nominal = dead_time.words[0]
    run_into_task(drive, core)
    dead_time.write(found)
    dead_time.accept(found)
    drive.set("dead_time_compensation", wanted / nominal)
    dead_time.write(by_the_image)
    dead_time.accept(by_the_image)
    drive.run(300)
    assert dead_time.words == (wanted, ~wanted)
    assert drive.get("fault_word") == 0


def test_members_that_share_a_word_with_one_that_is_set_stay(drive: Loop, parts: Parts) -> None:
    """An image with the bus writes the limits and the first of the flags itself."""
    core = Stand(drive).core
    request = address(core, parts, REQUEST)
    drive.set("torque_requested_Nm", 30)
    drive.run(300)
    run_into_task(drive, core)
    drive.set("current_mode", 1)
    drive.set("torque_limit_drive_Nm", 50)
    core.write(request + ENABLE, b"\0")
    core.write(request + LIMITS + 2, struct.pack("<h", 1234))  # torque_regen
    drive.run(30)
    assert core.read(request + ENABLE, 1) == b"\0"
    assert core.outputs == 0
    assert struct.unpack("<h", core.read(request + LIMITS + 2, 2)) == (1234,)
    assert drive.get("torque_limit_drive_Nm") == pytest.approx(50, abs=0.1)
    assert drive.get("current_mode") == 1
