# SPDX-License-Identifier: Apache-2.0
"""Flux maps of invented machines: one saturates strongly, one hardly, one is that of a car and one of a pump.

    i_d = (a_d + b_d |psi_d|^4 + c/2 |psi_d| psi_q^2) psi_d - i_f
    i_q = (a_q + b_q |psi_q|^4 + c/3 |psi_d|^3) psi_q

Both currents are slopes of one energy, so that the maps are reciprocal. The form is that of Hinkkanen et al.,
"Sensorless self-commissioning of synchronous reluctance motors at standstill without rotor locking", IEEE Trans. Ind.
Appl. 53 (2017), with a magnet as the current i_f; all numbers are our assumption.

    build/venv/bin/python tests/motors/make_maps.py       writes every flux_map.csv
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import fsolve

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Iron:
    """Coefficients in SI."""

    a_d: float
    b_d: float
    a_q: float
    b_q: float
    c: float
    psi_f_Vs: float
    i_max_A: float

    def currents(self, psi_d: float, psi_q: float) -> tuple[float, float]:
        """The formulas above."""
        magnet = (self.a_d + self.b_d * self.psi_f_Vs**4) * self.psi_f_Vs
        i_d = (self.a_d + self.b_d * psi_d**4 + self.c / 2.0 * abs(psi_d) * psi_q**2) * psi_d - magnet
        i_q = (self.a_q + self.b_q * psi_q**4 + self.c / 3.0 * abs(psi_d) ** 3) * psi_q
        return i_d, i_q


MACHINES = {
    "saturated": Iron(a_d=3000.0, b_d=9.1e6, a_q=1250.0, b_q=3.7e6, c=8e5, psi_f_Vs=0.09, i_max_A=300.0),
    "linear": Iron(a_d=5600.0, b_d=5e6, a_q=4500.0, b_q=5e6, c=1e5, psi_f_Vs=0.05, i_max_A=250.0),
    "leaf": Iron(a_d=4200.0, b_d=8e6, a_q=1300.0, b_q=1.2e6, c=3e5, psi_f_Vs=0.075, i_max_A=480.0),
    "pmsyrm": Iron(a_d=50.0, b_d=150.0, a_q=6.0, b_q=8.0, c=14.0, psi_f_Vs=0.45, i_max_A=20.0),
}


def rows(iron: Iron) -> list[tuple[float, float, float, float]]:
    """i_d, i_q, psi_d, psi_q over i_d <= 0 <= i_q, both to i_max; each start is the neighbour's answer."""
    grid = np.linspace(0.0, iron.i_max_A, 26)
    table = []
    for i_q in grid:
        psi = np.array([iron.psi_f_Vs, i_q / (iron.a_q + 1000.0)])
        for i_d in -grid:
            wanted = (i_d, i_q)
            psi = fsolve(lambda x, w=wanted: np.subtract(iron.currents(*x), w), psi, xtol=1e-12)
            if np.abs(np.subtract(iron.currents(*psi), wanted)).max() > 1e-6:
                raise ValueError(f"i_d = {i_d:g}, i_q = {i_q:g}: no flux found")
            table.append((i_d + 0.0, i_q, float(psi[0]), float(psi[1])))
    return table


def text(name: str) -> str:
    """flux_map.csv."""
    lines = [f"{d:g},{q:g},{psi_d:.9f},{abs(psi_q):.9f}" for d, q, psi_d, psi_q in rows(MACHINES[name])]
    return "\n".join(["# made by tests/motors/make_maps.py", "id_A,iq_A,psi_d_Vs,psi_q_Vs", *lines]) + "\n"


if __name__ == "__main__":
    for machine in MACHINES:
        (FOLDER / machine / "flux_map.csv").write_text(text(machine), encoding="utf-8")
