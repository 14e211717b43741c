# SPDX-License-Identifier: Apache-2.0
"""A machine driven with the firmware of the folder that its commissioning has written: torque against the request.

The firmware is that of the folder: the tables that `motor build` makes of it, compiled and given to the simulation
library (motor/simulated.py). The plant is the machine that was commissioned, with the errors that its sensors had.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from fluxtrue_tools.campaign.drive import Profile, make_profile
from fluxtrue_tools.campaign.envelope import MARGIN, NOTHING_WRONG, Capability, Envelope, largest
from fluxtrue_tools.campaign.sample import draws
from fluxtrue_tools.campaign.spec import Check, Drive, Vehicle, Windows
from fluxtrue_tools.campaign.tour import Tour, run_row, window_row
from fluxtrue_tools.campaign.windows import Window, plan
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import start
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.motor.motor import Motor, load_motor
from fluxtrue_tools.motor.names import FILE_NAME
from fluxtrue_tools.motor.simulated import Simulated, simulated
from fluxtrue_tools.sim.library import FluxMap, Loop

NAMEPLATE, TABLES, ROBUST = "nameplate", "tables", "robust"
ALONE: Final = {"torque_loop": 0.0, "identification": 0.0}
GUESSED: Final = ALONE | {"machine_monitors": 0.0}  # they compare with the guesses and would trip
CORRECTED: Final = {"torque_loop": 1.0, "identification": 1.0, "identification_mode": 1.0}
COUNTED: Final = Check().count_nonzero
SEED: Final = 310427  # of warm-ups and windows
FROM_RPM: Final = 300.0
SPEEDS: Final = 121
REACH_SHARE: Final = 0.1  # of the largest torque: the speed above which a machine has less is its top here
WINDOW_SHARE: Final = 0.075  # the smallest torque of a window, as 10 N·m of hsm1
CAR: Final = Vehicle()  # of a machine like hsm1
CAR_NM, CAR_RPM = 132.0, 10000.0
SETTLE_S: Final = 0.05
IMPOSED: Final = {"imposed_speed": 1.0, "speed_rad_s": 0.0}  # of the plant
FEW: Final = 4  # of so many windows one with the nameplate's tables, whose errors are large


class Firmware(Protocol):
    """The firmware of a motor's folder, wherever it runs."""

    @property
    def motor(self) -> Motor: ...

    def connected(self, machine: "Coupled") -> Loop:
        """With this machine, at a standstill."""


@dataclass(frozen=True)
class Built:
    """A motor's folder with its firmware, compiled for this computer."""

    motor: Motor
    data: Simulated

    def connected(self, machine: "Coupled") -> Loop:
        """The port is told how sensor and leads are connected."""
        loop = replace(self.data, plant={}, flux_map=machine.flux_map).loop(machine.truth.plant | IMPOSED)
        loop.set("angle_pole_pairs", machine.connection.pole_pairs)
        loop.set("angle_reversed", float(machine.connection.reversed))
        loop.set("angle_offset_rad", machine.connection.offset_rad)
        return loop


def built(motor: Motor, scratch: Path) -> Built:
    """Compile the tables in a scratch folder."""
    return Built(motor, simulated(motor, scratch))


def nameplate_for(nameplate: Path, pole_pairs: int, scratch: Path) -> Built:
    """What `motor start` guesses with the right number of pole pairs: the tables before a commissioning."""
    config = load_config(nameplate)
    machine, inverter = config.machine, config.inverter
    guessed = start.guess(machine.i_max_A, inverter.vdc_V, inverter.pwm_hz, pole_pairs, machine.speed_max_rpm)
    text = start.text("nameplate", machine.i_max_A, inverter.vdc_V, inverter.pwm_hz, pole_pairs,
                      inverter.current_full_scale_A, guessed, is_speed_given=True)  # fmt: skip
    scratch.mkdir(parents=True, exist_ok=True)
    (scratch / FILE_NAME).write_text(text, encoding="utf-8")
    return built(load_motor(scratch), scratch)


@dataclass(frozen=True)
class Plan:
    """Warm-up and windows of one machine, the same for every firmware."""

    profile: Profile
    windows: list[Window]
    spec: Windows
    top_rpm: float
    rated_Nm: float  # errors are relative to the request, but never to less than a tenth of this

    @property
    def middle_rpm(self) -> float:
        """Between the lower and the upper speeds."""
        return 0.5 * self.top_rpm


def _reach(motor: Motor, truth: Truth) -> Envelope:
    """Torque that the folder and the machine both allow, up to the top speed."""
    machine, vdc_V = motor.config.machine, motor.config.inverter.vdc_V
    speed = np.linspace(0.0, machine.speed_max_rpm, SPEEDS)
    omega = machine.pole_pairs * speed * math.pi / 30.0
    of_both = [largest(Capability(model, machine.pole_pairs, r_ohm, machine.i_max_A, vdc_V), NOTHING_WRONG, omega)
               for model, r_ohm in ((motor.model, machine.r_ohm), (truth, truth.plant["r_ohm_20"]))]  # fmt: skip
    torque = np.minimum(MARGIN * np.minimum(*of_both), machine.torque_max_Nm)
    less = np.flatnonzero(torque < REACH_SHARE * machine.torque_max_Nm)
    end = int(less[0]) if less.size else SPEEDS
    return Envelope(speed[:end], torque[:end])


def _car(torque_Nm: float, top_rpm: float) -> Vehicle:
    """The car that asks as much of this machine as the campaigns' car of hsm1."""
    gear = CAR.gear_ratio * top_rpm / CAR_RPM
    scale = torque_Nm * gear / (CAR_NM * CAR.gear_ratio)
    return Vehicle(mass_kg=scale * CAR.mass_kg, wheel_radius_m=CAR.wheel_radius_m, gear_ratio=gear,
                   rolling_N=scale * CAR.rolling_N, drag_N_per_m2_s2=scale * CAR.drag_N_per_m2_s2)  # fmt: skip


def plan_of(motor: Motor, truth: Truth, case: int, drive_s: float, strata: tuple[int, int]) -> Plan:
    """strata   windows in each quadrant at the lower and at the upper speeds"""
    envelope, rated = _reach(motor, truth), motor.config.machine.torque_max_Nm
    top = float(envelope.speed_rpm[-1]) if envelope.speed_rpm.size else 0.0
    if top <= 2.0 * FROM_RPM:
        raise FluxtrueError(f"the voltage suffices for a tenth of the torque up to {top:g} rpm only")
    bands = [[FROM_RPM, 0.5 * top, strata[0]], [0.5 * top, top, strata[1]]]
    spec = Windows(speed_rpm=bands, low_speed_rpm=[], torque_min_Nm=WINDOW_SHARE * rated)  # type: ignore[arg-type]
    streams = draws(SEED, case)
    profile = make_profile(Drive(duration_s=drive_s, vehicle=_car(rated, top)), envelope, streams.drive)
    return Plan(profile, plan(spec, envelope, streams.windows), spec, top, rated)


@dataclass(frozen=True)
class Coupled:
    """A machine that turns at an imposed speed behind an inverter, connected as the commissioning has found."""

    truth: Truth
    flux_map: FluxMap | None
    connection: Connection

    @property
    def forward(self) -> float:
        """The plant's direction of what the firmware counts as forward."""
        return -1.0 if self.truth.plant["phases_swapped"] else 1.0

    def rows(self, firmware: Firmware, plan: Plan, windows: list[Window], values: Mapping[str, float],
             warm_up: bool) -> list[dict[str, Any]]:  # fmt: skip
        """The windows whose torque the firmware takes, with these values of the firmware."""
        windows = [each for each in windows if abs(each.torque_Nm) <= firmware.motor.config.machine.torque_max_Nm]
        with firmware.connected(self) as loop:
            loop.record(("run_state",))
            loop.run_s(SETTLE_S)
            for name, value in values.items():
                loop.set(name, value)
            loop.set("enable", 1.0)
            tour = Tour(loop, plan.spec, COUNTED, self.forward)
            if warm_up:
                tour.warm_up(plan.profile)
            tour.measure(windows)
        trace, share = tour.trace, Check().oscillation_share
        whole = run_row(trace, COUNTED)
        return [{"window": k} | window_row(window, trace.columns, rows, plan.rated_Nm, share) | whole
                for k, (window, rows) in enumerate(zip(windows, trace.windows, strict=True))]  # fmt: skip


def fresh_rows(machine: Coupled, fresh: Firmware, plan: Plan) -> list[dict[str, Any]]:
    """With the tables of a commissioning alone, and with the torque correction after a drive."""
    return [_head(controller, plan) | row
            for controller, values, warm_up in ((TABLES, ALONE, False), (ROBUST, CORRECTED, True))
            for row in machine.rows(fresh, plan, plan.windows, values, warm_up)]  # fmt: skip


def drive(machine: Coupled, fresh: Firmware, before: Firmware, plan: Plan) -> list[dict[str, Any]]:
    """Before a commissioning in a few windows, then fresh_rows()."""
    guessed = machine.rows(before, plan, plan.windows[::FEW], GUESSED, warm_up=False)
    return [_head(NAMEPLATE, plan) | row for row in guessed] + fresh_rows(machine, fresh, plan)


def _head(controller: str, plan: Plan) -> dict[str, Any]:
    return {"controller": controller, "middle_rpm": plan.middle_rpm}
