# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md states the present cost of the firmware.

The figures belong to the compiler of Debian 12, which tools/setup installs there: on Debian 12 another one would leave
every figure unchecked and is a failure. Other systems have other compilers, with other figures; there the test is
skipped.
"""

from __future__ import annotations

import platform
from typing import Any

import pytest
from click.testing import CliRunner

from fluxtrue_tools.bench import build, sizes
from fluxtrue_tools.bench.cli import bench

PINNED = {"ID": "debian", "VERSION_ID": "12"}


def is_pinned() -> bool:
    """Whether tools/setup installs the compiler of the committed figures on this system."""
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        return False
    return all(release.get(key) == value for key, value in PINNED.items())


def check_figures() -> None:
    """Measure all figures again and compare them."""
    done = CliRunner().invoke(bench, ["--check"])
    if "not compared" in done.output:
        said = done.output.strip()
        if is_pinned():
            pytest.fail(f"{said}; install the compiler of Debian 12: tools/setup")
        pytest.skip(said)
    assert done.exception is None, f"{done.exception}"
    assert "every figure is as committed" in done.output


def test_every_committed_figure_is_measured_again_exactly() -> None:
    if not build.have_arm_compiler():
        pytest.skip(f"{build.ARM_CC} is not installed: there is nothing to measure")
    check_figures()


@pytest.mark.parametrize(("release", "outcome"), [({"ID": "debian", "VERSION_ID": "12"}, pytest.fail.Exception),
                                                  ({"ID": "debian", "VERSION_ID": "13"}, pytest.skip.Exception),
                                                  ({"ID": "ubuntu", "VERSION_ID": "24.04"}, pytest.skip.Exception),
                                                  ({}, pytest.skip.Exception)])  # fmt: skip
def test_another_compiler_fails_where_the_committed_one_is_installed(
    monkeypatch: pytest.MonkeyPatch, release: dict[str, str], outcome: Any
) -> None:
    monkeypatch.setattr(sizes, "compiler", lambda: "arm-none-eabi-gcc 99")
    monkeypatch.setattr(platform, "freedesktop_os_release", lambda: release)
    with pytest.raises((pytest.fail.Exception, pytest.skip.Exception), match="not compared: the baseline is") as raised:
        check_figures()
    assert raised.type is outcome


def test_a_system_that_does_not_say_what_it_is_is_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing() -> dict[str, str]:
        raise OSError

    monkeypatch.setattr(platform, "freedesktop_os_release", nothing)
    assert not is_pinned()
