# SPDX-License-Identifier: Apache-2.0
"""Simulated machines that the commissioning does not know: the map of one of the project's machines, changed at random.

The changes keep the map the gradient of one energy, as that of any machine is: one scale for all flux linkages, one for
the currents, and a magnet of its own. Resistance, inverter, sensors, inertia and friction are drawn, too.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.motor.flux_map import load_flux_map
from fluxtrue_tools.motor.flux_model import Array, ConstantModel, FluxModel, SplineModel
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.library import FluxMap, Loop
from fluxtrue_tools.sim.motor import Motor

IRON_RPM = 4000.0
LOW_VOLTAGE_V = 60.0  # below: small machines, whose windings drop more of their voltage, at inverters with MOSFETs
LOW_R = (0.05, 0.25)  # of the phase voltage at i_max: 0.13 of ebike, 0.2 of hub and teknic; anaheim has 0.33
LOW_DEAD_TIME = (0.3, 1.3)  # of what the nameplate assumes: 0.3 to 1.3 us at 20 kHz
LOW_INERTIA = (5e-5, 2e-3)  # kg m^2 for each N·m of the largest torque: 6e-5 of anaheim; ebike and hub have more
LOW_DRAG = (0.01, 0.04)  # of the largest torque, at the largest speed: what the current without a load amounts to
LOW_IRON_RPM_SHARE = 0.44  # of the largest speed, as IRON_RPM of 9000 rpm
FOLDERS = (ROOT / "firmware" / "motors", ROOT / "tests" / "motors")


@dataclass(frozen=True)
class Truth:
    """What the tests compare with: never passed to the commissioning."""

    source: FluxModel
    source_i_max_A: float
    flux_scale: float
    current_scale: float  # of the currents at the same flux
    magnet_scale: float
    plant: dict[str, float]

    def _scaled(self, of: Callable[..., Array], i_d: ArrayLike, i_q: ArrayLike, nd: int, nq: int) -> Array:
        d, q = np.asarray(i_d, float) / self.current_scale, np.asarray(i_q, float) / self.current_scale
        return np.asarray(self.flux_scale * of(d, q, nd=nd, nq=nq) / self.current_scale ** (nd + nq))

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the plant (PL-4) and its derivatives."""
        more = (self.magnet_scale - self.flux_scale) * float(self.source.psi_d(0.0, 0.0))
        return self._scaled(self.source.psi_d, i_d, i_q, nd, nq) + (more if nd == nq == 0 else 0.0)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """The same of the q axis."""
        return self._scaled(self.source.psi_q, i_d, i_q, nd, nq)

    def psi(self, i_d: ArrayLike, i_q: ArrayLike) -> tuple[Array, Array]:
        """Both flux linkages."""
        return self.psi_d(i_d, i_q), self.psi_q(i_d, i_q)

    def drag_Nm(self, speed_rad_s: ArrayLike) -> Array:
        """Friction far above the Stribeck speed, and the excess iron loss of the magnet alone, at mechanical speeds."""
        plant, w = self.plant, np.asarray(speed_rad_s, float)
        omega = plant["pole_pairs"] * w
        excess_W = plant.get("iron_k_excess", 0.0) * omega**1.5 * self.psi_f_Vs**2
        return np.asarray(plant["viscous_Nms"] * w + plant.get("coulomb_Nm", 0.0) + excess_W / w)

    @property
    def reversed(self) -> bool:
        """The sensor counts against the electrical direction of the inverter's phases."""
        return bool(self.plant.get("phases_swapped", 0.0)) != bool(self.plant.get("angle_reversed", 0.0))

    @property
    def offset_rad(self) -> float:
        """Electrical angle, as the inverter's phases turn, at the sensor's zero."""
        offset = self.plant.get("angle_offset_rad", 0.0)
        return offset if self.reversed else -offset

    @property
    def psi_f_Vs(self) -> float:
        """The flux linkage of the magnet."""
        return float(self.psi(0.0, 0.0)[0])


def folder_of(name: str) -> Path:
    """The folder of one of the project's machines."""
    found = next((folder / name for folder in FOLDERS if (folder / name / "motor.toml").is_file()), None)
    if found is None:
        known = sorted(path.parent.name for folder in FOLDERS for path in folder.glob("*/motor.toml"))
        raise FluxtrueError(f"--machine {name}: allowed: {', '.join(known)}")
    return found


def _source(folder: Path) -> tuple[FluxModel, FluxMap | None, float]:
    """Model, map for the plant, largest current of a machine of the project."""
    machine = load_config(folder).machine
    if machine.flux_map is None:
        assert machine.ld_H and machine.lq_H and machine.psi_f_Vs
        return ConstantModel(machine.ld_H, machine.lq_H, machine.psi_f_Vs), None, machine.i_max_A
    grid = load_flux_map(folder / machine.flux_map, machine.i_max_A)
    model = SplineModel(grid.id_A, grid.iq_A, grid.psi_d_Vs, grid.psi_q_Vs)
    return model, FluxMap(grid.id_A, grid.iq_A, grid.psi_d_Vs, grid.psi_q_Vs), machine.i_max_A


def _sensors(rng: np.random.Generator, full_scale_A: float) -> dict[str, float]:
    errors = {"vdc_gain": float(rng.uniform(0.995, 1.005)), "current_noise_A_rms": 0.002 * full_scale_A}
    for phase in "abc":
        errors[f"current_gain_{phase}"] = float(rng.uniform(0.997, 1.003))
        errors[f"current_offset_A_{phase}"] = float(rng.uniform(-0.005, 0.005)) * full_scale_A
    return errors


def _dc_zero(name: str, seed: int, full_scale_V: float) -> dict[str, float]:
    """Of the dc voltage's sensor, whose converter shows nothing below 0; a dc link that discharges to 10 mV."""
    rng = np.random.default_rng([seed, sum(name.encode()), 4])
    return {"vdc_offset_V": float(rng.uniform(-0.01, 0.01)) * full_scale_V, "vdc_least_V": 0.01}


def _connection(name: str, seed: int, pole_pairs: int) -> dict[str, float]:
    """Nothing of how sensor and leads are connected is known. Half to twice the pole pairs of the nameplate: with
    others the machine would not reach the nameplate's largest speed, or could turn much faster."""
    rng = np.random.default_rng([seed, sum(name.encode()), 1])
    pairs = rng.integers(max(pole_pairs // 2, 1), 2 * pole_pairs + 1)
    return {"pole_pairs": float(pairs), "phases_swapped": float(rng.integers(0, 2)),
            "angle_reversed": float(rng.integers(0, 2)), "angle_offset_rad": float(rng.uniform(-math.pi, math.pi)),
            "angle_bits": 14.0}  # fmt: skip


def _is_low_voltage(motor: Motor) -> bool:
    return motor.plant["vdc_V"] < LOW_VOLTAGE_V


def _torque_Nm(truth: Truth, i_max_A: float) -> float:
    """Of the magnet with the largest current."""
    return 1.5 * truth.plant["pole_pairs"] * truth.psi_f_Vs * i_max_A


def _low_voltage(name: str, seed: int, truth: Truth, motor: Motor, i_max_A: float) -> dict[str, float]:
    """What a small machine for a low voltage has in place of a large one's: docs/howto/commission.md.

    Its torque is not that of the nameplate, whose guess of the magnet is that of a machine with much field weakening.
    """
    rng = np.random.default_rng([seed, sum(name.encode()), 3])
    torque_Nm, w_max = _torque_Nm(truth, i_max_A), motor.speed_max_rpm * math.pi / 30.0
    return {"r_ohm_20": float(rng.uniform(*LOW_R)) * motor.plant["vdc_V"] / math.sqrt(3.0) / i_max_A,
            "dead_time_s": motor.plant["dead_time_s"] * float(rng.uniform(*LOW_DEAD_TIME)),
            "inertia_kgm2": torque_Nm * math.exp(float(rng.uniform(*np.log(LOW_INERTIA)))),
            "viscous_Nms": torque_Nm / w_max * float(rng.uniform(*LOW_DRAG))}  # fmt: skip


def _other_errors(name: str, seed: int, truth: Truth, motor: Motor, i_max_A: float) -> dict[str, float]:
    """Errors of kinds that the commissioning does not know or only in part (it finds the harmonics of the angle sensor,
    and assumes another iron loss); of a size that machines and inverters of this size have.

    The iron loss is 0.5 to 1.5 % of the machine's power at IRON_RPM, with the largest current half along -d and half
    along q, and all of it is excess loss.
    """
    rng = np.random.default_rng([seed, sum(name.encode()), 2])
    is_low = _is_low_voltage(motor)
    rpm = LOW_IRON_RPM_SHARE * motor.speed_max_rpm if is_low else IRON_RPM
    i_A, w = math.sqrt(0.5) * i_max_A, rpm * math.pi / 30.0
    psi_d, psi_q = (float(psi) for psi in truth.psi(-i_A, i_A))
    lost_W = float(rng.uniform(0.005, 0.015)) * 1.5 * truth.plant["pole_pairs"] * (psi_d + psi_q) * i_A * w
    torque_Nm = _torque_Nm(truth, i_max_A) if is_low else motor.torque_max_Nm
    coulomb = torque_Nm * float(rng.uniform(0.001, 0.004))
    errors = {
        "iron_k_excess": lost_W / ((truth.plant["pole_pairs"] * w) ** 1.5 * (psi_d**2 + psi_q**2)),
        "leg_knee_A": i_max_A * float(rng.uniform(0.001, 0.004)),
        "coulomb_Nm": coulomb, "stiction_Nm": coulomb * float(rng.uniform(1.2, 2.0)),
        "stribeck_rad_s": float(rng.uniform(0.5, 3.0)),
    }  # fmt: skip
    for order in (1, 2):
        errors[f"angle_h{order}_rad"] = math.radians(float(rng.uniform(0.0, 1.0)))
        errors[f"angle_h{order}_phase"] = float(rng.uniform(0.0, 2.0 * math.pi))
    return errors


def draw(
    name: str, seed: int, motor: Motor, i_max_A: float, connected: bool = True, other_errors: bool = False
) -> tuple[Truth, FluxMap | None, dict[str, float]]:
    """A machine for the firmware of a nameplate: its truth, its map, and the plant's parameters.

    other_errors   with those of _other_errors(), beside those that every machine has
    """
    rng = np.random.default_rng([seed, sum(name.encode())])
    model, flux_map, source_i_max = _source(folder_of(name))
    flux_scale, magnet = float(rng.uniform(0.85, 1.15)), float(rng.uniform(0.85, 1.15))
    current = i_max_A / source_i_max * float(rng.uniform(0.9, 1.1))
    base = motor.plant
    r_ohm = float(rng.uniform(0.005, 0.03)) * base["vdc_V"] / math.sqrt(3.0) / i_max_A
    plant = base | _sensors(rng, base["current_full_scale_A"]) | {
        "r_ohm_20": r_ohm, "magnet_scale": magnet, "lq_scale": flux_scale, "ld_slope_scale": flux_scale,
        "cross_saturation_scale": flux_scale, "dead_time_s": base["dead_time_s"] * float(rng.uniform(0.7, 1.3)),
        "device_drop_V": 0.003 * base["vdc_V"] * float(rng.uniform(0.3, 1.7)), "iron_k_h": 0.0, "iron_k_e": 0.0,
        "imposed_speed": 0.0, "theta_m_rad": float(rng.uniform(0.0, 2.0 * math.pi)),
        "inertia_kgm2": 4e-4 * motor.torque_max_Nm * float(rng.uniform(0.7, 1.4)),
        "viscous_Nms": 1e-4 * motor.torque_max_Nm * float(rng.uniform(0.5, 2.0)),
        "seed": float(rng.integers(1, 1 << 40)),
    }  # fmt: skip
    plant |= _dc_zero(name, seed, base["vdc_full_scale_V"])
    if not connected:
        plant |= _connection(name, seed, round(base["pole_pairs"]))
    if flux_map is None:
        linear = model.psi_d(0.0, 0.0, nd=1), model.psi_q(0.0, 0.0, nq=1), model.psi_d(0.0, 0.0)
        plant |= {"ld_H": float(linear[0]) / current, "lq_H": float(linear[1]) / current, "psi_f_Vs": float(linear[2])}
    else:
        flux_map = FluxMap(current * flux_map.id_A, current * flux_map.iq_A, flux_map.psi_d_Vs, flux_map.psi_q_Vs)
    truth = Truth(model, source_i_max, flux_scale, current, magnet, plant)
    if _is_low_voltage(motor):
        plant |= _low_voltage(name, seed, truth, motor, i_max_A)
    if other_errors:
        plant |= _other_errors(name, seed, truth, motor, i_max_A)
    return truth, flux_map, plant


def machine_text(plant: dict[str, float], flux_map: FluxMap | None) -> str:
    """A machine for the virtual ECU: tests/vecu/machine_file.h."""
    lines = [f"plant.{name} {value!r}" for name, value in plant.items() if value is not None]
    if flux_map is not None:
        tables = (flux_map.id_A, flux_map.iq_A, flux_map.psi_d_Vs, flux_map.psi_q_Vs)
        lines.append(f"map {flux_map.id_A.size} {flux_map.iq_A.size}")
        lines += [" ".join(repr(float(value)) for value in np.ravel(table)) for table in tables]
    return "\n".join(lines) + "\n"


def make(
    name: str,
    seed: int,
    motor: Motor,
    i_max_A: float,
    connected: bool = True,
    other_errors: bool = False,
    changed: Mapping[str, float] | None = None,
) -> tuple[SoftwareInTheLoop, Truth]:
    """A drive with a hidden machine at its terminals, some of its parameters changed; connected: sensor and leads are
    as the firmware assumes."""
    truth, flux_map, plant = draw(name, seed, motor, i_max_A, connected, other_errors)
    plant.update(changed or {})
    return SoftwareInTheLoop(Loop(motor.library, plant, flux_map)), truth
