# SPDX-License-Identifier: Apache-2.0
"""motor.json: the resolved motor for the other Python tools. SI units, no default left open."""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from fluxtrue_tools.motor.motor import Motor

FORMAT = 1


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return float(value) if isinstance(value, np.floating) else value


def _machine(motor: Motor) -> dict[str, Any]:
    """Constants are given for a mapped machine too: its values at no current."""
    resolved = motor.config.machine.model_dump()
    resolved["psi_f_Vs"] = motor.derived.psi_f_Vs
    resolved["ld_H"] = float(motor.model.psi_d(0.0, 0.0, nd=1))
    resolved["lq_H"] = float(motor.model.psi_q(0.0, 0.0, nq=1))
    return resolved


def _inverter(motor: Motor) -> dict[str, Any]:
    return motor.config.inverter.model_dump() | {
        "min_pulse_s": motor.config.min_pulse_s,
        "v_dc_full_scale_V": motor.config.v_dc_full_scale_V,
    }


def _map(motor: Motor) -> dict[str, Any] | None:
    flux_map = motor.flux_map
    if flux_map is None:
        return None
    arrays = {name: _plain(getattr(flux_map, name)) for name in ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")}
    return arrays | {"symmetry": asdict(flux_map.symmetry)}


def _references(motor: Motor) -> dict[str, Any]:
    limits = motor.limits
    return {
        "torque_top_Nm": motor.solver.torque_top_Nm,
        "limit_torque_Nm": _plain(limits.torque_Nm),
        "limit_psi_min_Vs": _plain(limits.psi_min_Vs),
        "limit_psi_mtpa_Vs": _plain(limits.psi_mtpa_Vs),
    }


def _bus(motor: Motor) -> dict[str, Any]:
    factors = {name: float(factor) for name, factor in motor.bus.factors.items()}
    return {"factors": factors, "interface_hash": motor.bus.interface_hash}


def motor_json(motor: Motor) -> str:
    """The text of motor.json."""
    data = {
        "format": FORMAT,
        "machine": _machine(motor),
        "inverter": _inverter(motor),
        "control": motor.config.control.model_dump(),
        "thermal": motor.config.thermal.model_dump(),
        "magnet": motor.config.magnet.model_dump(),
        "bases": asdict(motor.bases),
        "derived": asdict(motor.derived),
        "bus": _bus(motor),
        "map": _map(motor),
        "references": _references(motor),
        "errors": {"table": asdict(motor.table_error), "references": asdict(motor.reference_errors)},
    }
    return json.dumps(data, indent=1) + "\n"
