# SPDX-License-Identifier: Apache-2.0
"""The command that prints the errors of a commissioning over CAN."""

import re

import pytest
from click.testing import CliRunner

from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.over_can import dc_zero_text, main, score_text, turned_text
from fluxtrue_tools.commission.score import Score, Turned
from fluxtrue_tools.sim.motor import Motor

R_PERCENT = 1.0


def test_the_errors_are_printed_in_the_units_of_the_page() -> None:
    found = score_text(Score(0.00304, 0.0173, 0.0012))
    assert found == ("map: 0.30 % rms, 1.73 % at worst, of the largest flux linkage; its torque 0.12 % rms of the "
                     "largest")  # fmt: skip
    said = turned_text(Turned(True, -0.0594, 0.0011, -0.004, 0.005, 0.002))
    assert said == ("connection: right; offset -0.059 degrees; psi_f beyond the gain of the dc voltage +0.11 %; "
                    "inertia -0.4 %; drag 0.5 % rms")  # fmt: skip
    assert turned_text(Turned(False, 0.0, 0.0, 0.0, 0.0, 0.0)).startswith("connection: WRONG")


def test_an_offset_that_is_not_found_has_no_error(unknown: Motor, known: Nameplate) -> None:
    truth, _, _ = hidden.draw("saturated", 12, unknown, known.i_max_A)
    plant = truth.plant
    plant["vdc_offset_V"] = -0.001 * plant["vdc_full_scale_V"]
    named = "offset of the dc voltage's sensor: "
    assert dc_zero_text(DcZero(unknown="still charged"), truth) == f"{named}not found: still charged"
    assert dc_zero_text(DcZero(unknown=""), truth) == f"{named}+0.100 % of the full scale"


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
