# SPDX-License-Identifier: Apache-2.0
"""A valid motor folder for tests to change, and the command line to run on it."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from in_process import fluxtrue

ROOT = Path(__file__).resolve().parents[3]
MOTORS = ROOT / "firmware" / "motors"

GOOD: dict[str, dict[str, Any]] = {
    "machine": {
        "name": '"bench"',
        "pole_pairs": 4,
        "r_ohm": 0.02,
        "r_temp_coeff_per_K": 0.00393,
        "i_max_A": 250.0,
        "torque_max_Nm": 150.0,
        "speed_max_rpm": 6000.0,
        "inertia_kgm2": 0.05,
        "ld_H": 0.2e-3,
        "lq_H": 0.5e-3,
        "psi_f_Vs": 0.084,
    },
    "inverter": {
        "vdc_V": 350.0,
        "pwm_hz": 10000.0,
        "dead_time_s": 2e-6,
        "current_full_scale_A": 400.0,
        "adc_bits": 12,
    },
}
MAPPED: dict[str, Any] = {"flux_map": '"flux_map.csv"', "ld_H": None, "lq_H": None, "psi_f_Vs": None}


def toml(changes: dict[str, dict[str, Any]]) -> str:
    """The good motor.toml with changes: {section: {key: raw TOML, or None to leave the key out}}."""
    text = []
    for section in {**GOOD, **changes}:
        keys = {**GOOD.get(section, {}), **changes.get(section, {})}
        text += [f"[{section}]", *(f"{key} = {value}" for key, value in keys.items() if value is not None)]
    return "\n".join(text) + "\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty motor folder."""
    path = tmp_path / "bench"
    path.mkdir()
    return path


@pytest.fixture
def write(folder: Path) -> Callable[..., Path]:
    """Write motor.toml with changes, and a flux map when rows are given."""

    def _write(flux_map: str | None = None, **changes: dict[str, Any]) -> Path:
        if flux_map is not None:
            changes["machine"] = {**MAPPED, **changes.get("machine", {})}
            (folder / "flux_map.csv").write_text(flux_map, encoding="utf-8")
        (folder / "motor.toml").write_text(toml(changes), encoding="utf-8")
        return folder

    return _write


@pytest.fixture
def cli() -> Callable[..., subprocess.CompletedProcess[str]]:
    """`fluxtrue motor`, finished."""

    def _run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return fluxtrue("motor", *arguments, cwd=ROOT)

    return _run


def plane(id_A: list[float], iq_A: list[float], psi: Callable[[float, float], tuple[float, float]]) -> str:
    """A flux map as CSV."""
    rows = [f"{d!r},{q!r},{psi(d, q)[0]!r},{psi(d, q)[1]!r}" for d in id_A for q in iq_A]
    return "\n".join(["id_A,iq_A,psi_d_Vs,psi_q_Vs", *rows]) + "\n"


def straight(d: float, q: float) -> tuple[float, float]:
    """A map of the constant inductances of the good machine."""
    return 0.084 + 0.2e-3 * d, 0.5e-3 * q


def saturating(d: float, q: float) -> tuple[float, float]:
    """A smooth machine with saturation and cross-saturation; psi_d is even in i_q and psi_q odd."""
    return 0.084 + 0.2e-3 * d - 2e-7 * q * q * (1 + d / 600), 0.6e-3 * q / (1 + abs(q) / 400) * (1 + d / 2500)
