# SPDX-License-Identifier: Apache-2.0
"""Values that are possible but probably not intended: a unit that is off by 1000, an impossible map, coarse tables.

A doubt is a warning of motor check and build. If a motor is refused for any reason, a doubt about its units is printed
first, because a consequence of a wrong unit does not tell the user its cause.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fluxtrue_tools.motor.bases import inductance_at_rest
from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.demagnetisation import limit_A
from fluxtrue_tools.motor.flux_map import FluxMap
from fluxtrue_tools.motor.flux_model import FluxModel, flux
from fluxtrue_tools.motor.flux_tables import ERROR_WANTED as TABLE_WANTED
from fluxtrue_tools.motor.references import ERROR_WANTED, ERROR_WANTED_WEAK

if TYPE_CHECKING:
    from fluxtrue_tools.motor.motor import Motor

TORQUE_MAX = 3.0  # of torque_max_Nm, at i_max: the accepted machines of the tests have up to 1.3
EMF_MAX = 60.0  # of what the dc link can balance, by the magnet alone at top speed: field weakening has its limits
EMF_MIN = 0.5  # by the whole flux at the largest current: a machine so slow needs no such dc link
# By the magnet alone, of a machine that never has to weaken its field: those of the tests have 0.62 and more.
EMF_MAGNET_MIN = 0.4
SALIENCE_MAX = 100.0  # flux of i_max in the q axis over the magnet's
DROP_MIN = 5e-5  # of vdc, by i_max on the resistance
DEAD_TIME_MOST = 0.03  # of i_max, in one PWM period by dead time and device drop: beyond it currents near 0 oscillate
RUN_UP_MOST_S, RUN_UP_LEAST_S = 200.0, 2e-4  # to top speed with all torque
OFFSET_MAX = 0.05  # of the largest psi_q
CURL_MAX = 0.05  # of the mean inductance
STEP_MAX = 0.05  # of the largest flux linkage; the measured map of hsm1 has 0.017
IRON_MAX = 0.03  # of torque_max_Nm: the current references supply it; the second level tolerates 3 to 6 % (SL-6)
DEMAGNETISATION_MIN = 0.05  # of i_max, at the assumed temperature: less hardly weakens a field


@dataclass(frozen=True)
class Doubt:
    """One warning; a conclusive one replaces every other complaint about the motor."""

    text: str
    conclusive: bool = False


def _reach_V(config: MotorConfig) -> float:
    return config.inverter.vdc_V / math.sqrt(3.0)


def _whole_flux(config: MotorConfig, model: FluxModel) -> float:
    """Of the largest current along q, V·s."""
    return float(flux(model, 0.0, config.machine.i_max_A))


def _flux_key(config: MotorConfig, value: float) -> str:
    name = config.machine.flux_map
    return f"machine.psi_f_Vs = {value:g} V·s" if name is None else f"{name}: psi_d_Vs = {value:g} V·s at no current"


def _units(config: MotorConfig, model: FluxModel) -> Iterator[Doubt]:
    machine = config.machine
    psi_f = float(model.psi_d(0.0, 0.0))
    emf = config.omega_max_rad_s * psi_f / _reach_V(config)
    if emf > EMF_MAX:
        yield Doubt(f"{_flux_key(config, psi_f)} looks like mV·s: at speed_max_rpm the magnet alone would induce "
                    f"{emf:.0f} times what vdc_V can balance; wanted: V·s ({psi_f / 1000:g})", True)  # fmt: skip
    psi_q = float(model.psi_q(0.0, machine.i_max_A))
    if psi_q > SALIENCE_MAX * psi_f:
        key = "machine.lq_H" if machine.flux_map is None else f"{machine.flux_map}: psi_q_Vs"
        yield Doubt(f"{key}: i_max_A makes {psi_q / psi_f:.0f} times the magnet's flux in the q axis, as if an "
                    "inductance were in mH; wanted: H, V·s and A", True)  # fmt: skip
    yield from _exchanged(config, model)
    whole = _whole_flux(config, model)
    used = config.omega_max_rad_s * whole / _reach_V(config)
    if used < EMF_MIN or (used < 1.0 and emf < EMF_MAGNET_MIN):
        rad_s = machine.speed_max_rpm * 60.0 / (2.0 * math.pi)
        yield Doubt(f"machine.speed_max_rpm = {machine.speed_max_rpm:g} rpm: there all flux needs {100 * used:.2g} % "
                    f"of the phase voltage that vdc_V = {config.inverter.vdc_V:g} V gives, the magnet alone "
                    f"{100 * emf:.2g} %; "
                    f"as rad/s it would be {rad_s:.0f} rpm")  # fmt: skip


def _exchanged(config: MotorConfig, model: FluxModel) -> Iterator[Doubt]:
    """Axes of a reluctance machine, whose d axis many programs lay along the larger inductance, not along the magnet.

    At i_d = -i_max the torque falls with i_q. No machine is accepted for which that is so.
    """
    machine, i_max_A = config.machine, config.machine.i_max_A
    if float(model.psi_d(-i_max_A, 0.0) + i_max_A * model.psi_q(-i_max_A, 0.0, nq=1)) > 0.0:
        return
    wanted = "wanted: the d axis along the magnet, where a reluctance machine has its smaller inductance"
    if machine.ld_H is not None and machine.lq_H is not None and machine.psi_f_Vs is not None:
        most_H = machine.lq_H + machine.psi_f_Vs / i_max_A
        yield Doubt(f"machine.ld_H = {machine.ld_H:g} H, lq_H = {machine.lq_H:g} H: at i_d = {-i_max_A:g} A the torque "
                    f"falls with i_q; are the two exchanged? {wanted}, and ld_H below {most_H:.4g} H",
                    True)  # fmt: skip
    else:
        yield Doubt(f"{machine.flux_map}: at id_A = {-i_max_A:g} the torque falls with iq_A; {wanted}. A map with d "
                    "along the larger inductance is turned by: motor import --axes synrm", True)  # fmt: skip


def _values(config: MotorConfig) -> Iterator[Doubt]:
    machine = config.machine
    if machine.r_ohm * machine.i_max_A < DROP_MIN * config.inverter.vdc_V:
        yield Doubt(f"machine.r_ohm = {machine.r_ohm:g} Ω drops {machine.r_ohm * machine.i_max_A:.2g} V at i_max_A: "
                    f"is it {1000 * machine.r_ohm:g} Ω?")  # fmt: skip
    run_up = machine.inertia_kgm2 * config.omega_max_rad_s / machine.pole_pairs / machine.torque_max_Nm
    if not RUN_UP_LEAST_S <= run_up <= RUN_UP_MOST_S:
        yield Doubt(f"machine.inertia_kgm2 = {machine.inertia_kgm2:g} kg·m²: torque_max_Nm brings it to speed_max_rpm "
                    f"in {run_up:.3g} s; wanted: kg·m²")  # fmt: skip


def _torque(motor: "Motor") -> Iterator[Doubt]:
    """A flux linkage in another unit changes the torque by as much."""
    machine = motor.config.machine
    share = motor.solver.torque_top_Nm / machine.torque_max_Nm
    if share > TORQUE_MAX:
        yield Doubt(f"machine.torque_max_Nm = {machine.torque_max_Nm:g} N·m: i_max_A = {machine.i_max_A:g} A makes "
                    f"{share:.3g} times as much (allowed without a warning: {TORQUE_MAX:g}); is the flux linkage in "
                    "V·s, and i_max_A the largest current?")  # fmt: skip


def _dead_time(config: MotorConfig, model: FluxModel) -> Iterator[Doubt]:
    """Near zero current the compensation acts by the current of 1.5 periods before."""
    inverter, i_max_A = config.inverter, config.machine.i_max_A
    least_H = inductance_at_rest(model)
    volt = inverter.dead_time_s * inverter.pwm_hz * inverter.vdc_V + inverter.device_drop_V
    moved_A = volt / inverter.pwm_hz / least_H
    if moved_A > DEAD_TIME_MOST * i_max_A:
        share = 100.0 * moved_A / i_max_A
        yield Doubt(f"inverter.dead_time_s = {inverter.dead_time_s:g} s and device_drop_V = "
                    f"{inverter.device_drop_V:g} V move the current by {share:.3g} % of i_max_A in one PWM period "
                    f"(allowed without a warning: {100 * DEAD_TIME_MOST:g} %): near zero current it may oscillate; "
                    "shorten the dead time")  # fmt: skip


def _magnets(config: MotorConfig) -> Iterator[Doubt]:
    if config.magnet.i_d_demag_A is None:
        return
    i_max_A, celsius = config.machine.i_max_A, config.magnet.assumed_C
    left_A = limit_A(config, celsius)
    if left_A < DEMAGNETISATION_MIN * i_max_A:
        yield Doubt(f"magnet.i_d_demag_A = {config.magnet.i_d_demag_A:g} A, i_d_demag_A_per_K = "
                    f"{config.magnet.i_d_demag_A_per_K:g} A/K: magnets at {celsius:g} °C withstand {left_A:.3g} A "
                    f"of i_d, {100 * left_A / i_max_A:.2g} % of i_max_A (allowed without a warning: "
                    f"{100 * DEMAGNETISATION_MIN:g} %): the field can hardly be weakened")  # fmt: skip


def _iron(config: MotorConfig, model: FluxModel) -> Iterator[Doubt]:
    """The torque p (k_h + k_e w) |psi|^2 of the loss is largest where the whole flux just fits the voltage."""
    machine = config.machine
    whole = _whole_flux(config, model)
    omega = min(_reach_V(config) / whole, config.omega_max_rad_s)
    torque_Nm = machine.pole_pairs * (machine.iron_loss_hysteresis + machine.iron_loss_eddy * omega) * whole**2
    share = torque_Nm / machine.torque_max_Nm
    if share > IRON_MAX:
        rpm = omega / machine.pole_pairs * 30.0 / math.pi
        yield Doubt(f"machine.iron_loss_hysteresis = {machine.iron_loss_hysteresis:g}, iron_loss_eddy = "
                    f"{machine.iron_loss_eddy:g}: at {rpm:.4g} rpm the iron takes {torque_Nm:.3g} N·m, "
                    f"{100 * share:.2g} % of torque_max_Nm (allowed without a warning: {100 * IRON_MAX:g} %), "
                    "which the current references supply")  # fmt: skip


def _no_effect(config: MotorConfig) -> Iterator[Doubt]:
    """Keys that have no effect because of their value; a combination of keys without effect is refused (config.py)."""
    machine, given = config.machine, config.identification.given()
    if "iron_loss_uncertainty" in given and machine.iron_loss_hysteresis == machine.iron_loss_eddy == 0.0:
        yield Doubt("identification.iron_loss_uncertainty has no effect: both iron_loss keys are 0")
    if "dead_time_uncertainty" in given and config.inverter.dead_time_s == 0.0:
        yield Doubt("identification.dead_time_uncertainty has no effect: inverter.dead_time_s is 0")
    compensates = "dead_time_compensation" in config.control.given()
    if compensates and config.inverter.dead_time_s == config.inverter.device_drop_V == 0.0:
        yield Doubt("control.dead_time_compensation has no effect: dead_time_s and device_drop_V are 0")


def curl(model: FluxModel, i_max_A: float) -> float:
    """Rms of d psi_d/d i_q - d psi_q/d i_d inside the current circle, over the mean inductance."""
    d, q = np.meshgrid(np.linspace(-i_max_A, 0.0, 61), np.linspace(-i_max_A, i_max_A, 121), indexing="ij")
    inside = np.hypot(d, q) <= i_max_A

    def rms(values: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.square(values[inside]))))

    difference = model.psi_d(d, q, nq=1) - model.psi_q(d, q, nd=1)
    return rms(difference) / math.sqrt(rms(model.psi_d(d, q, nd=1)) * rms(model.psi_q(d, q, nq=1)))


def step(flux_map: FluxMap) -> tuple[float, int, int]:
    """The largest error in V·s that one flux linkage would have to have, and the first i_d and i_q node of its cell.

    In a cell of a reciprocal map the mean slope of psi_q with i_d, of two edges, and that of psi_d with i_q are equal.
    An error of one corner is in one of the edges, so it is twice the difference times the width of the cell.
    """
    d_A, q_A = np.diff(flux_map.id_A)[:, None], np.diff(flux_map.iq_A)[None, :]
    across_d = np.diff(flux_map.psi_q_Vs, axis=0) / d_A
    across_q = np.diff(flux_map.psi_d_Vs, axis=1) / q_A
    twice = across_d[:, 1:] + across_d[:, :-1] - across_q[1:, :] - across_q[:-1, :]
    steps = np.abs(twice) * np.maximum(d_A, q_A)
    row, column = np.unravel_index(int(np.argmax(steps)), steps.shape)
    return float(steps[row, column]), int(row), int(column)


def _map(config: MotorConfig, flux_map: FluxMap | None, model: FluxModel) -> Iterator[Doubt]:
    if flux_map is None:
        return
    name, offset = config.machine.flux_map, flux_map.symmetry.psi_q_offset_Vs
    largest = float(np.abs(flux_map.psi_q_Vs).max())
    if abs(offset) > OFFSET_MAX * largest:
        yield Doubt(f"{name}: psi_q_Vs has an offset of {1e3 * offset:.3g} mV·s, {100 * abs(offset) / largest:.2g} % "
                    "of its largest value; it is taken away (allowed without a warning: "
                    f"{100 * OFFSET_MAX:g} %). An angle that is off turns psi_d into psi_q")  # fmt: skip
    turned = curl(model, config.machine.i_max_A)
    if turned > CURL_MAX:
        yield Doubt(f"{name}: not reciprocal: d psi_d/d i_q and d psi_q/d i_d differ by {100 * turned:.3g} % of the "
                    f"mean inductance (allowed without a warning: {100 * CURL_MAX:g} %); no lossless machine has "
                    "such a map")  # fmt: skip
    else:
        yield from _single_value(config, flux_map)


def _single_value(config: MotorConfig, flux_map: FluxMap) -> Iterator[Doubt]:
    """One wrong value, in a corner of the map for instance, hardly changes the mean over the current circle."""
    found_Vs, row, column = step(flux_map)
    largest = float(max(np.abs(flux_map.psi_d_Vs).max(), np.abs(flux_map.psi_q_Vs).max()))
    if found_Vs > STEP_MAX * largest:
        d_A, q_A = flux_map.id_A[row : row + 2], flux_map.iq_A[column : column + 2]
        yield Doubt(f"{config.machine.flux_map}: between id_A = {d_A[0]:g} and {d_A[1]:g}, iq_A = {q_A[0]:g} and "
                    f"{q_A[1]:g} psi_d_Vs and psi_q_Vs contradict each other by {1e3 * found_Vs:.3g} mV·s, "
                    f"{100 * found_Vs / largest:.2g} % of the largest flux linkage (allowed without a warning: "
                    f"{100 * STEP_MAX:g} %), as if one value were wrong")  # fmt: skip


def _accuracy(motor: "Motor") -> Iterator[Doubt]:
    torque_max = motor.config.machine.torque_max_Nm
    errors = (
        ("flux tables: torque", motor.table_error.torque_max_Nm, TABLE_WANTED),
        ("current references: torque along MTPA", motor.reference_errors.torque_mtpa_max_Nm, ERROR_WANTED),
        ("current references: torque, weakening", motor.reference_errors.torque_weak_max_Nm, ERROR_WANTED_WEAK),
    )
    for what, error_Nm, wanted in errors:
        if error_Nm > wanted * torque_max:
            yield Doubt(f"{what} is up to {error_Nm:.3g} N·m off, {100 * error_Nm / torque_max:.2g} % of "
                        f"torque_max_Nm = {torque_max:g} N·m (wanted: {100 * wanted:g} %): the machine has more "
                        "detail than the finest table")  # fmt: skip


def explaining(config: MotorConfig, model: FluxModel) -> Doubt | None:
    """The doubt about units that may be behind a refusal."""
    return next(_units(config, model), None)


def of_motor(motor: "Motor") -> list[str]:
    """Every warning about a motor that is accepted."""
    config = motor.config
    found = [*_units(config, motor.model), *_values(config), *_torque(motor),
             *_dead_time(config, motor.model), *_magnets(config), *_map(config, motor.flux_map, motor.model),
             *_accuracy(motor), *_iron(config, motor.model), *_no_effect(config)]  # fmt: skip
    return [doubt.text for doubt in found]
