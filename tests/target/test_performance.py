# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md states the present cost of the firmware."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from fluxtrue_tools.bench import build
from fluxtrue_tools.bench.cli import bench


def test_every_committed_figure_is_measured_again_exactly(capsys: pytest.CaptureFixture[str]) -> None:
    if not build.have_arm_compiler():
        pytest.skip(f"{build.ARM_CC} is not installed: there is nothing to measure")
    done = CliRunner().invoke(bench, ["--check"])
    if "not compared" in done.output:
        pytest.skip(done.output.strip())
    assert done.exception is None, f"{done.exception}"
    assert "every figure is as committed" in done.output
