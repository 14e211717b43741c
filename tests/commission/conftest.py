# SPDX-License-Identifier: Apache-2.0
"""The firmware that is built for a nameplate alone: of a large machine, and of a small one for 48 V."""

from pathlib import Path

import pytest

from fluxtrue_tools.commission.campaign import FOLDER, SMALL_FOLDER
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.motor import Motor


@pytest.fixture(scope="session")
def folder() -> Path:
    return FOLDER


@pytest.fixture(scope="session")
def unknown() -> Motor:
    return motors.load(str(FOLDER))


@pytest.fixture(scope="session")
def known(unknown: Motor) -> Nameplate:
    return nameplate_of(FOLDER, unknown)


@pytest.fixture(scope="session")
def small() -> Motor:
    return motors.load(str(SMALL_FOLDER))


@pytest.fixture(scope="session")
def plate(small: Motor) -> Nameplate:
    return nameplate_of(SMALL_FOLDER, small)
