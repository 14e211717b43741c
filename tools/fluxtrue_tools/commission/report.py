# SPDX-License-Identifier: Apache-2.0
"""commission.txt: what was done and found."""

import math
from typing import Final

from fluxtrue_tools.commission import iron
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.drag import coupled, inertia_text
from fluxtrue_tools.commission.harmonics import LARGE_RAD, SIGMAS, Harmonics, Wave
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.map_import.grid import Grid

OFTEN: Final = {1: "once", 2: "twice"}


def _wave(wave: Wave, order: int) -> str:
    amplitude, sigma = math.degrees(abs(wave.value_rad)), math.degrees(wave.sigma_rad)
    said = f"{OFTEN[order]} per turn {amplitude:.2f} ±{sigma:.1g} degrees"
    place = f", most {math.degrees(wave.phase_rad) / order:.0f} degrees after its zero"
    return said + (place if amplitude > SIGMAS * sigma else "")


def _harmonics(found: Harmonics | None) -> list[str]:
    if found is None:
        return ["  harmonics of the angle sensor: not measured"]
    waves = "; ".join(_wave(wave, order) for order, wave in ((1, found.first), (2, found.second)))
    further, sigma = (math.degrees(abs(rad)) for rad in (found.further.value_rad, found.further.sigma_rad))
    lines = [f"  harmonics of the angle sensor, electrical amplitudes: {waves}; three and four times per turn at most "
             f"{further:.2f} ±{sigma:.1g} degrees"]  # fmt: skip
    if not found.is_measured:
        lines.append("  their uncertainty is that of the nameplate's inertia; the step drag measures it")
    if found.is_large:
        lines.append(f"  the angle sensor is uneven by more than {math.degrees(LARGE_RAD):.0f} electrical degrees: "
                     "check how it is mounted (centred, parallel to the shaft, at the right distance, away from "
                     "magnetic fields), and measure again")  # fmt: skip
    return lines


def _dc_zero(zero: DcZero) -> str:
    if zero.unknown:
        return (f"dc-voltage sensor: offset not found, {zero.subtracted_V:+.3g} V as before: {zero.unknown}; compare "
                "the dc voltage with a voltmeter")  # fmt: skip
    return f"dc-voltage sensor: offset {zero.value_V:+.3f} V, ±{zero.sigma_V:.1g} V ({zero.how})"


def _turning(found: Found, known: Nameplate) -> list[str]:
    lines = []
    if found.followed is not None:
        wiring = found.spun.connection if found.spun is not None else found.followed.connection
        way = "against" if wiring.reversed else "with"
        lines.append(f"connection: {wiring.pole_pairs} pole pairs; the angle sensor counts {way} the field; electrical "
                     f"angle {math.degrees(wiring.offset_rad):.2f} degrees at its zero; the rotor followed "
                     f"{found.followed.current_A:.3g} A")  # fmt: skip
    if found.spun is not None:
        spun, degrees = found.spun, math.degrees(found.spun.offset_sigma_rad)
        lines.append(f"magnet: psi_f = {spun.psi_f_Vs:.4g} V·s, ±{spun.psi_f_sigma_Vs:.1g} V·s beyond the sensors' "
                     f"gains; offset of the angle ±{degrees:.1g} degrees; the angle is late by "
                     f"{1e6 * spun.lag_s:.1f} us")  # fmt: skip
        lines += _harmonics(spun.harmonics)
    if found.drag is not None:
        at, guess = found.drag, known.inertia_kgm2
        inertia, sigma = (inertia_text(each, digits, at.inertia_kgm2)
                          for each, digits in ((at.inertia_kgm2, 4), (at.inertia_sigma_kgm2, 1)))  # fmt: skip
        ends = ", ".join(f"{torque_Nm:.3g} ±{sigma_Nm:.1g} N·m at {30.0 * w / math.pi:.0f} rpm"
                         for w, torque_Nm, sigma_Nm in at.shown())  # fmt: skip
        lines.append(f"inertia: {inertia}, ±{sigma} (guessed for a rotor of this nameplate: {inertia_text(guess, 2)}); "
                     f"drag {ends}; ± by the noise")  # fmt: skip
        if warned := coupled(at, known):
            lines.append(f"  {warned}")
    return lines


def _levels(found: Found, known: Nameplate) -> list[str]:
    r = found.resistance
    if r is None or found.first is None:
        return []
    l_d_H, l_q_H = found.first.found_H
    knee = f"; half of it at a knee of {r.knee_A:.2g} A" if r.knee_A > 0.0 else ""
    return [
        f"resistance: {1e3 * r.r_ohm:.4g} mohm, ±{1e3 * r.r_sigma_ohm:.1g} mohm beyond the sensors' gains (guessed "
        f"{1e3 * known.r_ohm:.4g} mohm)",
        f"inverter: a leg loses {r.total_V:.3g} V, {r.level_V:+.3g} V more than is compensated{knee}",
        f"inductances at small currents: {1e3 * l_d_H:.3g} mH (d), {1e3 * l_q_H:.3g} mH (q)",
    ]


def _balance(found: Found) -> list[str]:
    if found.balance is None:
        return []
    gains = ", ".join(f"{phase} {100 * gain:+.2f} %" for phase, gain in zip("abc", found.balance.gains, strict=True))
    return [f"  gains of the current sensors against their mean: {gains}, ±{100 * found.balance.sigma:.1g} %"]


def _magnet(found: Found, known: Nameplate) -> list[str]:
    if found.spun is not None:
        return []
    said = f"given ({known.psi_f_source})" if known.psi_f_source else "the nameplate's guess"
    return [
        f"  psi_f = {known.psi_f_Vs:.4g} V·s is {said}: it cannot be seen at standstill, and "
        "the torque of this folder is as uncertain as this value",
    ]


def _iron(found: Found, known: Nameplate) -> list[str]:
    if found.spun is None or found.surface is None:
        return []
    loss = iron.measure(found.spun, found.surface.with_magnet(known.psi_f_Vs), known.i_max_A)
    if loss is None:
        return ["  iron loss: none seen, or hidden by a lag of the angle sensor"]
    rpm = loss.omega_rad_s * 30.0 / math.pi / known.pole_pairs
    return [f"  iron loss: k_h + k_e w = {loss.per_flux:.3g} W/(rad/s V^2 s^2) at {rpm:.0f} rpm, ±{loss.sigma:.1g}; "
            "half of it is assumed to be hysteresis"]  # fmt: skip


def text(found: Found, known: Nameplate, grid: Grid | None) -> str:
    """The report."""
    lines = [
        f"current sensors: offset {found.offset_A.real:+.3f} A along alpha, {found.offset_A.imag:+.3f} A along beta, "
        f"±{found.offset_sigma_A:.1g} A",
        _dc_zero(found.dc_zero),
    ]
    lines += _turning(found, known) + _levels(found, known)
    if found.surface is not None and grid is not None:
        moved = sum(bool(raw.failure) for raw in found.bursts)
        lines += [
            f"map: {len(found.bursts)} bursts, {sum(len(raw.i) for raw in found.bursts)} periods; largest current "
            f"{found.largest_A:.4g} A of {known.i_max_A:g} A",
            f"  the rotor moved by up to {math.degrees(found.moved_rad):.1f} electrical degrees; {moved} bursts ended "
            "early",
            f"  left of the flux linkages: {1e3 * found.surface.left_Vs:.2g} mV·s; "
            f"{found.surface.unknowns:.0f} effective unknowns",
            f"  no samples in {100 * grid.circle_outside:.2g} % of the current circle: continued by the surface",
            *_iron(found, known),
            *_balance(found),
            *_magnet(found, known),
        ]
    else:
        lines.append("map: not measured; the inductances of motor.toml are the nameplate's guesses")
    return "\n".join(lines) + "\n"
