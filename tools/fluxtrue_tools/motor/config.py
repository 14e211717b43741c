# SPDX-License-Identifier: Apache-2.0
"""motor.toml: its keys, their ranges, and one clear line when something is wrong."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.names import FILE_NAME
from fluxtrue_tools.strict import Strict

TRIP_PER_I_MAX = 1.2
TRIP_PER_FULL_SCALE = 0.78  # the trip is below 80 % of the converter's range
FULL_SCALE_PER_I_MAX = 1.35  # leaves 5 % between i_max and the trip for noise and overshoot
SLEW_PER_TORQUE_MAX = 100.0  # 1/s
THERMAL_SPAN_MIN_K = 5.0
DC_OFFSET_SHARE_MAX = 0.05  # of the full scale
DC_RANGE_SHARE = 1.3  # of vdc_V: the over-voltage trip lies below it
ANGLE_PER_PERIOD_MAX = 1.2  # rad: five samples per turn of the field; beyond it the formats of angle and speed end
ANGLE_TURNING = 0.35  # rad: from here on current_control_turning.c; below, either law keeps 40 degrees


class Machine(Strict):
    """[machine]"""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.+-]{0,47}$")]
    pole_pairs: Annotated[int, Field(ge=1, le=50)]
    r_ohm: Annotated[float, Field(ge=1e-5, le=100)]
    r_temp_coeff_per_K: Annotated[float, Field(ge=0, le=0.02)]
    i_max_A: Annotated[float, Field(gt=0, le=5000)]
    torque_max_Nm: Annotated[float, Field(gt=0, le=100000)]
    speed_max_rpm: Annotated[float, Field(ge=1, le=200000)]
    inertia_kgm2: Annotated[float, Field(ge=1e-9, le=1000)]
    iron_loss_hysteresis: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    iron_loss_eddy: Annotated[float, Field(ge=0, le=1e3)] = 0.0
    flux_map: Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f\\]{1,255}$")] | None = None
    ld_H: Annotated[float, Field(gt=0, le=1)] | None = None
    lq_H: Annotated[float, Field(gt=0, le=1)] | None = None
    psi_f_Vs: Annotated[float, Field(gt=0, le=100)] | None = None


class Inverter(Strict):
    """[inverter]"""

    vdc_V: Annotated[float, Field(ge=5, le=2000)]
    pwm_hz: Annotated[float, Field(ge=4000, le=40000)]
    dead_time_s: Annotated[float, Field(ge=0, le=2e-5)]
    current_full_scale_A: Annotated[float, Field(gt=0, le=10000)]
    adc_bits: Annotated[int, Field(ge=8, le=16)]
    device_drop_V: Annotated[float, Field(ge=0, le=10)] = 0.0
    min_pulse_s: Annotated[float, Field(ge=0, le=2e-5)] | None = None
    v_dc_full_scale_V: Annotated[float, Field(gt=0, le=4000)] | None = None
    v_dc_offset_V: Annotated[float, Field(ge=-200, le=200)] = 0.0  # shown without voltage


class Control(Strict):
    """[control], all optional"""

    observer_m: Annotated[float, Field(ge=2, le=4)] = 3.0
    flux_bandwidth_rad_s: Annotated[float, Field(ge=0.1, le=1000)] = 30.0
    resistance_bandwidth_rad_s: Annotated[float, Field(ge=0.1, le=100)] = 10.0
    torque_loop_bandwidth_rad_s: Annotated[float, Field(ge=0.1, le=300)] = 50.0
    torque_authority: Annotated[float, Field(ge=0.01, le=0.9)] = 0.3
    torque_slew_Nm_per_s: Annotated[float, Field(ge=0, le=1e7)] | None = None
    dead_time_compensation: Annotated[float, Field(ge=0, le=1)] = 1.0


class Identification(Strict):
    """[identification], all optional: uncertainty before the first drive, as standard deviations"""

    magnet_uncertainty: Annotated[float, Field(ge=0.001, le=0.5)] = 0.12  # of psi_f
    lq_uncertainty: Annotated[float, Field(ge=0.001, le=0.3)] = 0.06
    ld_uncertainty: Annotated[float, Field(ge=0.001, le=0.3)] = 0.06
    resistance_uncertainty: Annotated[float, Field(ge=0.01, le=1.0)] = 0.25  # without a winding sensor
    winding_uncertainty_K: Annotated[float, Field(ge=0.5, le=50)] = (
        10.0  # with a sensor, which does not measure the whole winding
    )
    dead_time_uncertainty: Annotated[float, Field(ge=0.01, le=1.0)] = 0.12
    device_drop_uncertainty_V: Annotated[float, Field(ge=0.01, le=5)] = 0.3
    angle_uncertainty_deg: Annotated[float, Field(ge=0.01, le=5)] = 0.3  # electrical
    iron_loss_uncertainty: Annotated[float, Field(ge=0.01, le=0.9)] = 0.2
    flux_uncertainty: Annotated[float, Field(ge=0.001, le=0.1)] = 0.01  # shape of the map, of psi_f
    voltage_uncertainty: Annotated[float, Field(ge=0.0001, le=0.05)] = 0.0017  # of vdc
    correlation_time_s: Annotated[float, Field(ge=0.01, le=2)] = 0.5  # of those two


class Thermal(Strict):
    """[thermal], all optional: from derate_C on torque falls in a straight line, at trip_C it is zero"""

    inverter_derate_C: Annotated[float, Field(ge=20, le=300)] = 85.0
    inverter_trip_C: Annotated[float, Field(ge=20, le=300)] = 105.0
    winding_derate_C: Annotated[float, Field(ge=20, le=300)] = 155.0
    winding_trip_C: Annotated[float, Field(ge=20, le=300)] = 180.0


class Magnet(Strict):
    """[magnet], all optional: demagnetisation limit and temperature of the magnets"""

    i_d_demag_A: Annotated[float, Field(gt=0, le=10000)] | None = None
    i_d_demag_A_per_K: Annotated[float, Field(ge=0, le=100)] = 0.0
    psi_temp_coeff_per_K: Annotated[float, Field(ge=-0.01, le=-0.0001)] = -0.001
    assumed_C: Annotated[float, Field(ge=20, le=300)] = 150.0


class MotorConfig(Strict):
    """The whole file."""

    machine: Machine
    inverter: Inverter
    control: Control = Control()
    identification: Identification = Identification()
    thermal: Thermal = Thermal()
    magnet: Magnet = Magnet()

    @property
    def min_pulse_s(self) -> float:
        given = self.inverter.min_pulse_s
        return self.inverter.dead_time_s if given is None else given

    @property
    def v_dc_full_scale_V(self) -> float:
        given = self.inverter.v_dc_full_scale_V
        return 1.5 * self.inverter.vdc_V if given is None else given

    @property
    def v_dc_offset_max_V(self) -> float:
        """The largest voltage that the converter can show, the full scale less the offset, lies above the trip."""
        full_scale_V = self.v_dc_full_scale_V
        return min(DC_OFFSET_SHARE_MAX * full_scale_V, full_scale_V - DC_RANGE_SHARE * self.inverter.vdc_V)

    @property
    def torque_slew_Nm_per_s(self) -> float:
        """0: no limit; by default full torque in 10 ms, so that a reversal in field weakening stays below the trip."""
        given = self.control.torque_slew_Nm_per_s
        return SLEW_PER_TORQUE_MAX * self.machine.torque_max_Nm if given is None else given

    @property
    def i_trip_A(self) -> float:
        full_scale = self.inverter.current_full_scale_A
        return min(TRIP_PER_I_MAX * self.machine.i_max_A, TRIP_PER_FULL_SCALE * full_scale)

    @property
    def omega_max_rad_s(self) -> float:
        """Electrical angular frequency at speed_max_rpm."""
        return self.machine.pole_pairs * self.machine.speed_max_rpm * 2 * math.pi / 60

    @property
    def is_turning(self) -> bool:
        """The field turns so far in a PWM period that the motor needs the law for it."""
        return self.omega_max_rad_s > ANGLE_TURNING * self.inverter.pwm_hz


NAME_ALLOWED = {"machine.name": "1 to 48 letters, digits, spaces or _ . + -",
                "machine.flux_map": "1 to 255 printable characters without \\"}  # fmt: skip


def complaint(error: ValidationError) -> str:
    """The first complaint about motor.toml as one line."""
    first = error.errors()[0]
    where = ".".join(map(str, first["loc"]))
    if len(first["loc"]) == 1 and where in MotorConfig.model_fields and first["type"] != "extra_forbidden":
        if first["type"] == "missing":
            return f"[{where}]: section missing"
        return f"{strict.quantity(where, first['input'])}, allowed: a section [{where}]"
    return strict.explain(error, MotorConfig, NAME_ALLOWED)


def _fail(text: str) -> None:
    raise FluxtrueError(text)


def _check_flux_source(machine: Machine) -> None:
    constants = {"ld_H": machine.ld_H, "lq_H": machine.lq_H, "psi_f_Vs": machine.psi_f_Vs}
    given = [key for key, value in constants.items() if value is not None]
    if machine.flux_map is not None and given:
        _fail(f"machine.flux_map and machine.{given[0]}: give either flux_map or ld_H, lq_H and psi_f_Vs, not both")
    if machine.flux_map is None and len(given) != len(constants):
        missing = next(key for key in constants if key not in given)
        _fail(f"machine.{missing}: missing, give either flux_map or all of ld_H, lq_H and psi_f_Vs")


def _check_speed(config: MotorConfig) -> None:
    step = config.omega_max_rad_s / config.inverter.pwm_hz
    if step > ANGLE_PER_PERIOD_MAX:
        limit = ANGLE_PER_PERIOD_MAX * config.inverter.pwm_hz * 60 / (2 * math.pi * config.machine.pole_pairs)
        _fail(
            f"machine.speed_max_rpm = {config.machine.speed_max_rpm:g} turns {step:.3g} electrical radians "
            f"per PWM period, allowed: up to {ANGLE_PER_PERIOD_MAX} (here {strict.down(limit):g} rpm)"
        )


def _check_currents(config: MotorConfig) -> None:
    full_scale, i_max = config.inverter.current_full_scale_A, config.machine.i_max_A
    if full_scale < FULL_SCALE_PER_I_MAX * i_max:
        _fail(
            f"inverter.current_full_scale_A = {full_scale:g} A, allowed: from "
            f"{FULL_SCALE_PER_I_MAX * i_max:g} A "
            f"({FULL_SCALE_PER_I_MAX} * i_max_A: the over-current trip lies above i_max_A "
            "and below 80 % of full scale)"
        )
    if full_scale > 20 * i_max:
        _fail(
            f"inverter.current_full_scale_A = {full_scale:g} A, allowed: up to {20 * i_max:g} A "
            "(20 * i_max_A: beyond it the measurement has no resolution left)"
        )


def _check_dc_offset(config: MotorConfig) -> None:
    offset_V, full_scale_V = config.inverter.v_dc_offset_V, config.v_dc_full_scale_V
    limit_V = DC_OFFSET_SHARE_MAX * full_scale_V
    if abs(offset_V) > limit_V:
        _fail(
            f"inverter.v_dc_offset_V = {offset_V:g} V, allowed: from {-limit_V:g} to {limit_V:g} V "
            f"({100 * DC_OFFSET_SHARE_MAX:g} % of v_dc_full_scale_V = {full_scale_V:g} V)"
        )
    if offset_V > config.v_dc_offset_max_V:
        _fail(
            f"inverter.v_dc_offset_V = {offset_V:g} V, allowed: up to {strict.down(config.v_dc_offset_max_V):g} V "
            f"(v_dc_full_scale_V = {full_scale_V:g} V less {DC_RANGE_SHARE:g} * vdc_V: the over-voltage trip lies "
            "below the largest voltage that is seen)"
        )


def _check_inverter(config: MotorConfig) -> None:
    inverter = config.inverter
    for key, value in (("dead_time_s", inverter.dead_time_s), ("min_pulse_s", config.min_pulse_s)):
        limit = 0.1 / inverter.pwm_hz
        if value > limit:
            _fail(f"inverter.{key} = {value:g} s, allowed: up to {limit:g} s (10 % of the PWM period)")
    if config.v_dc_full_scale_V < DC_RANGE_SHARE * inverter.vdc_V:
        _fail(
            f"inverter.v_dc_full_scale_V = {config.v_dc_full_scale_V:g} V, allowed: from "
            f"{DC_RANGE_SHARE * inverter.vdc_V:g} V ({DC_RANGE_SHARE:g} * vdc_V: the over-voltage trip lies below it)"
        )
    _check_dc_offset(config)
    if inverter.device_drop_V > 0.05 * inverter.vdc_V:
        _fail(
            f"inverter.device_drop_V = {inverter.device_drop_V:g} V, allowed: up to "
            f"{0.05 * inverter.vdc_V:g} V (5 % of vdc_V)"
        )


def _check_thermal(config: MotorConfig) -> None:
    for what in ("inverter", "winding"):
        derate, trip = (getattr(config.thermal, f"{what}_{key}_C") for key in ("derate", "trip"))
        if trip < derate + THERMAL_SPAN_MIN_K:
            _fail(
                f"thermal.{what}_trip_C = {trip:g} °C, allowed: from {derate + THERMAL_SPAN_MIN_K:g} °C "
                f"({what}_derate_C + {THERMAL_SPAN_MIN_K:g}: torque falls along a line, not at once)"
            )


def _check_bandwidth(config: MotorConfig) -> None:
    bandwidth, limit = config.control.resistance_bandwidth_rad_s, config.inverter.pwm_hz / 64
    if bandwidth > limit:
        _fail(f"control.resistance_bandwidth_rad_s = {bandwidth:g} rad/s, allowed: up to {limit:g} (pwm_hz / 64)")


def _check_drop(config: MotorConfig) -> None:
    machine = config.machine
    drop, limit = machine.r_ohm * machine.i_max_A, 0.3 * config.inverter.vdc_V
    if drop > limit:
        slip = f"; as mΩ it would be {machine.r_ohm / 1000:g} Ω" if drop / 1000 <= limit else ""
        _fail(
            f"machine.r_ohm = {machine.r_ohm:g} Ω drops {drop:.4g} V at i_max_A, allowed: up to "
            f"{limit:.3g} V (30 % of vdc_V), here {strict.down(limit / machine.i_max_A):g} Ω{slip}"
        )


def _check_magnet(config: MotorConfig) -> None:
    given = config.magnet.given()
    if "i_d_demag_A_per_K" in given and config.magnet.i_d_demag_A is None:
        _fail("magnet.i_d_demag_A_per_K: has no effect without magnet.i_d_demag_A, the limit at 20 °C")
    if config.magnet.i_d_demag_A_per_K == 0.0:
        for key in ("psi_temp_coeff_per_K", "assumed_C"):
            if key in given:
                _fail(f"magnet.{key}: has no effect without magnet.i_d_demag_A_per_K: no limit depends on temperature")


def check_config(config: MotorConfig) -> None:
    """Refuse values that do not fit one another."""
    _check_flux_source(config.machine)
    _check_speed(config)
    _check_currents(config)
    _check_inverter(config)
    _check_drop(config)
    _check_bandwidth(config)
    _check_thermal(config)
    _check_magnet(config)


def _read(path: Path) -> str:
    try:
        if not path.parent.is_dir() and path.parent.exists():
            raise FluxtrueError(f"{path.parent}: not a folder; a motor is a folder with {FILE_NAME}")
        if not path.exists():
            raise FluxtrueError(f"{path}: no such file; a motor is a folder with {FILE_NAME}")
        if not path.is_file():
            raise FluxtrueError(f"{path}: cannot be read (not a file)")
    except OSError as error:  # too long a name, a loop of links
        raise FluxtrueError(f"{path}: cannot be read ({error.strerror})") from None
    return strict.read_text(path)


def load_config(folder: Path) -> MotorConfig:
    """Read and validate <folder>/motor.toml."""
    path = folder / FILE_NAME
    config = strict.parse(MotorConfig, _read(path), str(path), complaint)
    try:
        check_config(config)
    except FluxtrueError as error:
        raise FluxtrueError(f"{path}: {error}") from None
    return config
