# SPDX-License-Identifier: Apache-2.0
"""The command that prints the errors of a commissioning over CAN."""

import re

import pytest
from click.testing import CliRunner

from fluxtrue_tools.commission.over_can import main

R_PERCENT = 1.0


@pytest.mark.parametrize(("steps", "connected"), [("resistance", True), ("offsets,phases", False)])
def test_the_errors_of_the_steps_are_printed(steps: str, connected: bool) -> None:
    """A connection at random is shown only with the steps that find it."""
    done = CliRunner().invoke(main, ["--machine", "pmasynrm", "--seed", "13", "--step", steps], catch_exceptions=False)
    print(done.output)
    assert done.exit_code == 0
    assert re.search(r"^\d+ s of the bus", done.output, re.MULTILINE)
    pattern = r"connection: Connection\(pole_pairs=(\d+), reversed=(\w+), .*true: (\d+) pole pairs, reversed (\w+)"
    found = re.search(pattern, done.output)
    assert (found is None) == connected
    if found is not None:
        assert found.group(1, 2) == found.group(3, 4)
        return
    resistance = re.search(r"resistance: ([+-][\d.]+) %", done.output)
    assert resistance is not None and abs(float(resistance[1])) <= R_PERCENT
