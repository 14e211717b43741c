# SPDX-License-Identifier: Apache-2.0
"""The page's server as a child process, and a browser before it."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM, DRIVER = Path("/usr/bin/chromium"), Path("/usr/bin/chromedriver")


def pytest_addoption(parser: pytest.Parser) -> None:
    """From ctest."""
    parser.addoption("--vecu", help="program of the virtual ECU")
    parser.addoption("--pictures", default=str(ROOT / "build" / "live"), help="folder for screenshots")


@dataclass
class Server:
    """A running page."""

    url: str
    records: Path
    process: subprocess.Popen[str]


@pytest.fixture
def serve(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Starts `tools/fluxtrue live` with further arguments."""
    running: list[subprocess.Popen[str]] = []
    build = Path(os.environ["FLUXTRUE_BUILD_DIR"])

    def start(*arguments: str) -> Server:
        command = [sys.executable, "-m", "fluxtrue_tools", "live", "--port", "0", "--build-dir", str(build),
                   "--record-dir", str(tmp_path / "records"), *arguments]  # fmt: skip
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        running.append(process)
        assert process.stdout is not None
        line = process.stdout.readline()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\n", line), line
        return Server(line.strip(), tmp_path / "records", process)

    yield start
    for process in running:
        process.terminate()
        assert process.wait(20) == 0


@pytest.fixture(scope="session")
def browser() -> Iterator[webdriver.Chrome]:
    """Debian's Chromium without a screen."""
    if not (CHROMIUM.exists() and DRIVER.exists()):
        pytest.skip("needs the Debian packages chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu",
                     "--window-size=1440,960", "--force-device-scale-factor=1"):  # fmt: skip
        options.add_argument(argument)
    driver = webdriver.Chrome(options=options, service=Service(str(DRIVER)))
    yield driver
    driver.quit()
