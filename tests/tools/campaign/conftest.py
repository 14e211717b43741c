# SPDX-License-Identifier: Apache-2.0
"""A campaign that takes seconds, and its motor."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from in_process import fluxtrue

from fluxtrue_tools.campaign.machine import Machine, make_machine
from fluxtrue_tools.campaign.spec import Campaign, parse
from fluxtrue_tools.sim.build import prepare

ROOT = Path(__file__).resolve().parents[3]
SMALL = """
motor = "hsm1"
cases = 4
seed = 7
[plant]
angle_bits = 12
[drive]
duration_s = 2
[windows]
speed_rpm = [[500, 6000, 1]]
low_speed_rpm = [250]
settle_s = 0.1
measure_s = 0.05
[[controller]]
name = "tables"
set = { torque_loop = false, identification = false }
warm_up = false
[[controller]]
name = "paper"
set = { torque_loop = true, identification = true, identification_mode = 0 }
"""


@pytest.fixture(scope="session")
def small() -> Campaign:
    return parse(SMALL, "small.toml")


@pytest.fixture(scope="session")
def machine(small: Campaign) -> Machine:
    return make_machine(prepare("hsm1"), small, "small.toml")


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "fluxtrue_tools", "campaign", *map(str, arguments)]


def environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(ROOT / "tools")}


def campaign(*arguments: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """The command, finished."""
    return fluxtrue("campaign", *arguments, cwd=cwd)
