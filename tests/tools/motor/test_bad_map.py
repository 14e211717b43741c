# SPDX-License-Identifier: Apache-2.0
"""flux_map.csv: errors are reported with their line number."""

import numpy as np
import pytest
from conftest import plane, straight

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.motor import load_motor

ID = [-300.0, -200.0, -100.0, 0.0]
IQ = [-300.0, -150.0, 0.0, 150.0, 300.0]
GOOD = plane(ID, IQ, straight)


def changed(line: int, text: str) -> str:
    lines = GOOD.splitlines()
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


def with_torque(cell: str) -> str:
    """The map with a column of torques, of which that on line 5 is given."""
    lines = [f"{line},1.5" for line in GOOD.splitlines()]
    lines[0] = f"{GOOD.splitlines()[0]},torque_Nm"
    lines[4] = lines[4].removesuffix("1.5") + cell
    return "\n".join(lines) + "\n"


def without(line: int) -> str:
    lines = GOOD.splitlines()
    del lines[line - 1]
    return "\n".join(lines) + "\n"


BAD = [
    ("", ["flux_map.csv: empty", "id_A, iq_A, psi_d_Vs, psi_q_Vs"]),
    ("# only a comment\n", ["empty"]),
    (GOOD.replace("psi_q_Vs", "psi_q"), ["flux_map.csv:1", "psi_q_Vs found 0 times"]),
    (GOOD.replace("psi_q_Vs", "psi_d_Vs"), ["psi_d_Vs found 2 times"]),
    (changed(5, "-300.0,150.0,nan,0.075"), ["flux_map.csv:5", "psi_d_Vs = nan", "finite"]),
    (changed(5, "-300.0,inf,0.024,0.075"), ["flux_map.csv:5", "iq_A = inf", "finite"]),
    (changed(5, "-300.0,150.0,0_1,0.075"), ["flux_map.csv:5", "psi_d_Vs = '0_1'", "a number"]),
    (changed(5, "-300.0,150.0,abc,0.075"), ["flux_map.csv:5", "psi_d_Vs = 'abc'", "a number"]),
    (changed(5, "-300.0,150.0,0.024"), ["flux_map.csv:5", "3 columns", "4 as in the header"]),
    (changed(5, "-300.0,150.0,,0.075"), ["flux_map.csv:5", "psi_d_Vs = ''"]),
    (with_torque("n/a"), ["flux_map.csv:5", "torque_Nm = 'n/a'", "a number"]),
    (with_torque("nan"), ["flux_map.csv:5", "torque_Nm = nan", "finite"]),
    (with_torque("-inf"), ["flux_map.csv:5", "torque_Nm = -inf", "finite"]),
    (with_torque(""), ["flux_map.csv:5", "torque_Nm = ''", "a number"]),
    (GOOD + "-300.0,150.0,0.024,0.075\n", ["flux_map.csv:22", "again, first on line 5"]),
    (without(9), ["no row with id_A = -200, iq_A = 0", "lines 7 to 10", "rectangular"]),
    (changed(9, "-200.0,1.0,0.044,0.0005"), ["no row with", "rectangular"]),
    (plane(ID[1:], IQ, straight), ["3 x 5", "at least 4 x 4"]),
    (plane(ID, IQ[:3], straight), ["4 x 3", "at least 4 x 4"]),
    (plane([-240.0, -160.0, -80.0, 0.0], IQ, straight), ["map too small", "i_max_A = 250", "-250 to 0"]),
    (plane([-300.0, -200.0, -100.0, -10.0], IQ, straight), ["map too small"]),
    (plane(ID, [-200.0, -100.0, 0.0, 100.0, 300.0], straight), ["map too small"]),
    (plane(ID, [10.0, 100.0, 200.0, 300.0], straight), ["one half", "iq_A = 0 too"]),
    (plane(ID, IQ, lambda d, q: (-0.084 + 0.2e-3 * d, 0.5e-3 * q)), ["psi_d_Vs = -0.084", "above 0"]),
    (plane(ID, IQ, lambda d, q: (0.084 - 0.2e-3 * d, 0.5e-3 * q)), ["psi_d_Vs does not rise with id_A"]),
    (plane(ID, IQ, lambda d, q: (0.084 + 0.2e-3 * d, -0.5e-3 * q)), ["psi_q_Vs does not rise with iq_A"]),
]


@pytest.mark.parametrize(("text", "words"), BAD)
def test_a_bad_map_is_refused_with_the_place(write, text, words):
    with pytest.raises(FluxtrueError) as error:
        load_motor(write(flux_map=text))
    message = str(error.value)
    assert "\n" not in message and "flux_map.csv" in message
    for word in words:
        assert word in message, message


def test_the_torques_of_a_map_are_not_used_as_long_as_they_are_numbers(write):
    assert np.array_equal(load_motor(write(flux_map=with_torque("-1e6"))).flux_map.psi_q_Vs,
                          load_motor(write(flux_map=GOOD)).flux_map.psi_q_Vs)  # fmt: skip


def test_a_map_that_is_not_there_is_named(write, folder):
    write(flux_map=GOOD)
    (folder / "flux_map.csv").unlink()
    with pytest.raises(FluxtrueError, match="flux_map.csv: no such file, named by machine.flux_map"):
        load_motor(folder)


def test_a_map_that_is_a_folder_or_no_text_is_refused(write, folder):
    write(flux_map=GOOD)
    (folder / "flux_map.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FluxtrueError, match="not UTF-8"):
        load_motor(folder)
    (folder / "flux_map.csv").unlink()
    (folder / "flux_map.csv").mkdir()
    with pytest.raises(FluxtrueError, match="cannot be read"):
        load_motor(folder)


@pytest.mark.parametrize(
    ("name", "word"), [("/dev/zero", "not a file"), (".", "not a file"), ("a\\u0000b", "machine.flux_map = ")]
)
def test_a_map_that_is_no_file_is_refused_and_not_read_for_ever(write, name, word):
    with pytest.raises(FluxtrueError, match=word):
        load_motor(write(machine={"flux_map": f'"{name}"', "ld_H": None, "lq_H": None, "psi_f_Vs": None}))
