# SPDX-License-Identifier: Apache-2.0
"""The machines, loaded once."""

import pytest

from fluxtrue_tools.demo.experiment import Bench, bench
from fluxtrue_tools.sim.motor import Motor


@pytest.fixture(scope="session")
def machines() -> Bench:
    return bench()


@pytest.fixture(scope="session")
def paper(machines: Bench) -> Motor:
    return machines.paper


@pytest.fixture(scope="session")
def hsm1(machines: Bench) -> Motor:
    return machines.hsm1
