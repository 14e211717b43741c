# SPDX-License-Identifier: Apache-2.0
"""The motor of a campaign: its library, its flux map as functions, the nominal values of the spread."""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from fluxtrue_tools.campaign.spec import Campaign, Nominal
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import ConstantModel, FluxModel, SplineModel
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.motor import Motor


@dataclass(frozen=True)
class Machine:
    """A motor with everything that follows from its data."""

    motor: Motor
    model: FluxModel
    i_max_A: float
    speed_max_rpm: float
    r_temp_coeff_per_K: float
    nominal: Nominal

    @property
    def pole_pairs(self) -> int:
        return int(self.motor.plant["pole_pairs"])

    @property
    def vdc_V(self) -> float:
        return self.motor.plant["vdc_V"]

    @property
    def rated_Nm(self) -> float:
        """Errors are relative to the requested torque, but never to less than a tenth of this."""
        return self.motor.torque_max_Nm


def _nominal(given: Nominal, data: dict[str, dict[str, float]]) -> Nominal:
    """The nominal values; those of the motor's data have priority, because the firmware is built from them."""
    known = {
        "device_drop_V": data["inverter"]["device_drop_V"],
        "iron_k_h": data["machine"].get("iron_loss_hysteresis", 0.0),
        "iron_k_e": data["machine"].get("iron_loss_eddy", 0.0),
    }
    return Nominal(**{name: value or getattr(given, name) for name, value in known.items()})


def data_sheet(folder: MotorFolder, nominal: Nominal) -> Machine:
    """The machine of a built motor."""
    motor = motors.read(folder)
    data = json.loads(folder.data.read_text(encoding="utf-8"))
    machine, grid = data["machine"], data["map"]
    axes = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")
    model: FluxModel = (
        ConstantModel(machine["ld_H"], machine["lq_H"], machine["psi_f_Vs"])
        if grid is None
        else SplineModel(*(np.asarray(grid[axis], dtype=float) for axis in axes))
    )
    known = _nominal(nominal, data)
    return Machine(motor, model, machine["i_max_A"], machine["speed_max_rpm"], machine["r_temp_coeff_per_K"], known)


def make_machine(folder: MotorFolder, campaign: Campaign, where: str) -> Machine:
    """The same for a campaign, whose spread must fit it."""
    machine = data_sheet(folder, campaign.nominal)
    low, drop_V = campaign.spread.device_drop_error_V[0], machine.nominal.device_drop_V
    if drop_V + low < 0.0:
        raise FluxtrueError(
            f"{where}: spread.device_drop_error_V = {low:g} about {drop_V:g} V, allowed: no drop below 0"
            " (give nominal.device_drop_V)"
        )
    return machine


@lru_cache(maxsize=2)
def machine_of(name: str, folder: str, text: str) -> Machine:
    """The machine, read once per worker process."""
    return make_machine(MotorFolder(name, Path(folder)), Campaign.model_validate_json(text), "campaign")
