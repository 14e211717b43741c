# SPDX-License-Identifier: Apache-2.0
"""commission.txt: what was done and found."""

import math

from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.map_import.grid import Grid


def text(found: Found, known: Nameplate, grid: Grid | None) -> str:
    """The report."""
    r = found.resistance
    assert r is not None and found.first is not None
    lines = [
        f"current sensors: offset {found.offset_A.real:+.3f} A along alpha, {found.offset_A.imag:+.3f} A along beta",
        f"resistance: {1e3 * r.r_ohm:.4g} mohm, ±{1e3 * r.r_sigma_ohm:.1g} mohm beyond the sensors' gains (guessed "
        f"{1e3 * known.r_ohm:.4g} mohm)",
        f"inverter: a leg loses {r.total_V:.3g} V, {r.level_V:+.3g} V more than is compensated",
        f"inductances at small currents: {1e3 * found.first.l_d_H:.4g} mH (d), {1e3 * found.first.l_q_H:.4g} mH (q)",
    ]
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
            f"  psi_f = {known.psi_f_Vs:.4g} V·s is the nameplate's guess: it cannot be seen at standstill, and "
            "the torque of this folder is as uncertain as this guess",
        ]
    else:
        lines.append("map: not measured; inductances and psi_f of motor.toml are the nameplate's guesses")
    return "\n".join(lines) + "\n"
