# SPDX-License-Identifier: Apache-2.0
"""The scenario file: strict, every field with its unit in the name."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from fluxtrue_tools import faults, strict
from fluxtrue_tools.sim import effects
from fluxtrue_tools.strict import AnyNumber, Flag, Number, PartError, Strict, any_number

POINTS_MAX = 10_000
POINTS_ALLOWED = "allowed: a number, or a list of [t, value]"
COUNT_MAX = 1_000_000_000  # periods or samples; the simulation has them as whole numbers
SHARE_ALLOWED = "-1 to 1 (of the motor's torque_max_Nm)"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _check_times(points: list[list[float]]) -> None:
    """Refuse the first point whose time does not fit those before it."""
    for index, (time, _) in enumerate(points):
        if time < 0.0:
            raise PartError((index,), points[index], "a time that is not negative")
        if index >= 1 and time < points[index - 1][0]:
            raise PartError((index,), points[index], f"times must not go backwards, from {points[index - 1][0]:g} s on")
        if index >= 2 and time == points[index - 2][0]:
            raise PartError((index,), points[index], "at most two points may share a time: before and after a step")


def _points(value: Any) -> Any:
    """A plain number is constant; a list of [time, value] is piecewise linear."""
    if _is_number(value):
        if not math.isfinite(any_number(value)):
            raise PartError((), value, "a finite number")
        return ((0.0, any_number(value)),)
    if not isinstance(value, list) or not value:
        raise ValueError(POINTS_ALLOWED)
    for index, point in enumerate(value):
        pair = isinstance(point, list) and len(point) == 2
        if not pair or not all(_is_number(x) and math.isfinite(any_number(x)) for x in point):
            raise PartError((index,), point, "[t, value], two finite numbers")
    if len(value) > POINTS_MAX:
        raise ValueError(f"{len(value)} points, allowed: up to {POINTS_MAX}")
    _check_times(value)
    return tuple((any_number(time), any_number(one)) for time, one in value)


SHARES = {"torque_share": "torque_Nm", "speed_share": "speed_rpm"}
Points = Annotated[tuple[tuple[float, float], ...], BeforeValidator(_points)]

Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
AnyPositive = Annotated[AnyNumber, Field(gt=0)]
AnyNotNegative = Annotated[AnyNumber, Field(ge=0)]


def _three(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("allowed: a list of three, one for each phase")
    return tuple(value)


Three = Annotated[tuple[AnyNumber, AnyNumber, AnyNumber], BeforeValidator(_three)]
ThreeFlags = Annotated[tuple[bool, bool, bool], BeforeValidator(_three)]


class Controller(BaseModel):
    """Which controller runs, and its calibration: every other key is a name of the controller."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, Flag]

    kind: Literal["firmware", "twin"] = "firmware"
    enable: bool = True
    torque_loop: bool = True
    identification: bool = True
    identification_mode: Literal["paper", "robust"] = "robust"

    @model_validator(mode="after")
    def _no_plant(self) -> "Controller":
        for name in self.__pydantic_extra__ or {}:
            if "." in name:
                raise ValueError(
                    f"{name} is not the controller's, allowed: names without a dot; [plant] has the plant's"
                )
        return self

    def values(self) -> dict[str, float]:
        """Names and numbers as the controller takes them."""
        flags = {name: float(getattr(self, name)) for name in ("torque_loop", "identification")}
        flags["identification_mode"] = float(self.identification_mode == "robust")
        return flags | (self.__pydantic_extra__ or {}) | {"enable": float(self.enable)}


class Profile(Strict):
    """Requests and surroundings of the drive over time."""

    torque_Nm: Points = ((0.0, 0.0),)
    torque_share: Points | None = None  # of the motor's torque_max_Nm, instead
    speed_rpm: Points = ((0.0, 0.0),)
    speed_share: Points | None = None  # of the motor's speed_max_rpm, instead
    vdc_V: Points | None = None
    winding_C: Points = ((0.0, 20.0),)
    magnet_scale: Points = ((0.0, 1.0),)
    load_Nm: Points = ((0.0, 0.0),)

    @model_validator(mode="after")
    def _once(self) -> "Profile":
        for share, absolute in SHARES.items():
            if {share, absolute} <= self.given():
                raise ValueError(f"profile.{share} and profile.{absolute}: give one of the two")
        points = self.torque_share or ()
        for index, (time, value) in enumerate(points):
            if abs(value) > 1.0:
                raise PartError(*(("torque_share",), value) if len(points) == 1 else
                                (("torque_share", index), [time, value]), SHARE_ALLOWED)  # fmt: skip
        return self

    def key(self, name: str) -> str:
        """The key that a quantity was given by."""
        other = next((share for share, absolute in SHARES.items() if absolute == name), name)
        return f"profile.{other if other in self.given() else name}"

    def resolved(self, torque_max_Nm: float, speed_max_rpm: float) -> "Profile":
        """The profile with shares of rated values replaced by the values of a motor."""
        factors = {"torque_share": torque_max_Nm, "speed_share": speed_max_rpm}
        worked_out = {
            SHARES[share]: tuple((t, factor * value) for t, value in getattr(self, share))
            for share, factor in factors.items()
            if getattr(self, share) is not None
        }
        return self.model_copy(update=worked_out)


class Mechanics(Strict):
    """The shaft: a speed imposed by [profile] speed_rpm, or an inertia that starts there."""

    mode: Literal["imposed", "inertia"] = "imposed"
    inertia_kgm2: Positive | None = None
    viscous_Nms: NotNegative = 0.0


class Plant(Strict):
    """Deviations of the drive. Left out: the motor's own data without errors."""

    r_ohm_20: AnyPositive | None = None
    r_temp_coeff_per_K: AnyNumber | None = None
    ld_H: AnyPositive | None = None
    lq_H: AnyPositive | None = None
    psi_f_Vs: AnyPositive | None = None
    magnet_temp_coeff_per_K: AnyNumber | None = None
    rotor_C: AnyNumber | None = None
    lq_scale: AnyPositive | None = None
    ld_slope_scale: AnyPositive | None = None
    cross_saturation_scale: AnyNumber | None = None
    iron_k_h: AnyNotNegative | None = None
    iron_k_e: AnyNotNegative | None = None
    iron_k_excess: AnyNotNegative | None = None
    magnet_step_keeps_current: bool | None = None
    vdc_ripple_V: AnyNotNegative | None = None
    vdc_ripple_hz: AnyNotNegative | None = None
    dead_time_s: AnyNotNegative | None = None
    device_drop_V: AnyNotNegative | None = None
    leg_knee_A: AnyNotNegative | None = None
    substeps: Annotated[int, Field(ge=10, le=1000)] | None = None
    ideal_inverter: bool | None = None
    phase_open: ThreeFlags | None = None
    switch_open_upper: ThreeFlags | None = None
    switch_open_lower: ThreeFlags | None = None
    switch_shorted_upper: ThreeFlags | None = None
    switch_shorted_lower: ThreeFlags | None = None
    short_circuit_A: AnyPositive | None = None
    desaturation_s: AnyNotNegative | None = None
    desaturation_open: bool | None = None
    drivers_block: bool | None = None
    series_d_V: AnyNumber | None = None
    series_q_V: AnyNumber | None = None
    current_full_scale_A: AnyPositive | None = None
    adc_bits: Annotated[int, Field(ge=1, le=24)] | None = None
    current_gain: Three | None = None
    current_offset_A: Three | None = None
    current_noise_A_rms: AnyNotNegative | None = None
    current_quantise: bool | None = None
    current_stuck: ThreeFlags | None = None
    current_open: ThreeFlags | None = None
    converter_reference: AnyPositive | None = None
    known_voltage_gain: AnyNumber | None = None
    vdc_full_scale_V: AnyPositive | None = None
    vdc_gain: AnyNumber | None = None
    vdc_offset_V: AnyNumber | None = None
    vdc_quantise: bool | None = None
    phases_swapped: bool | None = None
    angle_reversed: bool | None = None
    angle_offset_rad: AnyNumber | None = None
    angle_h1_rad: AnyNumber | None = None
    angle_h1_phase: AnyNumber | None = None
    angle_h2_rad: AnyNumber | None = None
    angle_h2_phase: AnyNumber | None = None
    resolver_pole_pairs: AnyPositive | None = None
    angle_bits: Annotated[int, Field(ge=0, le=24)] | None = None
    angle_delay_s: AnyNotNegative | None = None
    angle_stuck: bool | None = None
    angle_sine_stuck: bool | None = None
    angle_cosine_stuck: bool | None = None
    angle_length_check: bool | None = None
    angle_spike_every: Annotated[int, Field(ge=0, le=COUNT_MAX)] | None = None
    angle_spike_samples: Annotated[int, Field(ge=0, le=COUNT_MAX)] | None = None
    angle_spike_rad: AnyNumber | None = None
    theta_m_rad: AnyNumber | None = None
    coulomb_Nm: AnyNotNegative | None = None
    stiction_Nm: AnyNotNegative | None = None
    stribeck_rad_s: AnyPositive | None = None

    def values(self) -> dict[str, float]:
        """Names as the simulation has them: arrays end in _a, _b, _c."""
        values: dict[str, float] = {}
        for name, value in self.model_dump(exclude_none=True).items():
            if isinstance(value, tuple):
                values |= {f"{name}_{x}": float(v) for x, v in zip("abc", value, strict=True)}
            else:
                values[name] = float(value)
        return values


FLAGS = ("enable", "torque_loop", "identification", "identification_mode", "trim", "fault_reset",
         "identification_reset", "current_mode", "machine_monitors", "commission")  # fmt: skip


def _kind_of(name: str) -> type | None:
    """Type of a name in an event: bool and int where the simulation would truncate a fraction."""
    if name in FLAGS:
        return bool
    base = name.removeprefix("plant.").removesuffix("_a").removesuffix("_b").removesuffix("_c")
    field = Plant.model_fields.get(base) if name.startswith("plant.") else None
    if field is None:
        return None
    words = str(field.annotation)
    return bool if "bool" in words else int if "int" in words else None


class Event(Strict):
    """At a time, set plant fields ("plant.…") or names of the controller."""

    t: NotNegative
    set: Annotated[dict[str, Flag], Field(min_length=1)]

    @model_validator(mode="after")
    def _whole(self) -> "Event":
        for name, value in self.set.items():
            kind = _kind_of(name)
            if (kind is bool and value not in (0.0, 1.0)) or (kind is int and not value.is_integer()):
                what = "true or false" if kind is bool else "a whole number"
                raise ValueError(f"set.{name} = {value:g}, allowed: {what}")
        return self


def _events(value: Any) -> Any:
    if not isinstance(value, list):
        raise ValueError("allowed: tables [[event]]")
    return tuple(value)


class Window(Strict):
    """The time window of the summary, by default the last 0.3 s."""

    from_s: NotNegative | None = None
    to_s: Positive | None = None


class Scenario(Strict):
    """A scenario: everything that describes one run."""

    motor: Annotated[str, Field(min_length=1)]
    expect_fault: str | None = None  # a run that trips fails unless its fault is named here
    duration_s: Annotated[Number, Field(gt=0, le=36000)]
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 1
    record_every_s: Positive = 1e-3
    controller: Controller = Controller()
    profile: Profile = Profile()
    mechanics: Mechanics = Mechanics()
    plant: Plant = Plant()
    event: Annotated[tuple[Event, ...], BeforeValidator(_events)] = ()
    window: Window = Window()

    @model_validator(mode="after")
    def _consistent(self) -> "Scenario":
        for index, event in enumerate(self.event):
            if event.t >= self.duration_s:
                raise ValueError(f"event.{index}.t = {event.t:g} s: after the end, allowed: from 0 up to and without "
                                 f"duration_s = {self.duration_s:g} s")  # fmt: skip
            for name in event.set:
                if name in self.profiled():
                    raise ValueError(f"event.{index}.set.{name}: the profile drives it, take one of the two")
        speed = self.profile.key("speed_rpm")
        if self.mechanics.mode == "inertia" and len(getattr(self.profile, speed.removeprefix("profile."))) > 1:
            raise ValueError(f"{speed}: with an inertia only the initial speed can be given")
        first, last = self.averaged()
        if not first < last <= self.duration_s:
            raise ValueError(f"window: from_s = {first:g} s, to_s = {last:g} s, allowed: from_s below to_s, to_s up to "
                             f"duration_s = {self.duration_s:g} s")  # fmt: skip
        if self.expect_fault is not None and self.expect_fault not in faults.names().values():
            raise ValueError(f"expect_fault = {self.expect_fault!r}, allowed: {', '.join(faults.names().values())}")
        return self

    def resolved(self, torque_max_Nm: float, speed_max_rpm: float) -> "Scenario":
        """The scenario for a motor, with torque and speed in their units."""
        return self.model_copy(update={"profile": self.profile.resolved(torque_max_Nm, speed_max_rpm)})

    def averaged(self) -> tuple[float, float]:
        """Begin and end of the window."""
        last = self.duration_s if self.window.to_s is None else self.window.to_s
        first = max(last - 0.3, 0.0) if self.window.from_s is None else self.window.from_s
        return first, last

    def profiled(self) -> set[str]:
        """Names in the simulation that a profile with more than one point drives."""
        named = {
            "torque_requested_Nm": self.profile.torque_share or self.profile.torque_Nm,
            "plant.speed_rad_s": self.profile.speed_share or self.profile.speed_rpm,
            "plant.vdc_V": self.profile.vdc_V or (),
            "plant.winding_C": self.profile.winding_C,
            "plant.magnet_scale": self.profile.magnet_scale,
            "plant.load_Nm": self.profile.load_Nm,
        }
        return {name for name, points in named.items() if len(points) > 1}


def parse(text: str, name: str) -> Scenario:
    """A scenario from TOML text; `name` is for messages. In a file, a key without effect is an error too."""
    scenario = strict.parse(Scenario, text, name)
    effects.check(scenario, name)
    return scenario


def read(path: Path) -> Scenario:
    """A scenario file."""
    return parse(strict.read_text(path), str(path))
