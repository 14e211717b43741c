# SPDX-License-Identifier: Apache-2.0
"""Requirements of a motor on the bus: rated and largest value of each quantity, and the DBC that carries them."""

import math
from dataclasses import dataclass
from functools import cached_property

from fluxtrue_tools.bus.scales import Factors, Need, dbc_of, factors_for, interface_hash
from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.derived import Derived

AMBIENT_C = 20.0


def _resistance(config: MotorConfig, derived: Derived) -> Need:
    """Up to what the identification can report, or the winding at its trip, whichever is more."""
    machine = config.machine
    warm = 1.0 + machine.r_temp_coeff_per_K * (config.thermal.winding_trip_C - AMBIENT_C)
    return Need(1e3 * machine.r_ohm, 1e3 * max(machine.r_ohm * warm, machine.r_ohm + derived.r_delta_max_ohm))


def needs(config: MotorConfig, derived: Derived) -> dict[str, Need]:
    """Each quantity in the unit of its signals."""
    machine, vdc_V = config.machine, config.inverter.vdc_V
    power_kW = 1e-3 * math.sqrt(0.75) * vdc_V * machine.i_max_A  # 1.5 of vdc/sqrt(3) and i_max
    psi_f_mVs, psi_max_mVs = 1e3 * derived.psi_f_Vs, 1e3 * (derived.psi_f_Vs + derived.psi_delta_max_Vs)
    return {
        "torque_Nm": Need(machine.torque_max_Nm, machine.torque_max_Nm),
        "speed_rpm": Need(machine.speed_max_rpm, machine.speed_max_rpm),
        "resistance_mohm": _resistance(config, derived),
        "flux_mVs": Need(psi_f_mVs, psi_max_mVs),
        "current_A": Need(machine.i_max_A, derived.i_trip_A),
        "voltage_V": Need(vdc_V, derived.v_max_V),
        "power_kW": Need(power_kW, power_kW),
    }


@dataclass(frozen=True)
class BusScales:
    """The factors of one motor and what follows from them."""

    factors: Factors

    @cached_property
    def dbc(self) -> str:
        """The text of the motor's DBC."""
        return dbc_of(self.factors)

    @cached_property
    def interface_hash(self) -> int:
        """The hash of its DBC, which the inverter transmits."""
        return interface_hash(self.dbc)


def make_bus_scales(config: MotorConfig, derived: Derived) -> BusScales:
    """The scales of one machine."""
    return BusScales(factors_for(needs(config, derived)))
