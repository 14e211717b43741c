# SPDX-License-Identifier: Apache-2.0
"""What a step has found, as the rows of its card: quantity, value, uncertainty and bound."""

import math
from typing import Final

import numpy as np

from fluxtrue_tools.commission import plan
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found

TITLES: Final = {"offsets": "Current sensors at rest", "resistance": "Resistance and inverter", "map": "Flux map"}
# What tests/commission requires of hidden machines.
OFFSET_SHARE, R_SHARE, MAP_SHARE, GAIN_SHARE = 0.001, 0.01, 0.01, 0.002

Row = tuple[str, str, str, str]  # what, found, ±, bound


def _offsets(found: Found, _: Nameplate, full_scale_A: float) -> list[Row]:
    sigma, bound = f"{found.offset_sigma_A:.2g} A", f"± at most {OFFSET_SHARE * full_scale_A:.2g} A"
    return [(f"Offset along {axis}", f"{value:+.3f} A", sigma, bound)
            for axis, value in (("alpha", found.offset_A.real), ("beta", found.offset_A.imag))]  # fmt: skip


def _resistance(found: Found, known: Nameplate, _: float) -> list[Row]:
    r, first = found.resistance, found.first
    assert r is not None and first is not None
    rows = [
        ("Resistance, beyond the sensors' gains", f"{1e3 * r.r_ohm:.4g} mΩ", f"{1e3 * r.r_sigma_ohm:.1g} mΩ",
         f"± at most {1e3 * R_SHARE * r.r_ohm:.2g} mΩ"),
        ("Guess of the nameplate", f"{1e3 * known.r_ohm:.4g} mΩ", "", ""),
        ("Voltage that a leg of the inverter loses", f"{r.total_V:.3g} V", "", ""),
        ("of which the nameplate did not know", f"{r.level_V:+.3g} V", "", ""),
        ("L_d at small currents", f"{1e3 * first.l_d_H:.4g} mH", "", ""),
        ("L_q at small currents", f"{1e3 * first.l_q_H:.4g} mH", "", ""),
    ]  # fmt: skip
    return rows + _gains(found)


def _gains(found: Found) -> list[Row]:
    if found.balance is None:
        return []
    sigma = f"{100.0 * found.balance.sigma:.1g} %"
    return [(f"Gain of sensor {phase} against the mean", f"{100.0 * gain:+.2f} %", sigma,
             f"± at most {100.0 * GAIN_SHARE:.1f} %")
            for phase, gain in zip("abc", found.balance.gains, strict=True)]  # fmt: skip


def _largest_Vs(found: Found) -> float:
    """The largest flux linkage of the samples."""
    assert found.surface is not None
    return max(float(np.abs(psi).max()) for psi in found.surface.psi)


def _map(found: Found, known: Nameplate, _: float) -> list[Row]:
    surface = found.surface
    assert surface is not None
    failed = [raw.failure for raw in found.bursts if raw.failure]
    largest_Vs = _largest_Vs(found)
    return [
        ("Largest flux linkage; ± of the samples", f"{1e3 * largest_Vs:.4g} mV·s",
         f"{1e3 * surface.left_Vs:.2g} mV·s", f"± at most {1e3 * MAP_SHARE * largest_Vs:.2g} mV·s"),
        ("Largest current", f"{found.largest_A:.4g} A", "", f"at most {known.i_max_A:g} A"),
        ("Movement of the rotor, electrical", f"{math.degrees(found.moved_rad):.1f}°", "",
         f"a burst ends beyond {known.swing_deg:g}°"),
        ("Bursts that ended early", f"{len(failed)} of {len(found.bursts)}", "", f"at most {plan.LOST_MAX} lost"),
        *_gains(found),
    ]  # fmt: skip


def rows(step: str, found: Found, known: Nameplate, full_scale_A: float) -> list[Row]:
    """Of one step."""
    return {"offsets": _offsets, "resistance": _resistance, "map": _map}[step](found, known, full_scale_A)
