# SPDX-License-Identifier: Apache-2.0
"""Reading, symmetrising and interpolating flux maps."""

import csv
import random

import numpy as np
import pytest
from conftest import MOTORS, plane, saturating, straight

from fluxtrue_tools.motor.flux_map import load_flux_map
from fluxtrue_tools.motor.flux_model import SplineModel
from fluxtrue_tools.motor.motor import load_motor

ID = [-280.0, -250.0, -180.0, -120.0, -60.0, -25.0, 0.0]
HALF = [0.0, 20.0, 45.0, 80.0, 130.0, 190.0, 250.0, 280.0]
FULL = [-q for q in HALF[:0:-1]] + HALF


def rows_of(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return {(float(r["id_A"]), float(r["iq_A"])): (float(r["psi_d_Vs"]), float(r["psi_q_Vs"]))
            for r in csv.DictReader(lines)}  # fmt: skip


def test_hsm1_says_what_symmetrising_removed():
    """The halves differ by at most 1.838 mVs and 21.298 mVs in the data; half of each goes."""
    path = MOTORS / "hsm1" / "flux_map.csv"
    raw = rows_of(path)
    odd_d = [(raw[d, q][0] - raw[d, -q][0]) / 2 for d, q in raw]
    even_q = [(raw[d, q][1] + raw[d, -q][1]) / 2 for d, q in raw]
    s = load_flux_map(path, 250.0).symmetry
    assert s.source == "both halves"
    assert s.psi_d_max_Vs == pytest.approx(0.000919, abs=1e-12)
    assert s.psi_q_max_Vs == pytest.approx(0.010649, abs=1e-12)
    assert s.psi_d_rms_Vs == pytest.approx(np.sqrt(np.mean(np.square(odd_d))), rel=1e-12)
    assert s.psi_q_rms_Vs == pytest.approx(np.sqrt(np.mean(np.square(even_q))), rel=1e-12)


def test_after_symmetrising_psi_d_is_even_psi_q_odd_and_zero_at_no_iq():
    m = load_flux_map(MOTORS / "hsm1" / "flux_map.csv", 250.0)
    assert np.array_equal(m.psi_d_Vs, m.psi_d_Vs[:, ::-1])
    assert np.array_equal(m.psi_q_Vs, -m.psi_q_Vs[:, ::-1])
    assert np.all(m.psi_q_Vs[:, len(m.iq_A) // 2] == 0.0)
    assert np.array_equal(m.iq_A, np.arange(-250.0, 251.0, 10.0))


def test_the_interpolation_goes_through_every_node_of_the_map():
    m = load_flux_map(MOTORS / "hsm1" / "flux_map.csv", 250.0)
    model = SplineModel(m.id_A, m.iq_A, m.psi_d_Vs, m.psi_q_Vs)
    d, q = np.meshgrid(m.id_A, m.iq_A, indexing="ij")
    # The spline solves a linear system in double: a few ulp of 0.17 Vs.
    assert np.abs(model.psi_d(d, q) - m.psi_d_Vs).max() < 1e-14
    assert np.abs(model.psi_q(d, q) - m.psi_q_Vs).max() < 1e-14


def stored(motor):
    tables = {**motor.tables.stored, **{"ref_" + k: v for k, v in motor.references.stored.items()}}
    return {name: table.tolist() for name, table in tables.items()}


def test_one_half_of_a_symmetric_map_gives_the_same_tables_as_both(write):
    both = stored(load_motor(write(flux_map=plane(ID, FULL, saturating), machine={"torque_max_Nm": 60.0})))
    for half in (HALF, [-q for q in HALF]):
        other = load_motor(write(flux_map=plane(ID, half, saturating), machine={"torque_max_Nm": 60.0}))
        assert "mirrored" in other.flux_map.symmetry.source
        assert stored(other) == both


def test_rows_may_stand_in_any_order_with_extra_columns_comments_and_blank_lines(write):
    text = plane(ID, FULL, saturating)
    head, *rows = text.splitlines()
    expected = stored(load_motor(write(flux_map=text, machine={"torque_max_Nm": 60.0})))
    random.Random(1).shuffle(rows)
    shuffled = "\n".join(["# bench 7", "", "torque_Nm," + head, *("1.5," + row for row in rows), "# end"])
    assert stored(load_motor(write(flux_map=shuffled, machine={"torque_max_Nm": 60.0}))) == expected


def test_a_straight_machine_on_a_non_uniform_map_gives_the_tables_of_its_constants(write):
    mapped = load_motor(write(flux_map=plane(ID, FULL, straight)))
    constant = load_motor(write())
    for name in ("l_d_H", "l_q_H", "l_dd_H", "l_qq_H", "psi_f0_Vs"):
        # A cubic reproduces a straight line; the division by i leaves a relative error of 1e-9.
        assert getattr(mapped.tables, name) == pytest.approx(getattr(constant.tables, name), rel=1e-9)
    for name, table in stored(constant).items():
        assert np.abs(np.array(stored(mapped)[name]) - np.array(table)).max() <= 1, name


def test_a_half_map_loses_its_psi_q_at_no_iq_openly(write):
    """psi_q(i_d, 0) = 2 mVs everywhere is an offset of the measurement: it is removed and reported."""
    text = plane(ID, HALF, lambda d, q: (saturating(d, q)[0], saturating(d, q)[1] + 0.002))
    shifted = load_motor(write(flux_map=text, machine={"torque_max_Nm": 60.0}))
    assert shifted.flux_map.symmetry.psi_q_max_Vs == pytest.approx(0.002, abs=1e-15)
    assert shifted.flux_map.symmetry.psi_q_rms_Vs == pytest.approx(0.002, abs=1e-15)
    clean = load_flux_map(write(flux_map=plane(ID, HALF, saturating)) / "flux_map.csv", 250.0)
    assert shifted.flux_map.psi_q_Vs == pytest.approx(clean.psi_q_Vs, abs=1e-15)


def test_halves_on_different_nodes_are_interpolated_onto_each_other(write):
    uneven = [-280.0, -200.0, -100.0, -30.0, 0.0, 50.0, 120.0, 200.0, 260.0]
    folder = write(flux_map=plane(ID, uneven, straight))
    flux_map = load_flux_map(folder / "flux_map.csv", 250.0)
    assert flux_map.iq_A.tolist() == [-260, -200, -120, -100, -50, -30, 0, 30, 50, 100, 120, 200, 260]
    expected = np.broadcast_to(0.5e-3 * flux_map.iq_A, flux_map.psi_q_Vs.shape)
    assert flux_map.psi_q_Vs == pytest.approx(expected, abs=1e-15)
    assert "interpolated" in flux_map.symmetry.source


def test_a_map_a_plain_spline_would_overshoot_keeps_rising_inductances(write):
    """A knee in psi_q: 2 mH up to 20 A, then 200 uH. A plain cubic spline would have a negative slope there."""

    def knee(d, q):
        bent = 2e-3 * min(abs(q), 20.0) + 2e-4 * max(abs(q) - 20.0, 0.0)
        return 0.084 + 0.2e-3 * d, bent if q > 0 else -bent

    iq = sorted({s * q for s in (-1, 1) for q in (0.0, 10.0, 20.0, 30.0, 40.0, 100.0, 180.0, 280.0)})
    m = load_flux_map(write(flux_map=plane(ID, iq, knee)) / "flux_map.csv", 250.0)
    model = SplineModel(m.id_A, m.iq_A, m.psi_d_Vs, m.psi_q_Vs)
    q = np.linspace(0, 250, 2001)
    assert np.all(np.diff(model.psi_q(-50.0, q)) > 0)


def test_shipped_hsm1_data_carry_their_licence():
    text = (MOTORS / "hsm1" / "README.md").read_text(encoding="utf-8")
    assert "Copyright (c) 2024 Lukas Hölsch" in text
    assert "Permission is hereby granted, free of charge" in text
