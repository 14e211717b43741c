# SPDX-License-Identifier: Apache-2.0
"""A built motor: its library and the plant that fits its data."""

import ctypes
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.build import MotorFolder, prepare


@dataclass(frozen=True)
class Motor:
    """Library, flux map and the plant parameters that the motor's data give."""

    name: str
    folder: MotorFolder
    library: ctypes.CDLL
    flux_map: lib.FluxMap | None
    plant: dict[str, float]
    inertia_kgm2: float
    torque_max_Nm: float
    speed_max_rpm: float
    psi_f_Vs: float
    r_ohm: float

    def names(self) -> list[str]:
        """What a scenario may set."""
        plant = [name for name in lib.plant_names(self.library) if name.startswith("plant.")]
        return lib.controller_names(self.library) + plant


def plant_parameters(machine: dict[str, Any], inverter: dict[str, Any]) -> dict[str, float]:
    """The drive of the data sheet: its dead time and its converter, without errors."""
    return {
        "pole_pairs": machine["pole_pairs"],
        "r_ohm_20": machine["r_ohm"],
        "r_temp_coeff_per_K": machine["r_temp_coeff_per_K"],
        "ld_H": machine["ld_H"],
        "lq_H": machine["lq_H"],
        "psi_f_Vs": machine["psi_f_Vs"],
        "iron_k_h": machine["iron_loss_hysteresis"],
        "iron_k_e": machine["iron_loss_eddy"],
        "vdc_V": inverter["vdc_V"],
        "pwm_hz": inverter["pwm_hz"],
        "dead_time_s": inverter["dead_time_s"],
        "device_drop_V": inverter["device_drop_V"],
        "current_full_scale_A": inverter["current_full_scale_A"],
        "adc_bits": inverter["adc_bits"],
        "current_quantise": 1.0,
        "vdc_full_scale_V": inverter["v_dc_full_scale_V"],
        "vdc_offset_V": inverter["v_dc_offset_V"],
    }


def flux_map_of(data: dict[str, Any]) -> lib.FluxMap | None:
    """The map of motor.json; None: constant inductances."""
    flux_map, axes = data["map"], ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")
    return None if flux_map is None else lib.FluxMap(*(flux_map[axis] for axis in axes))


def read(folder: MotorFolder) -> Motor:
    """What lies in a built motor's folder."""
    data = json.loads(folder.data.read_text(encoding="utf-8"))
    machine = data["machine"]
    return Motor(
        name=folder.name,
        folder=folder,
        library=lib.load(folder.library),
        flux_map=flux_map_of(data),
        plant=plant_parameters(machine, data["inverter"]),
        inertia_kgm2=machine["inertia_kgm2"],
        torque_max_Nm=machine["torque_max_Nm"],
        speed_max_rpm=machine["speed_max_rpm"],
        psi_f_Vs=machine["psi_f_Vs"],
        r_ohm=machine["r_ohm"],
    )


def load(motor: str, build_dir: Path | None = None, base: Path | None = None, where: str = "motor") -> Motor:
    """A shipped motor or a folder with a motor.toml, built if need be; `where` says who named it."""
    folder = prepare(motor, build_dir, base, where)
    try:
        return read(folder)
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise FluxtrueError(f"{folder.data}: not what the motor tool writes ({error!r})") from error
