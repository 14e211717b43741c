# SPDX-License-Identifier: Apache-2.0
"""The page's server as a child process, a browser that shows the page, and simulated time that waits for both.

Each test has its own virtual ECU. Its time advances when the server asks for it, and the server waits until every page
has drawn the previous values (--in-step). However long a browser takes, no command is late and no page is silent.
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
CHROMIUM, DRIVER = Path("/usr/bin/chromium"), Path("/usr/bin/chromedriver")


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


@pytest.fixture
def server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Server]:
    """A server connected to a virtual ECU that has just been started."""
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
    """Debian's Chromium, headless."""
    if not (CHROMIUM.exists() and DRIVER.exists()):
        pytest.skip("needs the Debian packages chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu",
                     "--window-size=1440,960", "--force-device-scale-factor=1"):  # fmt: skip
        options.add_argument(argument)
    driver = webdriver.Chrome(options=options, service=Service(str(DRIVER)))
    driver.set_page_load_timeout(HANG_S)
    driver.set_script_timeout(HANG_S)
    yield driver
    driver.quit()


@pytest.fixture
def page(browser: webdriver.Chrome, server: Server) -> Page:
    """A page whose drive runs at 2000 rpm."""
    opened = Page(browser, server)
    browser.get("about:blank")
    browser.get_log("browser")  # discards the messages of the previous page, whose server has ended
    browser.get(server.url)
    opened.until(lambda: opened.text("state") == "standby", "standby")
    opened.find("ready").click()
    opened.until(lambda: opened.text("state") == "ready", "ready")
    opened.enable()
    opened.slide("speed_rpm", 2000.0)
    opened.until(lambda: opened.newest("INV_Status", "Speed") > 1990.0, "2000 rpm")
    return opened
