# SPDX-License-Identifier: Apache-2.0
"""The virtual ECU as a program: bad input on its ports, clients that come and go, start and end."""

import random
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from unittest.mock import create_autospec

import can
import pytest
from progress import HANG_S

from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope.xcp import WallLine
from fluxtrue_tools.vecu.channel import BenchRefused, Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import client_port, connect

pytestmark = pytest.mark.program
STATUS_ID = 0x210
MALFORMED = (
    b"< send >", b"< send 123 >", b"< send 800 0  >", b"< send 20000000 0  >", b"< send 123 9 0 0 0 0 0 0 0 0 0 >",
    b"< send 123 2 1 >", b"< send 123 1 1 2 >", b"< send 123 1 100 >", b"< send 123 1 g >", b"< send -1 0  >",
    b"< send 1234 0  >", b"< bcm >", b"< >", b"<>", b"rubbish", b"< send 123 1 1", b"<<<<", b"\0\0\0",
    b"< se\0nd 123 0 >", b"<" + b"x" * 5000, b"< send " + b"0" * 3000 + b" >",
)  # fmt: skip
BAD_COMMANDS = (
    "nonsense", "set", "set truth.vdc_V 1", "set plant.speed_rad_s", "set plant.speed_rad_s nan",
    "set plant.r_ohm_20 -1", "set plant.speed_rad_s 1e999", "set enable 1", "set torque_requested_Nm 100", "get",
    "get nothing", "run", "run 1", "run -1 ms", "run nan s", "run 1 fortnight", "run 1e30 s", "run 1 ms 99999 0",
    "run 1 ms 1 0", "record", "record 0 truth.torque_Nm", "record 1 nothing", "record x truth.torque_Nm", "ramp",
    "ramp plant.speed_rad_s 1 1", "ramp plant.nothing 1 1 s", "reset minus",
    "reset 1 2", "set " + "plant.load_Nm 0 " * 40, "x" * 1000,
)  # fmt: skip


@pytest.fixture
def ecu(make_vecu: Callable[[], VirtualEcu]) -> Iterator[VirtualEcu]:
    with make_vecu() as running:
        yield running


@pytest.fixture
def stand(ecu: VirtualEcu) -> Iterator[Channel]:
    channel = Channel(HOST, ecu.bench_port)
    yield channel
    channel.close()


def address(port: int) -> BusAddress:
    return BusAddress("socketcand", "can0", {"host": HOST, "port": port})


def test_a_wrong_port_is_refused_with_one_message(
    ecu: VirtualEcu, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Each port in place of the other one, which does not answer, and a port on which nothing listens."""
    with socket.socket() as closed:
        closed.bind((HOST, 0))
        with pytest.raises(FluxtrueError, match=f"port={closed.getsockname()[1]}: Connection refused; wanted: the CAN"):
            address(closed.getsockname()[1]).connect()
    address(ecu.can_port).connect().shutdown()
    Channel.at(f"{HOST}:{ecu.bench_port}", "--bench").close()
    monkeypatch.setattr("fluxtrue_tools.bus.address.GREETING_S", 0.1)
    monkeypatch.setattr("fluxtrue_tools.vecu.channel.GREETING_S", 0.1)
    with pytest.raises(FluxtrueError, match=f"port={ecu.bench_port}: no socketcand server answers there"):
        address(ecu.bench_port).connect()
    with pytest.raises(FluxtrueError, match=f"{ecu.can_port}: no bench answers there"):
        Channel.at(f"{HOST}:{ecu.can_port}", "--bench")
    assert caplog.text == ""


@pytest.mark.parametrize("name", ["host", "port"])
def test_a_socketcand_server_needs_host_and_port(name: str) -> None:
    options = {"host": HOST, "port": 1}
    del options[name]
    with pytest.raises(FluxtrueError, match=f"--can-interface socketcand: missing: --can-option {name}="):
        BusAddress("socketcand", "can0", options).connect()


def test_a_lost_bus_ends_an_xcp_session_with_one_line() -> None:
    """python-can's message of a lost connection contains a traceback."""
    bus = create_autospec(can.BusABC, instance=True)
    bus.send.side_effect = can.CanError("Failed to send: Connection reset by peer\nTraceback (most recent call last):")
    with pytest.raises(FluxtrueError) as error:
        WallLine(bus).exchange(can.Message())
    assert str(error.value) == "the bus is lost: Failed to send: Connection reset by peer"


def raw(port: int) -> socket.socket:
    return socket.create_connection((HOST, port), HANG_S)


def greeted(port: int) -> socket.socket:
    connection = raw(port)
    greet(connection)
    return connection


def greet(connection: socket.socket) -> None:
    for say in (b"", b"< open can0 >", b"< rawmode >"):
        connection.sendall(say)
        assert connection.recv(64) in (b"< hi >", b"< ok >")


def test_malformed_texts_are_counted_and_good_ones_between_them_still_count(ecu: VirtualEcu, stand: Channel) -> None:
    with greeted(ecu.can_port) as connection:
        for text in MALFORMED:
            connection.sendall(text)
            connection.sendall(b"< send 123 1 7 >")
        connection.shutdown(socket.SHUT_WR)
        assert connection.recv(64) == b""  # everything has been read
    counters = stand.counters()
    # The text without an end is lost at the next '<', so that none of the good texts is lost.
    assert counters["from_clients"] == len(MALFORMED)
    assert counters["malformed"] + counters["dropped"] >= len(MALFORMED)


def test_random_bytes_on_both_ports_are_survived(ecu: VirtualEcu, stand: Channel) -> None:
    rng = random.Random(1)
    alphabet = b"<> \nsend 0123456789abcdefrun set get plant.\0\xff"
    for attempt in range(200):
        port = ecu.can_port if attempt % 2 else ecu.bench_port
        connection = greeted(port) if port == ecu.can_port and attempt % 4 == 1 else raw(port)
        with connection:
            size = rng.randrange(1, 5000)
            pick = alphabet if attempt % 3 else bytes(range(256))
            with suppress(ConnectionError):
                connection.sendall(bytes(rng.choices(pick, k=size)))
        stand.run(1.0)
    counters = stand.counters()
    assert counters["malformed"] + counters["dropped"] > 0
    assert counters["bench_dropped"] + counters["bench_refused"] > 0


@pytest.mark.parametrize("command", BAD_COMMANDS, ids=range(len(BAD_COMMANDS)))
def test_a_bad_bench_command_is_refused_with_a_reason_and_changes_nothing(stand: Channel, command: str) -> None:
    names = [name for name in stand.ask("names").split() if name.startswith(("plant.", "board."))]
    before = [stand.get(*names[k : k + 30]) for k in range(0, len(names), 30)]
    with pytest.raises(BenchRefused, match=r"error .{8,}"):
        stand.ask(command)
    assert [stand.get(*names[k : k + 30]) for k in range(0, len(names), 30)] == before
    assert stand.counters()["bench_refused"] == 1.0


def test_clients_that_leave_in_the_middle_of_anything_leave_the_others_alone(ecu: VirtualEcu, stand: Channel) -> None:
    staying = connect(ecu.can_port)
    for farewell in (b"", b"< se", b"< send 123 1", b"< open can0 >", b"<"):
        with raw(ecu.can_port) as connection:
            connection.sendall(farewell)
        with raw(ecu.bench_port) as connection:
            connection.sendall(farewell.replace(b"<", b"run 1"))
    stand.run(20.0, client_port(staying), 0)
    assert staying.recv(HANG_S) is not None
    staying.shutdown()


def test_a_run_that_waits_for_a_client_that_left_is_given_up(ecu: VirtualEcu, stand: Channel) -> None:
    leaving = connect(ecu.can_port)
    port = client_port(leaving)
    stand.send(f"run 1 ms {port} 5")
    leaving.shutdown()
    with pytest.raises(BenchRefused, match="no CAN client"):
        stand.answer()


def test_more_clients_than_it_can_serve_are_refused_and_the_rest_served(ecu: VirtualEcu, stand: Channel) -> None:
    guests = [greeted(ecu.can_port) for _ in range(16)]
    with raw(ecu.can_port) as late:
        assert late.recv(16) == b""
    for guest in guests:
        guest.close()
    stand.run(10.0)
    greeted(ecu.can_port).close()


def test_every_client_hears_the_others_but_not_itself(ecu: VirtualEcu, stand: Channel) -> None:
    one, two, three = (connect(ecu.can_port) for _ in range(3))
    for client in (one, two, three):
        stand.run(0.0, client_port(client), 0)
    one.send(can.Message(arbitration_id=0x1FFFFFFF, data=b"", is_extended_id=True))
    stand.run(1.0, client_port(one), 1)
    for client in (two, three):
        heard = client.recv(HANG_S)
        assert heard is not None and (heard.arbitration_id, heard.is_extended_id, heard.dlc) == (0x1FFFFFFF, True, 0)
        # (VB-2) without data: 67 + 53/4 = 80 bits of 2 us each.
        assert heard.timestamp == pytest.approx(160e-6, abs=1e-9)
    # The sender receives none of its own frames: nothing comes before a frame of another client.
    two.send(can.Message(arbitration_id=0x1FFFFFFE, data=b"", is_extended_id=True))
    stand.run(1.0, client_port(two), 1)
    while (heard := one.recv(HANG_S)) is not None and heard.arbitration_id != 0x1FFFFFFE:
        assert heard.arbitration_id != 0x1FFFFFFF
    for client in (one, two, three):
        client.shutdown()


def test_a_client_that_never_reads_is_let_go_and_the_run_goes_on(ecu: VirtualEcu, stand: Channel) -> None:
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
    deaf.connect((HOST, ecu.can_port))
    greet(deaf)
    stand.run(0.0, deaf.getsockname()[1], 0)
    stand.run(30_000.0)  # more than 15 000 frames of 45 characters
    assert stand.counters()["slow_clients"] == 1.0
    deaf.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_cleanly_when_asked_to(program: Path, number: signal.Signals) -> None:
    process = subprocess.Popen([program, "--realtime", "--port", "0", "--bench-port", "0"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline().startswith("fluxtrue-vecu")
    process.send_signal(number)
    _, errors = process.communicate(timeout=HANG_S)
    assert (process.returncode, errors) == (0, "")


def test_a_port_that_is_taken_is_a_clear_error(program: Path, ecu: VirtualEcu) -> None:
    done = subprocess.run([program, "--port", str(ecu.can_port), "--bench-port", "0"], capture_output=True, text=True,
                          timeout=HANG_S, check=False)  # fmt: skip
    assert done.returncode == 2
    assert f"port {ecu.can_port} on 127.0.0.1: Address already in use" in done.stderr


@pytest.mark.parametrize(
    "options", [["--port"], ["--port", "x"], ["--port", "70000"], ["--bit-rate", "1"], ["--seed", "-1"], ["--what"]]
)
def test_a_bad_option_is_a_clear_error(program: Path, options: list[str]) -> None:
    done = subprocess.run([program, *options], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ") and "allowed" in done.stderr


@pytest.mark.parametrize("motor", ["hsm1", "paper"])
def test_the_command_line_serves_any_shipped_motor(motor: str) -> None:
    command = [sys.executable, "-m", "fluxtrue_tools", "vecu", "--motor", motor, "--fast", "--port", "0",
               "--bench-port", "0"]  # fmt: skip
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().startswith(f"fluxtrue-vecu motor={motor} mode=fast can=")
    process.send_signal(signal.SIGTERM)
    assert process.wait(HANG_S) == 0


def frames(connection: socket.socket, already: bytes = b"") -> Iterator[tuple[int, float]]:
    """Identifier and time stamp of each frame."""
    while True:
        *texts, already = already.split(b">")
        for text in texts:
            if text.startswith(b"< frame "):
                _, _, identifier, time_s, *_ = text.split()
                yield int(identifier, 16), float(time_s)
        already += connection.recv(4096)


def test_in_real_time_time_passes_by_itself_and_frames_keep_their_simulated_period(program: Path) -> None:
    """The test does not read the clock. It uses a plain socket because python-can fails if a frame arrives in the same
    read as the greeting, which depends on how busy this computer is."""
    times: list[float] = []
    with VirtualEcu(program, fast=False) as ecu, raw(ecu.can_port) as connection:
        connection.sendall(b"< open can0 >< rawmode >")
        for identifier, time_s in frames(connection):
            times += [time_s] if identifier == STATUS_ID else []
            if len(times) == 50:
                break
    assert all(abs(b - a - 0.01) < 5e-4 for a, b in pairwise(times))
