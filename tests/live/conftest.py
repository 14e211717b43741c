# SPDX-License-Identifier: Apache-2.0
"""The page's server as a child process, a browser that shows the page, and simulated time that waits for both.

The time of a virtual ECU advances when the server asks for it, and the server waits until every page has drawn the
previous values (--in-step). However long a browser takes, no command is late and no page is silent.

The tests of a file share a server and its virtual ECU until one of them fails: to start them takes seconds. A page that
a test is given has been loaded anew, without control, faults or torque. A test that ends the server has one of its own.
"""

import contextlib
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from damage import BAD_FLUX, damaged
from driver import Page
from progress import HANG_S
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu

ROOT = Path(__file__).resolve().parents[2]
FAILED = pytest.StashKey[bool]()
AT_REST, FAULTED = ("standby", "ready", "discharge"), ("fault", "safe state")
INVERTER_C = 40.0  # of a virtual ECU that has just been started
CHROMIUM, DRIVER = Path("/usr/bin/chromium-headless-shell"), Path("/usr/bin/chromedriver")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options that ctest passes."""
    parser.addoption("--vecu", help="program of the virtual ECU")
    parser.addoption("--pictures", default=str(ROOT / "build" / "live"), help="folder for screenshots")


@dataclass
class Server:
    """A running page, and the bench channel of the virtual ECU behind it; a replay has none."""

    url: str
    records: Path
    process: subprocess.Popen[str]
    stand: Channel | None = None
    ecu: VirtualEcu | None = None

    def now_s(self) -> float:
        """Simulated time. Fails when the server has ended, because then the time would never advance."""
        assert self.process.poll() is None, "the server has ended"
        assert self.stand is not None
        return 1e-9 * self.stand.run(0.0).now_ns


def launch(records: Path, *arguments: str) -> Server:
    """`tools/fluxtrue live` with further arguments."""
    build = Path(os.environ["FLUXTRUE_BUILD_DIR"])
    command = [sys.executable, "-m", "fluxtrue_tools", "live", "--port", "0", "--build-dir", str(build), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert process.stdout is not None
    line = process.stdout.readline()
    if not re.fullmatch(r"http://127\.0\.0\.1:\d+/\n", line):
        process.kill()
        pytest.fail(f"the server printed '{line}'")
    return Server(line.strip(), records, process)


def end(server: Server) -> None:
    """End the server as a user does."""
    if server.process.poll() is None:
        server.process.terminate()
    assert server.process.wait(HANG_S) == 0


class Shared:
    """The server of a file's tests."""

    def __init__(self, program: Path, place: Callable[[], Path]) -> None:
        self._program, self._place = program, place
        self._stack = contextlib.ExitStack()
        self._server: Server | None = None

    def server(self) -> Server:
        """The present one, or a new one."""
        if self._server is None:
            self._server = self._stack.enter_context(contextlib.contextmanager(connected)(self._program, self._place()))
        return self._server

    def close(self) -> None:
        """The next test gets a new one."""
        self._server = None
        self._stack.close()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """A test that has failed may have left anything: the next one begins with a new server."""
    report = yield
    if report.failed:  # type: ignore[attr-defined]
        item.stash[FAILED] = True
    return report


@pytest.fixture(scope="module")
def shared(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared]:
    made = Shared(Path(request.config.getoption("--vecu")), lambda: tmp_path_factory.mktemp("live"))
    yield made
    made.close()


@pytest.fixture
def server(request: pytest.FixtureRequest, shared: Shared) -> Iterator[Server]:
    """A server connected to a virtual ECU, in the state in which the test before has left it."""
    yield shared.server()
    if request.node.stash.get(FAILED, False):
        shared.close()


@pytest.fixture
def own_server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Server]:
    """A server that the test may end, connected to a virtual ECU that has just been started."""
    yield from connected(Path(request.config.getoption("--vecu")), tmp_path)


@pytest.fixture
def refused(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Server]:
    """A server connected to a virtual ECU whose motor data fail a check."""
    program = Path(request.config.getoption("--vecu"))
    yield from connected(damaged(program, tmp_path / "refused", *BAD_FLUX), tmp_path)


@pytest.fixture
def free_running(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Server]:
    """A server whose simulated time does not wait for the pages."""
    yield from connected(Path(request.config.getoption("--vecu")), tmp_path, ())


def connected(program: Path, tmp_path: Path, further: tuple[str, ...] = ("--in-step",)) -> Iterator[Server]:
    """A virtual ECU and a server before it."""
    with VirtualEcu(program) as ecu:
        options = (f"host={HOST}", f"port={ecu.can_port}", "tcp_tune=1")
        records = tmp_path / "records"
        running = launch(
            records, "--record-dir", str(records), "--can-interface", "socketcand",
            *(f"--can-option={one}" for one in options),
            "--bench", f"{HOST}:{ecu.bench_port}", "--elf", str(program), *further,
        )  # fmt: skip
        running.stand, running.ecu = Channel(HOST, ecu.bench_port), ecu
        yield running
        end(running)
        running.stand.close()


@pytest.fixture
def replay(tmp_path: Path) -> Iterator[Callable[[Path], Server]]:
    """Plays a recorded drive."""
    with contextlib.ExitStack() as stack:

        def start(path: Path) -> Server:
            running = launch(tmp_path / "unused", "--replay", str(path))
            stack.callback(end, running)
            return running

        yield start


@pytest.fixture(scope="session")
def browser() -> Iterator[webdriver.Chrome]:
    """Debian's Chromium in its build without windows: it takes three quarters of the processor time of the other."""
    if not (CHROMIUM.exists() and DRIVER.exists()):
        pytest.skip("needs the Debian packages chromium-headless-shell and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for argument in ("--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu",
                     "--window-size=1440,960", "--force-device-scale-factor=1"):  # fmt: skip
        options.add_argument(argument)
    driver = webdriver.Chrome(options=options, service=Service(str(DRIVER)))
    driver.set_page_load_timeout(HANG_S)
    driver.set_script_timeout(HANG_S)
    yield driver
    driver.quit()


@pytest.fixture
def page(browser: webdriver.Chrome, server: Server) -> Page:
    """A page whose drive runs at 2000 rpm, without torque."""
    return running(browser, server)


@pytest.fixture
def own_page(browser: webdriver.Chrome, own_server: Server) -> Page:
    """The same with a server that the test may end."""
    return running(browser, own_server)


def opened(browser: webdriver.Chrome, server: Server) -> Page:
    """A page that has been loaded anew, the only one, on an inverter without torque; faults are reset."""
    for other in browser.window_handles[:-1]:
        browser.switch_to.window(other)
        browser.close()
    browser.switch_to.window(browser.window_handles[0])
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.get("about:blank")
    browser.get_log("browser")  # discards the messages of the previous page, whose server may have ended
    assert server.stand is not None
    server.stand.set(board_gate_fault=0, board_inverter_C=INVERTER_C)
    page = Page(browser, server)
    browser.get(server.url)
    page.until(lambda: page.text("state") in (*AT_REST, *FAULTED), "an end of the drive before")
    if page.text("state") in FAULTED:
        page.slide("speed_rpm", 0.0)
        page.until(lambda: page.find("reset").is_enabled(), "the reset")
        page.press("reset")
        page.until(lambda: page.text("state") in AT_REST and page.text("faults") == "none", "no fault")
        page.run("window.scrollTo(0, 0)")
    return page


def running(browser: webdriver.Chrome, server: Server) -> Page:
    """The same, enabled, with the test stand in its usual state."""
    page = opened(browser, server)
    if page.text("state") != "ready":
        page.find("ready").click()
    page.until(lambda: page.text("state") == "ready", "ready")
    page.enable()
    for name, value in (("magnet_percent", 100.0), ("winding_C", 20.0), ("speed_rpm", 2000.0)):
        page.slide(name, value)
    page.until(lambda: abs(page.newest("INV_Status", "Speed") - 2000.0) < 10.0, "2000 rpm")
    return page
