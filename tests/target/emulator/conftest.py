# SPDX-License-Identifier: Apache-2.0
"""The emulated inverter, built once; without the cross compiler there is nothing to emulate."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop


@pytest.fixture(scope="session")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1")


@pytest.fixture(scope="session")
def resolver_parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", angle="resolver")


@pytest.fixture
def drive(parts: Parts) -> Iterator[Loop]:
    """At 3000 rpm, asked for nothing yet."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0, "current_noise_A_rms": 0.5}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        yield loop


@pytest.fixture(scope="session")
def here() -> Path:
    return Path(__file__).parent
