# SPDX-License-Identifier: Apache-2.0
"""What a step has found, as the rows of its card: quantity, value, uncertainty and bound."""

import math
from typing import Final

import numpy as np

from fluxtrue_tools.commission import connection, plan
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.drag import coupled, inertia_text
from fluxtrue_tools.commission.harmonics import LARGE_RAD, Harmonics
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found

TITLES: Final = {"offsets": "Sensors at rest", "phases": "Leads, angle sensor and pole pairs",
                 "spin": "Angle offset and magnet", "drag": "Inertia and drag",
                 "resistance": "Resistance and inverter", "map": "Flux map"}  # fmt: skip
# What tests/commission requires of hidden machines.
OFFSET_SHARE, R_SHARE, MAP_SHARE, GAIN_SHARE, L_SHARE = 0.001, 0.01, 0.01, 0.002, 0.2
ANGLE_DEG, HARMONIC_DEG, PSI_SHARE, INERTIA_SHARE, DRAG_SHARE = 0.2, 0.2, 0.005, 0.03, 0.1

Row = tuple[str, str, str, str]  # what, found, ±, bound


def _dc_zero(zero: DcZero, known: Nameplate) -> list[Row]:
    if zero.unknown:
        return [("Offset of the dc-voltage sensor", f"not found: {zero.unknown}", "", "")]
    return [("Offset of the dc-voltage sensor", f"{zero.value_V:+.3f} V", f"{zero.sigma_V:.2g} V",
             f"± at most {OFFSET_SHARE * known.v_dc_full_scale_V:.2g} V")]  # fmt: skip


def _offsets(found: Found, known: Nameplate, full_scale_A: float) -> list[Row]:
    sigma, bound = f"{found.offset_sigma_A:.2g} A", f"± at most {OFFSET_SHARE * full_scale_A:.2g} A"
    currents = [(f"Offset along {axis}", f"{value:+.3f} A", sigma, bound)
                for axis, value in (("alpha", found.offset_A.real), ("beta", found.offset_A.imag))]  # fmt: skip
    return [*currents, *_dc_zero(found.dc_zero, known)]


def _way(is_reversed: bool) -> str:
    return "against the field" if is_reversed else "with the field"


def _phases(found: Found, known: Nameplate, _: float) -> list[Row]:
    assert found.followed is not None
    followed = found.followed
    wired, behind_deg = followed.connection, math.degrees(followed.behind_rad)
    return [
        ("Pole pairs", f"{wired.pole_pairs}", "", f"measured {abs(followed.pole_pairs):.3f}, at most "
         f"{connection.WHOLE} from a whole number"),
        ("Pole pairs of the nameplate", f"{known.pole_pairs}", "", ""),
        ("The angle sensor counts", _way(wired.reversed), "", ""),
        ("Electrical angle at its zero", f"{math.degrees(wired.offset_rad):.1f}°", "", "the next step refines it"),
        ("The rotor followed a current of", f"{followed.current_A:.3g} A", "", ""),
        ("Rotor behind the current, rms, electrical", f"{behind_deg:.1f}°", "",
         f"at most {math.degrees(connection.BEHIND_RAD):.0f}°"),
    ]  # fmt: skip


def _harmonics(found: Harmonics | None) -> list[Row]:
    if found is None:
        return [("Harmonics of the angle sensor", "not measured", "", "")]
    bound = f"± at most {HARMONIC_DEG:g}°" if found.is_measured else "better with the inertia, a step later"
    names = (
        "Harmonic of the angle sensor once per turn, electrical",
        "Harmonic of the angle sensor twice per turn, electrical",
        "The larger of three and four times per turn",
    )
    rows = [(name, f"{math.degrees(abs(wave.value_rad)):.2f}°", f"{math.degrees(wave.sigma_rad):.1g}°", bound)
            for name, wave in zip(names, (found.first, found.second, found.further), strict=True)]  # fmt: skip
    if found.is_large:
        rows.append(("Check how the angle sensor is mounted", f"more than {math.degrees(LARGE_RAD):.0f}°", "", ""))
    return rows


def _spin(found: Found, known: Nameplate, _: float) -> list[Row]:
    assert found.spun is not None
    spun = found.spun
    rpm = 30.0 / math.pi * spun.omega_rad_s / spun.connection.pole_pairs
    return [
        ("Magnet ψ_f, beyond the gain of the dc voltage", f"{1e3 * spun.psi_f_Vs:.4g} mV·s",
         f"{1e3 * spun.psi_f_sigma_Vs:.1g} mV·s", f"± at most {1e3 * PSI_SHARE * spun.psi_f_Vs:.2g} mV·s"),
        ("Magnet ψ_f before this step", f"{1e3 * known.psi_f_Vs:.4g} mV·s", "", ""),
        ("Electrical angle at the sensor's zero", f"{math.degrees(spun.connection.offset_rad):.2f}°",
         f"{math.degrees(spun.offset_sigma_rad):.1g}°", f"± at most {ANGLE_DEG:g}°"),
        ("The angle is late by", f"{1e6 * spun.lag_s:.1f} µs", "", ""),
        *_harmonics(spun.harmonics),
        ("Speed of the measurement", f"{rpm:.0f} rpm", "", "both directions"),
    ]  # fmt: skip


def _drag(found: Found, known: Nameplate, _: float) -> list[Row]:
    assert found.drag is not None
    drag = found.drag
    inertia, sigma, bound = (inertia_text(each, digits, drag.inertia_kgm2)
                             for each, digits in ((drag.inertia_kgm2, 4), (drag.inertia_sigma_kgm2, 1),
                                                  (INERTIA_SHARE * drag.inertia_kgm2, 2)))  # fmt: skip
    rows = [("Inertia", inertia, sigma, f"± at most {bound}"),
            ("Guess for a rotor of this nameplate", inertia_text(known.inertia_kgm2, 2), "", "")]  # fmt: skip
    if warned := coupled(drag, known):
        rows.append(("Check that the shaft is free", warned, "", ""))
    for speed, torque_Nm, sigma_Nm in drag.shown():
        rows.append((f"Drag at {30.0 / math.pi * speed:.0f} rpm", f"{torque_Nm:.3g} N·m", f"{sigma_Nm:.1g} N·m",
                     f"± at most {DRAG_SHARE * torque_Nm:.1g} N·m"))  # fmt: skip
    return rows + (_harmonics(found.spun.harmonics) if found.spun is not None else [])


def _resistance(found: Found, known: Nameplate, _: float) -> list[Row]:
    r, first = found.resistance, found.first
    assert r is not None and first is not None
    l_d_H, l_q_H = first.found_H
    rows = [
        ("Resistance, beyond the sensors' gains", f"{1e3 * r.r_ohm:.4g} mΩ", f"{1e3 * r.r_sigma_ohm:.1g} mΩ",
         f"± at most {1e3 * R_SHARE * r.r_ohm:.2g} mΩ"),
        ("Guess of the nameplate", f"{1e3 * known.r_ohm:.4g} mΩ", "", ""),
        ("Voltage that a leg of the inverter loses", f"{r.total_V:.3g} V", "", ""),
        ("of which the nameplate did not know", f"{r.level_V:+.3g} V", "", ""),
        ("L_d at small currents", f"{1e3 * l_d_H:.3g} mH", "", f"± at most {100.0 * L_SHARE:.0f} %"),
        ("L_q at small currents", f"{1e3 * l_q_H:.3g} mH", "", f"± at most {100.0 * L_SHARE:.0f} %"),
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
    return {"offsets": _offsets, "phases": _phases, "spin": _spin, "drag": _drag, "resistance": _resistance,
            "map": _map}[step](found, known, full_scale_A)  # fmt: skip
