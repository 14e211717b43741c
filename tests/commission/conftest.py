# SPDX-License-Identifier: Apache-2.0
"""The firmware that is built for a nameplate alone."""

from pathlib import Path

import pytest

from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.motor import Motor

FOLDER = ROOT / "tests" / "motors" / "unknown"


@pytest.fixture(scope="session")
def folder() -> Path:
    return FOLDER


@pytest.fixture(scope="session")
def unknown() -> Motor:
    return motors.load(str(FOLDER))


@pytest.fixture(scope="session")
def known(unknown: Motor) -> Nameplate:
    return nameplate_of(FOLDER, unknown)
