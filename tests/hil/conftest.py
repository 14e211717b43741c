# SPDX-License-Identifier: Apache-2.0
"""One suite for the virtual ECU and for a bench: its options, its connections, and the checks after every test."""

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import can
import cantools.database
import health
import pytest
from report import Figures, Report
from rig import Rig

from fluxtrue_tools.a2l.elf import Description, read
from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.address import BusAddress, parse_option
from fluxtrue_tools.bus.interface import CONFIGURATION, Interface, read_interface
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.mdf import BusLog
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import connect

ROOT = Path(__file__).resolve().parents[2]
VERSION = "INV_Version"
STACK = "unused stack"
MARKERS = {
    "plant": "needs a plant that can be told what to do (--bench, or the virtual ECU)",
    "program": "needs the virtual ECU's program itself (--vecu)",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options that tools/hil passes on."""
    group = parser.getgroup("hil")
    group.addoption("--vecu", help="program of the virtual ECU; used when no interface is given")
    group.addoption("--can-interface", help="python-can interface: socketcand, socketcan, pcan, kvaser ...")
    group.addoption("--can-channel", default="can0", help="its channel")
    group.addoption("--can-option", action="append", default=[], metavar="NAME=VALUE",
                    help="further argument of can.Bus, for example host=127.0.0.1, bitrate=500000")  # fmt: skip
    group.addoption("--bench", metavar="HOST:PORT", help="bench channel of the plant behind that interface")
    group.addoption(
        "--clock",
        metavar="HOST:PORT",
        help="bench channel that only lets time pass: a virtual ECU with --fast as a bench",
    )
    group.addoption("--allow-power", action="store_true",
                    help="on a bench: tests may charge the dc link, enable switching and request torque")  # fmt: skip
    group.addoption("--dbc", help="DBC of the ECU's motor; default: beside --vecu, else in the standard scale")
    group.addoption("--elf", help="the ECU's ELF file: where its calibration values are; default: --vecu")
    group.addoption("--report", default=str(ROOT / "build" / "hil"), help="folder for report.html and bus.mf4")
    group.addoption("--soak-minutes", type=float, default=30.0, help="simulated length of the soak test")


def pytest_configure(config: pytest.Config) -> None:
    """Markers, and the report that hooks and fixtures share."""
    # python-can warns of every frame that arrives in two reads, although it joins the parts correctly.
    logging.getLogger("can.interfaces.socketcand").setLevel(logging.ERROR)
    for name, text in MARKERS.items():
        config.addinivalue_line("markers", f"{name}: {text}")
    config.stash[REPORT] = report = Report(Path(config.getoption("--report")))
    interface = config.getoption("--can-interface")
    options = " ".join([config.getoption("--can-channel"), *config.getoption("--can-option")])
    report.about["when"] = f"{datetime.now().astimezone():%Y-%m-%d %H:%M %Z}"
    report.about["target"] = f"{interface} {options}" if interface else f"virtual ECU {config.getoption('--vecu')}"
    report.about["plant"] = config.getoption("--bench") or ("none to command" if interface else "simulated")


REPORT = pytest.StashKey[Report]()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without a plant that can be commanded, report which tests cannot run, and why."""
    has_program = config.getoption("--can-interface") is None
    has_plant = has_program or config.getoption("--bench") is not None
    for item in items:
        if "plant" in item.keywords and not has_plant:
            item.add_marker(pytest.mark.skip(reason="needs plant control, and this bench has none (--bench)"))
        if "program" in item.keywords and not has_program:
            item.add_marker(pytest.mark.skip(reason="tests the virtual ECU itself"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Every outcome goes into the report."""
    outcome = yield
    item.config.stash[REPORT].outcome(item.nodeid, outcome)
    return outcome


def pytest_sessionfinish(session: pytest.Session) -> None:
    """The report is written even after failures."""
    session.config.stash[REPORT].write()


@pytest.fixture(scope="session")
def program(request: pytest.FixtureRequest) -> Path:
    """The virtual ECU's program."""
    given = request.config.getoption("--vecu")
    if given is None:
        pytest.exit("no target: give --vecu=PATH, or --can-interface and --can-channel", returncode=2)
    return Path(given)


@pytest.fixture(scope="session")
def interface(request: pytest.FixtureRequest) -> Interface:
    """The DBC of the motor: --dbc, or the one built beside the virtual ECU; else in the standard scale."""
    given, program = request.config.getoption("--dbc"), request.config.getoption("--vecu")
    return read_interface(Path(given) if given else Path(program).with_name(DBC.name) if program else DBC)


@pytest.fixture(scope="session")
def database(interface: Interface) -> cantools.database.Database:
    """The messages of the bus."""
    return interface.database


@dataclass
class Target:
    """The ECU under test and its connections."""

    bus: can.BusABC
    stand: Channel | None
    can_port: int = 0  # of the virtual ECU, for further clients
    clock: Channel | None = None  # lets time pass, for a plant that cannot be commanded


def _channel(config: pytest.Config, option: str) -> Channel | None:
    address = config.getoption(option)
    return None if address is None else Channel.at(address, option)


def _bench_target(config: pytest.Config) -> Target:
    options = dict(map(parse_option, config.getoption("--can-option")))
    bus = BusAddress(config.getoption("--can-interface"), config.getoption("--can-channel"), options).connect()
    try:
        stand, clock = _channel(config, "--bench"), _channel(config, "--clock")
    except FluxtrueError:
        bus.shutdown()
        raise
    port = options.get("port", 0)
    return Target(bus, stand, port if isinstance(port, int) else 0, clock)


@pytest.fixture(scope="session")
def target(request: pytest.FixtureRequest) -> Iterator[Target]:
    """The bench given on the command line, else a virtual ECU; the suite ends without either."""
    try:
        is_bench = request.config.getoption("--can-interface") is not None
        found = _bench_target(request.config) if is_bench else VirtualEcu(request.getfixturevalue("program"))
    except FluxtrueError as error:
        pytest.exit(f"error: {error}", returncode=2)
    if isinstance(found, Target):
        yield found
        found.bus.shutdown()
        return
    with found as ecu:
        bus = connect(ecu.can_port)
        yield Target(bus, Channel(HOST, ecu.bench_port), ecu.can_port)
        bus.shutdown()


@pytest.fixture(scope="session")
def bus_log(request: pytest.FixtureRequest, interface: Interface) -> Iterator[BusLog]:
    """All frames on the bus, for bus.mf4."""
    log = BusLog()
    yield log
    folder = Path(request.config.getoption("--report"))
    folder.mkdir(parents=True, exist_ok=True)
    log.write(folder / "bus.mf4", interface)


@pytest.fixture(scope="session")
def connected(
    request: pytest.FixtureRequest, target: Target, database: cantools.database.Database, bus_log: BusLog
) -> Rig:
    """The connection that all tests of the session share."""
    about = request.config.stash[REPORT].about

    def note_version(message: can.Message) -> None:
        if message.arbitration_id == rig.by_name[VERSION].frame_id and not message.is_extended_id:
            told = rig.decode(VERSION, message.data)
            about["firmware"] = (f"{told['Major']}.{told['Minor']}.{told['Patch']}, interface {told['Interface']}, "
                                 f"motor {told['MotorId']:#010x}")  # fmt: skip

    rig = Rig(target.bus, database, target.stand, target.clock)
    is_bench = request.config.getoption("--can-interface") is not None
    rig.may_switch_on = not is_bench or request.config.getoption("--allow-power")
    rig.listeners += [bus_log, note_version]
    return rig


def _note_stack(about: dict[str, str], unused_bytes: int) -> None:
    """Record the smallest unused stack after any test."""
    was = about.get(STACK, "").partition(" ")[0]
    if unused_bytes == 0:
        about.setdefault(STACK, "not told by this target: not checked")
    elif not was.isdigit() or unused_bytes < int(was):
        about[STACK] = f"{unused_bytes} bytes, at least {health.STACK_RESERVE_BYTES} wanted after every test"


@pytest.fixture
def rig(connected: Rig, interface: Interface, request: pytest.FixtureRequest) -> Iterator[Rig]:
    """An ECU just started (virtual) or brought to standby (bench); after the test its health is checked."""
    if connected.has_stand:
        connected.power_cycle()
    else:
        connected.clear_history()
        connected.ask(reset=True)
        connected.advance(0.1)
        connected.ask(reset=False)
    connected.wait_for("standby")
    problem = interface.mismatch(connected.newest(CONFIGURATION))
    if problem:
        pytest.exit(f"error: {problem}", returncode=2)
    before = health.note(connected)
    yield connected
    problems = health.problems(connected, before)
    _note_stack(request.config.stash[REPORT].about, health.stack_unused(connected))
    assert not problems, "after the test: " + "; ".join(problems)


@pytest.fixture(scope="session")
def description(request: pytest.FixtureRequest) -> Description:
    """Calibration values and measurements of the ECU, from its ELF file."""
    path = request.config.getoption("--elf") or request.config.getoption("--vecu")
    if path is None:
        pytest.skip("needs the ECU's ELF file (--elf)")
    return read(Path(path))


@pytest.fixture
def second_client(target: Target, connected: Rig) -> Iterator[can.BusABC]:
    """Another node on the virtual bus."""
    bus = connect(target.can_port)
    yield bus
    bus.shutdown()
    assert connected.has_stand


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Figures:
    """Plots and figures of merit for the report."""
    return request.config.stash[REPORT].figures(request.node.nodeid)


@pytest.fixture
def make_vecu(program: Path) -> Callable[..., VirtualEcu]:
    """Further virtual ECUs, for tests that end or overload them."""
    return lambda **options: VirtualEcu(program, **options)
