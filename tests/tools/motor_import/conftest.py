# SPDX-License-Identifier: Apache-2.0
"""An invented machine with one co-energy in closed form, as points, files and settings."""

import math
import os
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: more threads than free processors slow it down

import numpy as np
import pytest
from numpy.typing import NDArray

from fluxtrue_tools.motor.map_import.run import Imported, Request, run
from fluxtrue_tools.motor.motor import Motor

ROOT = Path(__file__).resolve().parents[3]
HSM1 = ROOT / "firmware" / "motors" / "hsm1"
Array = NDArray[np.float64]
POLE_PAIRS = 4
PSI_F, L_D, FLUX, KNEE, LEAKAGE, CROSS, BEND = 0.09, 0.25e-3, 0.12, 110.0, 0.12e-3, 4e-4, -3e-7
SETTINGS = tuple(f"{key}={value}" for key, value in {
    "machine.pole_pairs": POLE_PAIRS, "machine.r_ohm": 0.012, "machine.speed_max_rpm": 8000,
    "machine.inertia_kgm2": 0.05, "inverter.vdc_V": 350, "inverter.pwm_hz": 10000,
}.items())  # fmt: skip


def psi(i_d: Array, i_q: Array) -> tuple[Array, Array]:
    """Slopes of W = psi_f d + L d²/2 + F K (sqrt(1 + (q/K)²) - 1) (1 + c d + b d²) + l q²/2, by hand."""
    root, share = np.sqrt(1.0 + (i_q / KNEE) ** 2), 1.0 + CROSS * i_d + BEND * i_d**2
    psi_d = PSI_F + L_D * i_d + FLUX * KNEE * (root - 1.0) * (CROSS + 2.0 * BEND * i_d)
    return psi_d, FLUX * (i_q / KNEE) / root * share + LEAKAGE * i_q


def torque(i_d: Array, i_q: Array) -> Array:
    psi_d, psi_q = psi(i_d, i_q)
    return np.asarray(1.5 * POLE_PAIRS * (psi_d * i_q - psi_q * i_d))


def plane(i_d: Array, i_q: Array) -> tuple[Array, Array]:
    d, q = np.meshgrid(i_d, i_q, indexing="ij")
    return d.ravel(), q.ravel()


HALF = plane(np.linspace(-250.0, 0.0, 15), np.linspace(0.0, 250.0, 15))
FULL = plane(np.linspace(-250.0, 0.0, 15), np.linspace(-250.0, 250.0, 29))


def polar(i_max_A: float = 250.0) -> tuple[Array, Array]:
    """Rings of constant current from the q axis to the negative d axis, and i_q = 0."""
    size, angle = np.meshgrid(np.linspace(0.0, i_max_A, 14), np.linspace(0.5 * math.pi, math.pi, 12))
    return (size * np.cos(angle)).ravel(), (size * np.sin(angle)).ravel()


def written(path: Path, header: str, *columns: Array) -> Path:
    """A table with commas."""
    rows = [",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


Importer = Callable[..., tuple[Imported, Motor]]


@pytest.fixture
def importer(tmp_path: Path) -> Importer:
    """`motor import` without its command line and its plot."""

    def _import(path: Path, kind: str = "csv", columns: tuple[str, ...] = (), given: tuple[str, ...] = SETTINGS,
                motor: Path | None = None, **more: object) -> tuple[Imported, Motor]:  # fmt: skip
        names = ("current", "flux", "flux_unit", "counting", "axes", "angle_from", "angle_unit")
        convention = {name: str(more.pop(name)) for name in names if name in more}
        out = tmp_path / "out"
        out.mkdir(exist_ok=True)
        request = Request(path, kind, columns, convention, given, motor, nodes=31, **more)  # type: ignore[arg-type]
        return run(request, out, out)

    return _import
