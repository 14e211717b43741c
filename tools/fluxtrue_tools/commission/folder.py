# SPDX-License-Identifier: Apache-2.0
"""The motor's folder: what was measured with its source, everything else as the nameplate's folder has it."""

import json
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools import strict
from fluxtrue_tools.commission import iron
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.iron import Iron
from fluxtrue_tools.commission.levels import Resistance
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.map_import.coenergy import Points
from fluxtrue_tools.motor.map_import.folder import MAP, SOURCES, flux_map_csv, name_from
from fluxtrue_tools.motor.map_import.grid import Grid, make_grid
from fluxtrue_tools.motor.motor import Motor, load_motor
from fluxtrue_tools.motor.names import FILE_NAME
from fluxtrue_tools.motor.references import Solver

NODES = 31
TORQUE_GUESSED = 0.95  # of what the magnet gives
TORQUE_SHARE = 0.98  # of what the map gives
DC_DIGITS = 4  # after the point, V
BY = "measured by fluxtrue commission"


@dataclass(frozen=True)
class Entry:
    """A value with where it came from."""

    value: Any
    source: str


def _points(found: Found) -> Points:
    """Where bursts have been, for the part of the map that lies beyond."""
    i = np.concatenate([raw.i for raw in found.bursts])
    return Points(i.real, i.imag, i.real, i.imag)


def _of_the_map(found: Found, known: Nameplate, staging: Path, entries: dict[str, dict[str, Entry]]) -> Grid:
    assert found.surface is not None
    surface, machine = found.surface, entries["machine"]
    model = surface.with_magnet(known.psi_f_Vs)
    grid = make_grid(model, _points(found), known.i_max_A, NODES, staging)
    magnet = "coasting" if found.spun is not None else known.psi_f_source or "the nameplate"
    title = f"{BY}: one co-energy through voltage pulses; psi_d without current is that of {magnet}"
    (staging / MAP).write_text(flux_map_csv(grid, title), encoding="utf-8")
    for key in SOURCES:
        machine.pop(key, None)
    left = 1e3 * surface.left_Vs
    machine["flux_map"] = Entry(
        MAP,
        f"{BY}: voltage pulses at standstill, ±{left:.2g} mV·s; the magnet's {known.psi_f_Vs:.4g} V·s "
        + (
            f"by coasting, ±{found.spun.psi_f_sigma_Vs:.1g} V·s"
            if found.spun is not None
            else f"is given ({known.psi_f_source}): standstill does not show it"
            if known.psi_f_source
            else "is the nameplate's guess: standstill does not show it"
        ),
    )
    top = Solver(model, known.pole_pairs, known.i_max_A).torque_top_Nm
    machine["torque_max_Nm"] = Entry(float(f"{strict.down(TORQUE_SHARE * top):.4g}"), "from this map")
    return grid


def _entries(nameplate: Path, out: Path) -> dict[str, dict[str, Entry]]:
    data = tomllib.loads(strict.read_text(nameplate / FILE_NAME))
    entries = {
        section: {key: Entry(value, "nameplate") for key, value in keys.items()} for section, keys in data.items()
    }
    entries["machine"]["name"] = Entry(name_from(out), "")
    return entries


def _text(entries: dict[str, dict[str, Entry]]) -> str:
    lines = []
    for section, keys in entries.items():
        lines.append(f"[{section}]")
        for key, entry in keys.items():
            shown = json.dumps(entry.value, ensure_ascii=False) if isinstance(entry.value, str) else repr(entry.value)
            lines.append(f"{key} = {shown}" + (f"   # {entry.source}" if entry.source else ""))
        lines.append("")
    return "\n".join(lines)


def write(found: Found, known: Nameplate, nameplate: Path, staging: Path, out: Path) -> tuple[Grid | None, Motor]:
    """motor.toml and flux_map.csv; what motor build would refuse is refused here."""
    if found.resistance is None and found.followed is None:
        raise FluxtrueError("commission: nothing for a motor's folder was measured: wanted: --step all, phases, "
                            "resistance or map")  # fmt: skip
    entries = _entries(nameplate, out)
    _of_the_dc_zero(found.dc_zero, entries["inverter"])
    _of_the_turning(found, known, entries["machine"])
    if found.resistance is not None:
        _of_the_levels(found.resistance, entries)
    grid = _of_the_map(found, known, staging, entries) if found.surface is not None else None
    if found.spun is not None and found.surface is not None:
        _of_the_iron(iron.measure(found.spun, found.surface.with_magnet(known.psi_f_Vs), known.i_max_A), entries)
    (staging / FILE_NAME).write_text(_text(entries), encoding="utf-8")
    return grid, load_motor(staging)


def _of_the_dc_zero(zero: DcZero, inverter: dict[str, Entry]) -> None:
    if not zero.unknown:
        source = f"{BY}: {zero.how}, ±{zero.sigma_V:.1g} V"
        inverter["v_dc_offset_V"] = Entry(round(zero.value_V, DC_DIGITS), source)


def _of_the_turning(found: Found, known: Nameplate, machine: dict[str, Entry]) -> None:
    """Pole pairs, magnet, inertia; without a map the inductances stay guesses."""
    if found.followed is not None:
        machine["pole_pairs"] = Entry(found.followed.connection.pole_pairs, f"{BY}: the rotor followed a current that "
                                      f"turned slowly, {abs(found.followed.pole_pairs):.2f} not rounded")  # fmt: skip
    if found.spun is not None:
        sigma = f"±{found.spun.psi_f_sigma_Vs:.1g} V·s; gain of the dc voltage not included"
        machine["psi_f_Vs"] = Entry(float(f"{found.spun.psi_f_Vs:.4g}"), f"{BY}: coasting, {sigma}")
    if found.followed is not None:  # replaced when a map is known
        torque_Nm = TORQUE_GUESSED * 1.5 * known.pole_pairs * known.psi_f_Vs * known.i_max_A
        machine["torque_max_Nm"] = Entry(float(f"{torque_Nm:.4g}"), "of the magnet alone")
    if found.drag is not None:
        machine["inertia_kgm2"] = Entry(float(f"{found.drag.inertia_kgm2:.4g}"), f"{BY}: acceleration and run-down, "
                                        f"±{found.drag.inertia_sigma_kgm2:.1g} kg m^2; gains of the sensors not "
                                        "included")  # fmt: skip


def _of_the_iron(found: Iron | None, entries: dict[str, dict[str, Entry]]) -> None:
    if found is None:
        return
    rpm = found.omega_rad_s * 30.0 / math.pi / entries["machine"]["pole_pairs"].value
    share = found.sigma / found.per_flux
    source = f"{BY}: coasting at {rpm:.0f} rpm, ±{100 * share:.1g} %, half of the loss there, assumed"
    entries["machine"]["iron_loss_hysteresis"] = Entry(float(f"{found.hysteresis:.4g}"), source)
    entries["machine"]["iron_loss_eddy"] = Entry(float(f"{found.eddy:.4g}"), "the other half")
    entries.setdefault("identification", {})["iron_loss_uncertainty"] = Entry(
        iron.UNCERTAINTY, "one speed does not show how much of the loss is hysteresis")  # fmt: skip


def _of_the_levels(r: Resistance, entries: dict[str, dict[str, Entry]]) -> None:
    entries["machine"]["r_ohm"] = Entry(float(f"{r.r_ohm:.4g}"), f"{BY}: direct currents, ±{r.r_sigma_ohm:.1g} ohm; "
                                        "gains of the sensors not included")  # fmt: skip
    dead_time = r.dead_time_s(entries["inverter"]["vdc_V"].value, entries["inverter"]["pwm_hz"].value)
    entries["inverter"]["dead_time_s"] = Entry(float(f"{dead_time:.3g}"), f"{BY}: with the drop of a leg, "
                                               f"{r.total_V:.3g} V at this dc voltage")  # fmt: skip
    entries["inverter"].pop("device_drop_V", None)
