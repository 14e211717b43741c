# SPDX-License-Identifier: Apache-2.0
"""Iron losses become k_h and k_e of motor.toml."""

import math
import re
from pathlib import Path

import click
import numpy as np
import pytest
from conftest import HALF, L_D, POLE_PAIRS, PSI_F, psi, written

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.kinds import LossPoint
from fluxtrue_tools.motor.flux_model import ConstantModel
from fluxtrue_tools.motor.map_import import iron_loss
from fluxtrue_tools.motor.map_import.coenergy import Points, fit
from fluxtrue_tools.motor.map_import.frame import Convention

I_MAX = 250.0
K_H, K_E = 12.0, 0.009
D, Q = HALF
MODEL = fit(Points(D, Q, *psi(D, Q)), I_MAX).model
RPM = np.array([1000.0, 3000.0, 6000.0])


def losses(rpm: float) -> np.ndarray:
    """(k_h w + k_e w²)|psi|² by hand, w electrical."""
    omega = rpm * 2.0 * math.pi / 60.0 * POLE_PAIRS
    psi_d, psi_q = psi(D, Q)
    return np.asarray((K_H * omega + K_E * omega**2) * (psi_d**2 + psi_q**2))


@pytest.mark.parametrize("clock", ["Speed (rpm)", "f"])
def test_a_map_of_losses_gives_both_coefficients(tmp_path: Path, clock: str) -> None:
    d, q = np.tile(D, 3), np.tile(Q, 3)
    times = np.repeat(RPM if clock != "f" else RPM / 60.0 * POLE_PAIRS, len(D))
    path = written(
        tmp_path / "loss.csv", f"i_d,i_q,{clock},P_fe", d, q, times, np.concatenate([losses(n) for n in RPM])
    )
    chosen = ("speed=Speed (rpm)",) if clock != "f" else ()
    found = iron_loss.fit(iron_loss.read(path, chosen, Convention(), 1.0, POLE_PAIRS), MODEL, I_MAX, str(path))
    assert (found.hysteresis, found.eddy) == pytest.approx((K_H, K_E), rel=1e-3)
    assert found.max_W < 1e-3 * found.largest_W and found.share < 1e-3 and not found.assumed


def test_losses_are_turned_like_the_map(tmp_path: Path) -> None:
    """SynRM axes and rms: their d = our q, their q = -(our d)."""
    path = written(tmp_path / "loss.csv", "i_d,i_q,rpm,loss", *(np.tile(x, 3) / math.sqrt(2.0) for x in (Q, -D)),
                   np.repeat(RPM, len(D)), np.concatenate([losses(n) for n in RPM]))  # fmt: skip
    turned = iron_loss.read(path, (), Convention(current="rms", axes="synrm"), 1j, POLE_PAIRS)
    found = iron_loss.fit(turned, MODEL, I_MAX, str(path))
    assert (found.hysteresis, found.eddy) == pytest.approx((K_H, K_E), rel=1e-3)


def test_one_loss_without_current_is_shared_in_halves() -> None:
    """By hand: P = (k_h w + k_e w²) psi_f², so k_h = P/(2 w psi_f²), k_e = P/(2 w² psi_f²)."""
    model = ConstantModel(L_D, 2 * L_D, PSI_F)
    omega = 3000.0 * 2.0 * math.pi / 60.0 * POLE_PAIRS
    found = iron_loss.fit(iron_loss.from_points(((120.0, 3000.0),), POLE_PAIRS), model, I_MAX, "here")
    assert found.assumed
    assert found.hysteresis == pytest.approx(60.0 / omega / PSI_F**2)
    assert found.eddy == pytest.approx(60.0 / omega**2 / PSI_F**2)


def test_losses_that_grow_slower_than_the_speed_give_no_negative_coefficient() -> None:
    model = ConstantModel(L_D, 2 * L_D, PSI_F)
    points = iron_loss.from_points(((100.0, 1000.0), (120.0, 6000.0)), POLE_PAIRS)
    found = iron_loss.fit(points, model, I_MAX, "here")
    assert found.eddy == 0.0 and found.hysteresis > 0.0 and found.max_W > 20.0


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("i_d,i_q,loss", "0,0,5", "neither speed nor frequency, wanted: one of them; name it with --iron-loss-column"),
        ("i_d,i_q,rpm,f,loss", "0,0,1,1,5", "both speed and frequency"),
        ("rpm,P", "1000,5", "no header line with columns for loss"),
        ("rpm,loss", "1000,-5", "loss = -5 W, allowed: 0 W and above"),
        ("rpm,loss", "0,5", "no loss at a speed above 0"),
        ("i_d,i_q,rpm,loss", "900,0,1000,5", "a current up to i_max_A"),
    ],
)
def test_bad_losses_are_refused(tmp_path: Path, header: str, row: str, words: str) -> None:
    path = tmp_path / "loss.csv"
    path.write_text(f"{header}\n{row}\n", encoding="utf-8")
    with pytest.raises(FluxtrueError, match=f"loss.csv: .*{re.escape(words)}"):
        iron_loss.fit(iron_loss.read(path, (), Convention(), 1.0, POLE_PAIRS), MODEL, I_MAX, str(path))


@pytest.mark.parametrize("text", ["120", "120@", "a@b", "nan@3000", "1@2@3", "-1@3000", "1@0", "1@-3000", "1@inf"])
def test_a_bad_point_is_refused(text: str) -> None:
    with pytest.raises(FluxtrueError, match="--iron-loss-point .*: allowed: LOSS@SPEED"):
        LossPoint().convert(text, click.Option(["--iron-loss-point"]), None)


def test_a_point_is_a_loss_at_a_speed() -> None:
    assert LossPoint().meaning("120@3000") == (120.0, 3000.0)
