# SPDX-License-Identifier: Apache-2.0
"""campaign.toml: strict, every field with its unit in the name."""

import hashlib
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, model_validator

from fluxtrue_tools import strict
from fluxtrue_tools.sim.scenario import NotNegative, Plant, Positive
from fluxtrue_tools.strict import Flag, Number, Strict


def _pair(value: Any) -> Any:
    """The list [low, high] of a file as a tuple, after a check of its order."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError("allowed: [low, high]")
    low, high = value
    if isinstance(low, int | float) and isinstance(high, int | float) and low > high:
        raise ValueError("allowed: [low, high] with low up to high")
    return tuple(value)


def _list(value: Any) -> Any:
    if not isinstance(value, list):
        raise ValueError("allowed: a list")
    return tuple(value)


def _within(low: float, high: float) -> Any:
    """A range inside given limits; a value beyond them is probably an error of units."""
    number = Annotated[Number, Field(ge=low, le=high)]
    return Annotated[tuple[number, number], BeforeValidator(_pair)]  # type: ignore[valid-type]


class Spread(Strict):
    """Uniform ranges. Factors of the motor's data, unless the name has a unit."""

    lq_scale: _within(0.5, 2.0) = (0.9, 1.1)
    ld_slope_scale: _within(0.5, 2.0) = (0.9, 1.1)
    cross_saturation_scale: _within(0.0, 2.0) = (0.8, 1.2)
    magnet_scale: _within(0.3, 1.5) = (0.8, 1.05)
    resistance_scale: _within(0.5, 3.0) = (0.9, 1.7)
    winding_error_C: _within(-50.0, 50.0) = (-5.0, 5.0)
    dead_time_scale: _within(0.0, 3.0) = (0.8, 1.2)
    device_drop_error_V: _within(-5.0, 5.0) = (-0.5, 0.5)
    vdc_gain: _within(0.9, 1.1) = (0.995, 1.005)
    current_gain: _within(0.9, 1.1) = (0.995, 1.005)
    current_offset_share: _within(-0.05, 0.05) = (-0.002, 0.002)
    angle_offset_deg: _within(-30.0, 30.0) = (-0.5, 0.5)
    angle_harmonic_deg: _within(0.0, 10.0) = (0.0, 1.0)
    iron_loss_scale: _within(0.0, 3.0) = (0.7, 1.3)


class Nominal(Strict):
    """Nominal values of the spread that the motor's data do not give (or give as 0)."""

    device_drop_V: NotNegative = 0.0
    iron_k_h: NotNegative = 0.0
    iron_k_e: NotNegative = 0.0


class Vehicle(Strict):
    """Converts a car's speed to the motor's torque and speed."""

    mass_kg: Positive = 1600.0
    wheel_radius_m: Positive = 0.32
    gear_ratio: Positive = 9.0
    rolling_N: NotNegative = 130.0
    drag_N_per_m2_s2: NotNegative = 0.40


class Drive(Strict):
    """The warm-up drive in which the controller identifies the machine."""

    duration_s: Annotated[Number, Field(ge=1, le=600)] = 60.0
    vehicle: Vehicle = Vehicle()


class Windows(Strict):
    """Where torque is measured."""

    speed_rpm: Annotated[
        tuple[tuple[Positive, Positive, Annotated[int, Field(ge=1, le=100)]], ...],
        BeforeValidator(lambda v: tuple(tuple(x) if isinstance(x, list) else x for x in _list(v))),
        Field(min_length=1, max_length=50),
    ] = ((300.0, 5000.0, 8), (5000.0, 10000.0, 4))
    low_speed_rpm: Annotated[tuple[Positive, ...], BeforeValidator(_list)] = (50.0, 150.0)
    torque_min_Nm: Positive = 10.0
    settle_s: Annotated[Number, Field(ge=0.01, le=10)] = 0.25
    measure_s: Annotated[Number, Field(ge=0.01, le=10)] = 0.2
    slew_rpm_per_s: Positive = 10000.0

    @model_validator(mode="after")
    def _rising(self) -> Self:
        for low, high, _ in self.speed_rpm:
            if low >= high:
                raise ValueError(f"windows.speed_rpm: {low:g} to {high:g}, allowed: [low, high, strata], low < high")
        return self


class Controller(Strict):
    """One way to run the firmware: names and numbers as fluxtrue_set() takes them. With `cases`, it runs in so many of
    the first cases only."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,23}$")]
    set: dict[str, Flag]
    warm_up: bool = True
    cases: Annotated[int, Field(ge=1, le=100000)] | None = None

    def runs_in(self, case: int) -> bool:
        """Whether this controller is measured in a case."""
        return self.cases is None or case < self.cases


class Limits(Strict):
    """The bounds that `check` holds its controllers to, percent."""

    rms_low: Positive = 0.8
    p99_low: Positive = 2.5
    rms_high: Positive = 1.2
    p99_high: Positive = 3.0
    no_harm_share: Positive = 99.0
    no_harm_slack: Positive = 0.5
    no_harm_floor: Positive = 2.0
    low_speed_slack: Positive = 1.0


class Check(Strict):
    """Controllers that must meet the bounds, and the reference for harm."""

    controllers: Annotated[tuple[str, ...], BeforeValidator(_list)] = ()
    reference: str = "tables"
    crawl_rpm: Positive = 300.0
    band_rpm: Positive = 5000.0
    count_nonzero: Annotated[tuple[str, ...], BeforeValidator(_list)] = ("psi_clamped", "r_clamped")
    oscillation_share: Positive = 0.1
    limits: Limits = Limits()


class Campaign(Strict):
    """One campaign."""

    motor: Annotated[str, Field(min_length=1)]
    cases: Annotated[int, Field(ge=1, le=100000)]
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    noise_share: Annotated[Number, Field(ge=0, le=0.1)] = 0.002
    controller: Annotated[tuple[Controller, ...], BeforeValidator(_list), Field(min_length=1, max_length=8)]
    spread: Spread = Spread()
    nominal: Nominal = Nominal()
    plant: Plant = Plant()
    drive: Drive = Drive()
    windows: Windows = Windows()
    check: Check = Check()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        names = [controller.name for controller in self.controller]
        if len(set(names)) < len(names):
            raise ValueError(f"controller: {', '.join(names)}, allowed: every name once")
        for name in self.check.controllers:
            if name not in names:
                raise ValueError(f"check.controllers: '{name}', allowed: {', '.join(names)}")
        if self.check.crawl_rpm >= self.check.band_rpm:
            raise ValueError(f"check.crawl_rpm: {self.check.crawl_rpm:g}, allowed: below check.band_rpm, "
                             f"{self.check.band_rpm:g}")  # fmt: skip
        if self.check.controllers and self.check.reference not in names:
            raise ValueError(f"check.reference: '{self.check.reference}', allowed: {', '.join(names)}")
        for controller in self.controller:
            if controller.cases is not None and controller.name in {*self.check.controllers, self.check.reference}:
                raise ValueError(f"controller.{names.index(controller.name)}.cases: {controller.cases}, allowed: for "
                                 "a controller outside check.controllers that is not check.reference")  # fmt: skip
        return self

    def digest(self) -> str:
        """Changes with every value of the file, not with its comments."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()


def parse(text: str, name: str) -> Campaign:
    """A campaign from TOML text; `name` is for messages."""
    return strict.parse(Campaign, text, name)


def read(path: Path) -> Campaign:
    """A campaign file."""
    return parse(strict.read_text(path), str(path))
