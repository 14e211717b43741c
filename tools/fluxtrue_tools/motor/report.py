# SPDX-License-Identifier: Apache-2.0
"""The report as text: input, changes, accuracy of the tables."""

from dataclasses import asdict

import numpy as np

from fluxtrue_tools.bus.scales import QUANTITIES, carriers, standard_factors
from fluxtrue_tools.motor import doubts
from fluxtrue_tools.motor.demagnetisation import demagnetisation_lines
from fluxtrue_tools.motor.load import load_lines
from fluxtrue_tools.motor.loop_report import model_lines
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.names import DBC_NAME
from fluxtrue_tools.motor.short_circuit import ShortCircuit, short_circuit, used_from_rpm

Lines = list[str]
SHORTED_AT = (0.05, 0.1, 0.25, 0.5, 0.75, 1.0)  # of top speed


def _percent(value: float) -> str:
    return f"{100 * value:.2f} %"


def _machine(motor: Motor) -> Lines:
    machine, inverter = motor.config.machine, motor.config.inverter
    flux = "constants" if motor.flux_map is None else f"map {machine.flux_map}"
    l_d, l_q = float(motor.model.psi_d(0.0, 0.0, nd=1)), float(motor.model.psi_q(0.0, 0.0, nq=1))
    pairs = "1 pole pair" if machine.pole_pairs == 1 else f"{machine.pole_pairs} pole pairs"
    return [
        f"motor {machine.name}: {pairs}, {flux}",
        f"  at no current      psi_f {1e3 * motor.derived.psi_f_Vs:.2f} mV·s, L_d {1e6 * l_d:.0f} µH, "
        f"L_q {1e6 * l_q:.0f} µH, R {1e3 * machine.r_ohm:g} mΩ (20 °C)",
        f"  limits             {machine.i_max_A:g} A, {machine.torque_max_Nm:g} N·m "
        f"({motor.solver.torque_top_Nm:.4g} N·m possible at this current), {machine.speed_max_rpm:g} rpm",
        f"  inverter           {inverter.vdc_V:g} V, {inverter.pwm_hz:g} Hz, "
        f"dead time {1e6 * inverter.dead_time_s:g} µs, "
        f"current full scale {inverter.current_full_scale_A:g} A, {inverter.adc_bits} bits, "
        f"over-current trip {motor.derived.i_trip_A:g} A",
    ]


def _map(motor: Motor) -> Lines:
    flux_map = motor.flux_map
    if flux_map is None:
        return ["flux map: none, constant inductances"]
    s = flux_map.symmetry
    preserved = getattr(motor.model, "shape_preserving", False)
    how = (
        "shape-preserving cubics (a plain cubic spline would overshoot this map)"
        if preserved
        else "bicubic spline through every node, monotone between them too"
    )
    lines = [
        f"flux map: {len(flux_map.id_A)} x {len(flux_map.iq_A)} nodes after symmetrising, id {flux_map.id_A[0]:g} ... "
        f"{flux_map.id_A[-1]:g} A, iq {flux_map.iq_A[0]:g} ... {flux_map.iq_A[-1]:g} A",
        f"  covered            {s.source}",
        f"  removed            psi_d max {1e3 * s.psi_d_max_Vs:.3f} mV·s, rms {1e3 * s.psi_d_rms_Vs:.3f} mV·s "
        "(odd part in i_q)",
        f"                     psi_q max {1e3 * s.psi_q_max_Vs:.3f} mV·s, rms {1e3 * s.psi_q_rms_Vs:.3f} mV·s "
        f"({'even part in i_q' if s.source.startswith('both') else 'its value at i_q = 0, per i_d'})",
        f"  interpolation      {how}",
    ]
    if flux_map.marked[0]:
        lines.append(
            f"  extrapolated       {flux_map.marked[0]} of {flux_map.marked[1]} rows, marked when it was imported"
        )
    if flux_map.id_A[-1] < motor.tables.id_A[-1]:
        lines.append(
            f"  extended           to id = {motor.tables.id_A[-1]:g} A, one table node, along the edge's slope"
        )
    return lines


def _tables(motor: Motor) -> Lines:
    t, e, torque_max = motor.tables, motor.table_error, motor.config.machine.torque_max_Nm
    return [
        f"flux tables: {len(t.stored)} of {len(t.id_A)} x {len(t.iq_A)} nodes every {t.iq_A[1]:g} A, "
        f"inductances to 2^{t.l_shift} L_b",
        f"  error against map  torque max {e.torque_max_Nm:.3g} N·m "
        f"({_percent(e.torque_max_Nm / torque_max)} of torque_max), "
        f"rms {e.torque_rms_Nm:.3g} N·m (firmware look-up, i_max circle)",
        f"                     psi_d max {1e3 * e.psi_d_max_Vs:.3f} mV·s, psi_q max {1e3 * e.psi_q_max_Vs:.3f} mV·s",
    ]


def _references(motor: Motor) -> Lines:
    r, e, torque_max = motor.references, motor.reference_errors, motor.config.machine.torque_max_Nm
    reach = float(motor.limits.psi_min_Vs[0])
    lines = [
        f"current references: {len(r.torque_Nm)} x {len(r.psi_Vs)} nodes, every {r.torque_Nm[1]:.3g} N·m and "
        f"{1e3 * (r.psi_Vs[1] - r.psi_Vs[0]):.3g} mV·s from {1e3 * r.psi_Vs[0]:.3g} mV·s",
        f"  error, MTPA        torque max {e.torque_mtpa_max_Nm:.3g} N·m "
        f"({_percent(e.torque_mtpa_max_Nm / torque_max)} of torque_max)",
        f"  error, weakening   torque max {e.torque_weak_max_Nm:.3g} N·m, rms {e.torque_weak_rms_Nm:.3g} N·m; flux "
        f"{_percent(e.flux_excess)} beyond the available at worst",
        f"  current            {_percent(max(e.current_excess, 0.0))} beyond i_max at worst",
    ]
    if reach > r.psi_Vs[0]:
        lines.append(
            f"  note               this machine cannot go below {1e3 * reach:.3g} mV·s within i_max: at top "
            "speed and a low dc voltage its back-EMF exceeds what the references can weaken"
        )
    return lines


def _shorted_at(found: ShortCircuit, top_rpm: float, share: float) -> str:
    speed_rpm = share * top_rpm
    return f"{-found.torque_at(speed_rpm):.3g} N·m at {speed_rpm:.0f} rpm"


def _short_circuit(motor: Motor) -> Lines:
    found, machine = short_circuit(motor), motor.config.machine
    most, used = int(np.argmin(found.torque_Nm)), used_from_rpm(motor)
    harder = found.speed_rpm[found.torque_Nm < -machine.torque_max_Nm]
    lines = [
        f"active short circuit: {found.current_A[-1]:.4g} A at {machine.speed_max_rpm:g} rpm (steady state, "
        "windings at 20 °C)",
        f"  brakes most        {-found.torque_Nm[most]:.4g} N·m at {found.speed_rpm[most]:.0f} rpm",
        f"  over speed         {', '.join(_shorted_at(found, machine.speed_max_rpm, share) for share in SHORTED_AT)}",
    ]
    if len(harder):
        between = f"between {harder[0]:.0f} and {harder[-1]:.0f} rpm"
        why = "there only disabled switching is safe"
        if harder[-1] > used:
            why = (f"above {used:.0f} rpm a fault shorts the phases all the same, because with switching disabled the "
                   "back-EMF would charge the dc link")  # fmt: skip
        lines.append(f"  note               brakes harder than torque_max_Nm {between}: {why}")
    if used < machine.speed_max_rpm:
        lines.append(
            f"  safe state         above {used:.0f} rpm, where it brakes with {-found.torque_at(used):.3g} N·m; "
            "below, switching is disabled"
        )
    else:
        lines.append(
            "  safe state         only after a gate-driver fault, or an over-voltage while the machine charges the "
            "link: up to speed_max_rpm the back-EMF stays below "
            f"{motor.derived.share_short:.3g} vdc_V"
        )
    return lines


def _bases(motor: Motor) -> Lines:
    names = asdict(motor.bases)
    text = ", ".join(f"{name} {value:.6g}" for name, value in names.items())
    ratio = motor.bases.omega_rad_s / motor.config.omega_max_rad_s
    return [f"bases: {text}", f"  speed reserve      {_percent(ratio - 1)} above speed_max_rpm"]


def _bus(motor: Motor) -> Lines:
    """The resolution and the range of each quantity on the bus."""
    carried = carriers(motor.bus.dbc)
    signs = {"Nm": "N·m", "mOhm": "mΩ", "mVs": "mV·s"}
    units = {name: signs.get(unit, unit) for unit, name in QUANTITIES.items()}
    own = "the standard" if motor.bus.factors == standard_factors() else "its own"
    return [
        f"bus: {own} scale, {DBC_NAME}, interface hash 0x{motor.bus.interface_hash:08X}",
        *(
            f"  {name.rpartition('_')[0]:<18} {carrier.factor:f} {units[name]} per count, "
            f"to {carrier.factor * carrier.counts:f} {units[name]}"
            for name, carrier in carried.items()
        ),
    ]


def _warnings(motor: Motor) -> Lines:
    return [f"warning: {text}" for text in doubts.of_motor(motor)]


def report_text(motor: Motor) -> str:
    """report.txt."""
    parts = [
        _warnings(motor),
        _machine(motor),
        _map(motor),
        _tables(motor),
        _references(motor),
        demagnetisation_lines(motor.config),
        _short_circuit(motor),
        model_lines(motor),
        _bases(motor),
        _bus(motor),
        load_lines(motor),
        [
            f"flash: {motor.tables.flash_bytes} bytes flux tables + {motor.references.flash_bytes} bytes "
            "references "
            f"= {motor.flash_bytes} bytes"
        ],
    ]
    return "\n".join(line for part in parts for line in part) + "\n"
