# SPDX-License-Identifier: Apache-2.0
"""A slice of the campaign of bit flips in RAM and flash of the image on the bus (elf_flips.py)."""

from __future__ import annotations

import elf_flips
import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build

FLIPS, SEED = 60, 1


def test_no_flip_changes_the_torque_silently() -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    found = elf_flips.campaign(build.prepare("hsm1", flashed=True), FLIPS, SEED)
    print({area: dict(counts) for area, counts in found.items()})
    assert sum(counts.total() for counts in found.values()) == FLIPS
    assert all(counts["silent"] + counts["late"] == 0 for counts in found.values())
    assert all(counts["detected"] > 0 for counts in found.values())
    assert found["data"]["masked"] + found["code"]["masked"] == 0, "the checksums cover every byte of the flash"
