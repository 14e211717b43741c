# SPDX-License-Identifier: Apache-2.0
"""Every input of `motor import`, `motor check` and `motor build`, each with one error: none of them succeeds silently.

A success counts as told if a warning comes with it, or if the result is that of the input without the error. The
source is an analytic map, so that what an import should have written is known.
"""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from abused import ABUSED_LESS, LINES, MAP, MOTOR, ODD_CELLS, Content, abuse, mutated, mutated_table
from hypothesis import given
from hypothesis import strategies as st
from mutations import mutated_bytes
from samples import mat, npz

from fluxtrue_tools.motor.map_import.cli import IMPORTED

PSI_F, L_D, L_Q, POLE_PAIRS = 0.084, 2e-4, 5e-4, 4  # of MAP
OUT = [f"o/{name}" for name in IMPORTED]
CONSTANTS = MOTOR.replace('flux_map = "flux_map.csv"\n', f"psi_f_Vs = {PSI_F}\nld_H = {L_D}\nlq_H = {L_Q}\n")
IMPORT = ["motor", "import", "map.csv", "--format", "csv", "--motor", "m/motor.toml", "--out", "o"]
WRONG_MAX = 0.01  # of the largest flux linkage
Rows = list[list[float]]


def points(polar: bool, half: bool, factor: float = 1.0) -> Rows:
    """Currents, flux linkages and torque of the analytic map; polar: i_s and the angle from the d axis."""
    found = []
    for radius in (0.0, 60.0, 120.0, 180.0, 250.0, 300.0):
        for degrees in range(90, 181 if half else 271, 15):
            i = radius * np.exp(1j * math.radians(degrees))
            psi_d, psi_q = PSI_F + L_D * i.real, L_Q * i.imag
            torque = 1.5 * POLE_PAIRS * (psi_d * i.imag - psi_q * i.real)
            found.append([*((radius, float(degrees)) if polar else (i.real, i.imag)), factor * psi_d, factor * psi_q,
                          torque])  # fmt: skip
    return found


def table(rows: Rows, polar: bool, torque: bool = True, separator: str = ",") -> str:
    """A file for --format csv."""
    head = [*(("i_s", "gamma") if polar else ("i_d", "i_q")), "psi_d", "psi_q", *(["torque"] if torque else [])]
    lines = [head, *([f"{value:.10g}" for value in row[: len(head)]] for row in rows)]
    return "\n".join(separator.join(line) for line in lines) + "\n"


def told_or_right(folder: Path, text: str) -> None:
    """A warning, or the analytic map."""
    if "warning: " in text:
        return
    with (folder / "o" / "flux_map.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    inside = [row for row in rows if row["extrapolated"] == "0"]
    assert len(inside) > 30
    largest = L_Q * 250.0
    for row in inside:
        d, q = float(row["id_A"]), float(row["iq_A"])
        wrong = max(abs(float(row["psi_d_Vs"]) - PSI_F - L_D * d), abs(float(row["psi_q_Vs"]) - L_Q * q))
        assert wrong <= WRONG_MAX * largest, f"silently {1e3 * wrong:.3g} mVs wrong at {d:g}, {q:g} A"


def told(folder: Path, text: str) -> None:
    assert "warning: " in text, f"silent: {text!r}"


@st.composite
def with_wrong_number(draw: Callable[..., Any], good: str, keys: dict[str, tuple[float, ...]]) -> str:
    """A value of motor.toml that is off by a factor which no one can mean."""
    lines = good.splitlines()
    key = draw(st.sampled_from(sorted(keys)))
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{key} = "))
    value = float(lines[at].split(" = ")[1]) * draw(st.sampled_from(keys[key])) * draw(st.floats(0.7, 1.4))
    lines[at] = f"{key} = {round(value) if key == 'pole_pairs' else value!r}"
    return "\n".join(lines) + "\n"


# Factors of wrong units: milli, kilo, and what else is usual for the key.
UNITS = {"r_ohm": (1e3, 1e-3), "i_max_A": (1e3, 1e-3), "torque_max_Nm": (1e3, 1e-3), "speed_max_rpm": (1e3, 1e-3),
         "inertia_kgm2": (1e4, 1e-7), "vdc_V": (1e3, 1e-3), "pwm_hz": (1e3, 1e-3), "dead_time_s": (1e3, 1e6),
         "current_full_scale_A": (1e3, 1e-3), "r_temp_coeff_per_K": (1e2, 1e3), "psi_f_Vs": (1e3, 1e-3),
         "ld_H": (1e3, 1e6), "lq_H": (1e3, 1e6), "pole_pairs": (20.0,)}  # fmt: skip
MAPPED = {key: factors for key, factors in UNITS.items() if f"{key} = " in MOTOR}


@ABUSED_LESS
@given(with_wrong_number(CONSTANTS, UNITS))
def test_a_value_in_another_unit_is_refused_or_warned_of(text: str) -> None:
    abuse({"m/motor.toml": text}, ["motor", "check", "m"], [], inspect=told)


@ABUSED_LESS
@given(with_wrong_number(MOTOR, MAPPED))
def test_a_value_in_another_unit_beside_a_map_is_refused_or_warned_of(text: str) -> None:
    files: dict[str, Content] = {"m/motor.toml": text, "m/flux_map.csv": MAP}
    abuse(files, ["motor", "build", "m", "--out", "o", "--no-report"], ["o/motor.json"], inspect=told)


# A motor of 24 V and one of 800 V beside the one of 350 V: pole pairs, ohm, A, N·m, rpm, kg·m², V·s, H, V, Hz, s, A.
NUMBERS = ("pole_pairs", "r_ohm", "i_max_A", "torque_max_Nm", "speed_max_rpm", "inertia_kgm2", "psi_f_Vs", "ld_H",
           "lq_H", "vdc_V", "pwm_hz", "dead_time_s", "current_full_scale_A")  # fmt: skip
MACHINES = ((4, 0.02, 250.0, 100.0, 6000.0, 0.05, PSI_F, L_D, L_Q, 350.0, 1e4, 2e-6, 400.0),
            (21, 0.105, 40.0, 3.0, 2400.0, 6e-5, 2.4e-3, 30e-6, 30e-6, 24.0, 4e4, 5e-7, 60.0),
            (10, 0.016, 353.0, 500.0, 4500.0, 0.09, 0.0993, 292e-6, 315e-6, 800.0, 1e4, 2e-6, 500.0))  # fmt: skip


@st.composite
def far_from_a_machine(draw: Callable[..., Any]) -> str:
    """Up to four values of a machine moved by up to three decades, and as often a value of another key."""
    values = dict(zip(NUMBERS, draw(st.sampled_from(MACHINES)), strict=True))
    for key in draw(st.lists(st.sampled_from(NUMBERS), min_size=1, max_size=4, unique=True)):
        moved = values[key] * 10.0 ** draw(st.floats(-3.0, 3.0))
        values[key] = max(1, round(moved)) if key == "pole_pairs" else float(f"{moved:.4g}")
    more = draw(st.sampled_from(["", "", "iron_loss_eddy = 500.0", "iron_loss_hysteresis = 5000.0"]))
    lines = [f"{key} = {value!r}" for key, value in values.items()]
    at = NUMBERS.index("vdc_V")
    machine = ['name = "far"', "r_temp_coeff_per_K = 0.00393", *lines[:at], more]
    return "\n".join(["[machine]", *machine, "[inverter]", "adc_bits = 12", *lines[at:]]) + "\n"


@ABUSED_LESS
@given(far_from_a_machine())
def test_values_far_from_those_of_a_machine(text: str) -> None:
    """Most are refused, and for many of them the advice tries machines that are further away still."""
    abuse({"m/motor.toml": text}, ["motor", "check", "m"])


@st.composite
def wrong_rows(draw: Callable[..., Any], good: Rows) -> Rows:
    """One error in a table of currents and flux linkages."""
    rows = [list(row) for row in good]
    kind = draw(st.sampled_from(["unit", "sign", "offset", "swapped", "curl", "outlier", "late"]))
    column = draw(st.sampled_from([2, 3]))
    if kind == "swapped":
        return [[row[1], row[0], *row[2:]] if column == 2 else [*row[:2], row[3], row[2], *row[4:]] for row in rows]
    if kind == "outlier":
        largest = max(abs(row[column]) for row in rows)
        at = draw(LINES) % len(rows)
        rows[at][column] += draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.3, 3.0)) * largest
        return rows
    if kind == "late":  # rows of one column shifted by some lines, as with a cell that was deleted
        by = draw(st.integers(1, 5))
        values = [row[column] for row in rows]
        for row, value in zip(rows, values[by:] + values[:by], strict=True):
            row[column] = value
        return rows
    # A smaller factor makes another machine with constant inductances, as plausible as the first.
    number = draw(st.sampled_from([1e3, 1e-3, 10.0, 0.1, 9.549]) | st.floats(4.0, 20.0))
    offset = draw(st.sampled_from([-1.0, 1.0])) * draw(st.floats(0.1, 1.0)) * max(abs(row[3]) for row in rows)
    for row in rows:
        row[column] *= {"unit": number, "sign": -1.0}.get(kind, 1.0)
        row[3] += offset if kind == "offset" else 0.0
        row[2] += 2e-6 * row[1] ** 2 if kind == "curl" else 0.0
    return rows


@ABUSED_LESS
@given(wrong_rows(points(False, True)))
def test_an_error_in_an_imported_table_is_refused_told_or_undone(rows: Rows) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": table(rows, polar=False)}
    abuse(files, IMPORT, OUT, inspect=told_or_right)


GRID = [[float(cell) for cell in line.split(",")] for line in MAP.splitlines()[1:]]


@ABUSED_LESS
@given(wrong_rows(GRID))
def test_an_error_in_a_flux_map_is_refused_or_told(rows: Rows) -> None:
    text = MAP.splitlines()[0] + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)
    if rows == GRID:
        return
    abuse({"m/motor.toml": MOTOR, "m/flux_map.csv": text}, ["motor", "check", "m"], [], inspect=told)


CHOICES = {"--current": ("peak", "rms", "power"), "--flux": ("peak", "rms", "power"), "--flux-unit": ("Vs", "mVs"),
           "--convention": ("motor", "generator"), "--axes": ("pm", "synrm"), "--angle-from": ("d", "q"),
           "--angle-unit": ("deg", "rad")}  # fmt: skip


@ABUSED_LESS
@given(st.booleans(), st.booleans(), st.data())
def test_wrong_conventions_are_refused_told_or_without_effect(polar: bool, half: bool, data: st.DataObject) -> None:
    """The file has peak values and a torque."""
    wrong = data.draw(st.lists(st.sampled_from(sorted(CHOICES)), min_size=1, max_size=3, unique=True))
    arguments = [] if not polar or "--angle-from" in wrong else ["--angle-from", "d"]
    for option in wrong:
        arguments += [option, data.draw(st.sampled_from(CHOICES[option]))]
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": table(points(polar, half), polar)}
    abuse(files, [*IMPORT, *arguments], OUT, inspect=told_or_right)


@ABUSED_LESS
@given(mutated_table(table(points(True, True), True, separator=",")), st.sampled_from(["d", "q"]))
def test_a_broken_polar_table_is_refused_told_or_undone(changed: Content, axis: str) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": changed}
    abuse(files, [*IMPORT, "--angle-from", axis], OUT, inspect=told_or_right)


@ABUSED_LESS
@given(mutated(MOTOR))
def test_the_other_values_of_an_import(changed: tuple[Content, bool]) -> None:
    files: dict[str, Content] = {"m/motor.toml": changed[0], "map.csv": table(points(False, True), False)}
    abuse(files, IMPORT, OUT, changed[1])


SETS = st.tuples(
    st.sampled_from(["machine.r_ohm", "machine.i_max_A", "machine.psi_f_Vs", "machine.flux_map", "inverter.pwm_hz",
                     "machine.name", "machine.pole_pairs", "control.observer_m", "magnet.assumed_C", "nothing", "a.b",
                     "machine.iron_loss_eddy", "thermal.winding_trip_C", ""]),
    st.sampled_from([*ODD_CELLS, "4", "0.02", "true", '"x"', "[1]", "{}", "1 = 2", '"', "1979-05-27", "1\n[x]\ny=1"]),
)  # fmt: skip


@ABUSED_LESS
@given(SETS, st.sampled_from(["=", "", " = ", "=="]))
def test_values_of_an_import_on_the_command_line(pair: tuple[str, str], sign: str) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": table(points(False, True), False)}
    abuse(files, [*IMPORT, "--set", pair[0] + sign + pair[1]], OUT)


LOSSES = "speed,loss\n" + "".join(f"{n},{0.02 * n + 4e-6 * n * n:.4g}\n" for n in range(1000, 7000, 1000))
LOSS_OPTIONS = st.sampled_from([[], ["--iron-loss-column", "speed=loss"], ["--iron-loss-column", "loss=speed"],
                                ["--iron-loss-point", "120@3000"], ["--iron-loss-column", "nonsense"]])  # fmt: skip


@ABUSED_LESS
@given(mutated_table(LOSSES), LOSS_OPTIONS)
def test_tables_of_iron_losses(changed: Content, options: list[str]) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": table(points(False, True), False),
                                     "loss.csv": changed}  # fmt: skip
    abuse(files, [*IMPORT, "--iron-loss", "loss.csv", *options], OUT)


POINT = st.tuples(st.sampled_from([*ODD_CELLS, "120", "inf", "-120"]), st.sampled_from(["@", "", "@@", " @ "]),
                  st.sampled_from([*ODD_CELLS, "3000", "-3000", "inf"])).map("".join)  # fmt: skip


@ABUSED_LESS
@given(st.lists(POINT, min_size=1, max_size=3))
def test_points_of_iron_losses(given_points: list[str]) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.csv": table(points(False, True), False)}
    arguments = [part for point in given_points for part in ("--iron-loss-point", point)]
    abuse(files, [*IMPORT, *arguments], OUT)


def pyleecan_json() -> str:
    """A LUTdq as pyleecan saves it, with the operating points of MAP."""
    currents = [[1000.0, row[0] / 2**0.5, row[1] / 2**0.5] for row in GRID]
    fluxes = [[row[2] / 2**0.5, row[3] / 2**0.5, 0.0] for row in GRID]
    return json.dumps({"__class__": "LUTdq", "Phi_dqh_mean": fluxes, "OP_matrix": currents}, indent=0)


@ABUSED_LESS
@given(mutated_table(pyleecan_json()))
def test_files_of_pyleecan(changed: Content) -> None:
    files: dict[str, Content] = {"m/motor.toml": MOTOR, "map.json": changed}
    arguments = ["motor", "import", "map.json", "--format", "pyleecan", "--motor", "m/motor.toml", "--out", "o"]
    abuse(files, arguments, OUT)


@pytest.mark.parametrize("kind", ["arrays", "syre", "motulator", "pyleecan"])
def test_damaged_arrays(kind: str) -> None:
    """Half of them in NumPy's form; those in MATLAB's are read by a process of their own."""

    @ABUSED_LESS
    @given(
        mutated_bytes(npz).map(lambda changed: ("map.npz", changed[0]))
        | mutated_bytes(mat).map(lambda changed: ("map.mat", changed[0]))
    )
    def damaged(drawn: tuple[str, bytes]) -> None:
        name, content = drawn
        files: dict[str, Content] = {"m/motor.toml": MOTOR, name: content}
        options = ["--format", kind, "--motor", "m/motor.toml", "--out", "o"]
        abuse(files, ["motor", "import", name, *options], OUT)

    damaged()
