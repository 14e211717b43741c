# SPDX-License-Identifier: Apache-2.0
"""A calibration master from outside this project, which waits for its answers on the wall clock."""

import re
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from progress import HANG_S, polled
from pyxcp.config import create_application_from_config
from pyxcp.master import Master
from pyxcp.types import XcpResponseError
from xcp_master import key_of

from fluxtrue_tools.a2l.cli import render
from fluxtrue_tools.a2l.elf import Description, read
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu

pytestmark = pytest.mark.program
ROOT = Path(__file__).resolve().parents[2]
COMMAND_ID, ANSWER_ID = 0x650, 0x651
FLOAT = struct.Struct("<f")


def _key(resource: int, seed: bytes) -> bytes:
    return key_of(int.from_bytes(seed, "little")).to_bytes(4, "little")


def _let_time_pass(stand: Channel, ended: threading.Event) -> None:
    """Let time pass from the master's first frame on: by then it has read the greeting without a frame behind it."""
    polled(lambda: ended.is_set() or stand.counters()["from_clients"] > 0)
    while not ended.is_set():
        stand.run(10.0)


@pytest.fixture
def ecu(program: Path) -> Iterator[VirtualEcu]:
    """A virtual ECU whose time begins to pass with the first frame on the bus."""
    with VirtualEcu(program) as running, ThreadPoolExecutor(1) as pool:
        stand, ended = Channel(HOST, running.bench_port), threading.Event()
        passing = pool.submit(_let_time_pass, stand, ended)
        yield running
        ended.set()
        passing.result()
        stand.close()


@pytest.fixture
def master(ecu: VirtualEcu) -> Iterator[Master]:
    """A connected master."""
    application = create_application_from_config({})
    bus = application.transport.can
    bus.interface, bus.channel, bus.bitrate = "socketcand", "can0", 500000
    bus.can_id_master, bus.can_id_slave = COMMAND_ID, ANSWER_ID
    bus.socketcand.host, bus.socketcand.port = HOST, ecu.can_port
    application.transport.timeout = HANG_S
    application.general.seed_n_key_function = _key
    application.general.disable_error_handling = True
    with Master("can", config=application) as connected:
        connected.connect()
        yield connected
        connected.disconnect()


@pytest.fixture
def address(description: Description) -> Callable[[str], int]:
    """The address of a value according to the A2L file."""
    where = {value.name: value.address for value in (*description.values, *description.measurements)}
    return lambda name: where[name]


def _read(master: Master, address: int) -> float:
    master.setMta(address)
    return FLOAT.unpack(master.upload(FLOAT.size))[0]


def _write(master: Master, address: int, value: float) -> None:
    master.setMta(address)
    master.download(FLOAT.pack(value))


def test_a_value_is_locked_then_written_then_read_back(master: Master, address: Callable[[str], int]) -> None:
    at = address("observer_m")
    with pytest.raises(XcpResponseError):
        _write(master, at, 3.5)
    assert _read(master, at) == pytest.approx(3.0, abs=1e-5)
    master.cond_unlock()
    _write(master, at, 3.5)
    assert _read(master, at) == 3.5


def test_a_value_out_of_its_range_is_refused_and_the_old_one_stays(
    master: Master, address: Callable[[str], int]
) -> None:
    master.cond_unlock()
    at = address("dead_time_compensation")
    before = _read(master, at)
    for bad in (1.51, -0.01, float("nan"), float("inf")):
        with pytest.raises(XcpResponseError, match="OUT_OF_RANGE"):
            _write(master, at, bad)
        assert _read(master, at) == before


def test_the_checksum_tells_a_changed_page_from_the_built_in_one(
    master: Master, address: Callable[[str], int], description: Description
) -> None:
    start, size = min(value.address for value in description.values), 4 * len(description.values)

    def checksum() -> int:
        master.setMta(start)
        return int(master.buildChecksum(size).checksum)

    built_in = checksum()
    master.cond_unlock()
    _write(master, address("observer_m"), 2.5)
    assert checksum() != built_in
    master.copyCalPage(0, 0, 0, 1)
    assert checksum() == built_in


def test_the_slave_describes_itself_as_the_a2l_file_does(master: Master) -> None:
    processor = master.getDaqProcessorInfo()
    assert (processor.maxDaq, processor.maxEventChannel) == (4, 2)
    assert processor.daqProperties.daqConfigType == "DYNAMIC"
    assert master.getDaqResolutionInfo().maxOdtEntrySizeDaq == 7


def test_the_session_of_the_howto_runs_as_it_is_printed(program: Path, ecu: VirtualEcu, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "howto" / "xcp.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    (tmp_path / "vecu.a2l").write_text(render(read(program), program.name), encoding="utf-8")
    patient = f"application.transport.timeout = {HANG_S}\nwith Master("
    for printed, here in (("29536", str(ecu.can_port)), ("with Master(", patient)):
        assert code.count(printed) == 1
        code = code.replace(printed, here)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=HANG_S,
                          check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    # pyXCP closes the bus while its listener may still wait for a frame; then its listener logs an error to stdout.
    assert done.stdout.splitlines().count("observer_m 3.5 allowed 2.0 to 4.0") == 1
