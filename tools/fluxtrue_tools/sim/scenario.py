# SPDX-License-Identifier: Apache-2.0
"""The scenario file: strict, every field with its unit in the name."""

import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from fluxtrue_tools.errors import FluxtrueError


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _number(value: Any) -> Any:
    """TOML tells 1 from 1.0; nobody who writes a speed of 1000 means anything by it."""
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    try:
        return float(value)
    except OverflowError:
        return math.inf


Number = Annotated[float, BeforeValidator(_number)]


def _points(value: Any) -> Any:
    """A plain number holds for ever; a list of [time, value] is piecewise linear."""
    value = _number(value)
    if isinstance(value, float):
        return ((0.0, value),)
    if not isinstance(value, list) or not value:
        raise ValueError("allowed: a number, or a list of [t, value]")
    points = []
    for point in value:
        if not (
            isinstance(point, list)
            and len(point) == 2
            and all(isinstance(x, int | float) and not isinstance(x, bool) for x in point)
            and all(math.isfinite(_number(x)) for x in point)
        ):
            raise ValueError("allowed: a number, or a list of [t, value]")
        points.append((float(point[0]), float(point[1])))
    times = [time for time, _ in points]
    if times != sorted(times) or times[0] < 0.0:
        raise ValueError("times must not be negative nor go backwards")
    if any(times.count(time) > 2 for time in times):
        raise ValueError("at most two points may share a time: before and after a step")
    return tuple(points)


Points = Annotated[tuple[tuple[float, float], ...], BeforeValidator(_points)]

Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]


def _three(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("allowed: a list of three, one for each phase")
    return tuple(value)


Three = Annotated[tuple[Number, Number, Number], BeforeValidator(_three)]
ThreeFlags = Annotated[tuple[bool, bool, bool], BeforeValidator(_three)]


class Controller(BaseModel):
    """Which controller runs, and its calibration: every other key is a name of the controller."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, Annotated[float, BeforeValidator(lambda v: _flag(v))]]

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


def _flag(value: Any) -> Any:
    return float(value) if isinstance(value, bool) else _number(value)


class Profile(_Strict):
    """What the drive is asked to do and what happens around it, over time."""

    torque_Nm: Points = ((0.0, 0.0),)
    speed_rpm: Points = ((0.0, 0.0),)
    vdc_V: Points | None = None
    winding_C: Points = ((0.0, 20.0),)
    magnet_scale: Points = ((0.0, 1.0),)
    load_Nm: Points = ((0.0, 0.0),)


class Mechanics(_Strict):
    """The shaft: a speed imposed by [profile] speed_rpm, or an inertia that starts there."""

    mode: Literal["imposed", "inertia"] = "imposed"
    inertia_kgm2: Positive | None = None
    viscous_Nms: NotNegative = 0.0


class Plant(_Strict):
    """What is wrong with the drive. Left out: the motor's own data, and nothing wrong."""

    r_ohm_20: Positive | None = None
    r_temp_coeff_per_K: Number | None = None
    ld_H: Positive | None = None
    lq_H: Positive | None = None
    psi_f_Vs: Positive | None = None
    magnet_temp_coeff_per_K: Number | None = None
    rotor_C: Number | None = None
    lq_scale: Positive | None = None
    ld_slope_scale: Positive | None = None
    cross_saturation_scale: Number | None = None
    iron_k_h: NotNegative | None = None
    iron_k_e: NotNegative | None = None
    magnet_step_keeps_current: bool | None = None
    vdc_ripple_V: NotNegative | None = None
    vdc_ripple_hz: NotNegative | None = None
    dead_time_s: NotNegative | None = None
    device_drop_V: NotNegative | None = None
    substeps: Annotated[int, Field(ge=10, le=1000)] | None = None
    ideal_inverter: bool | None = None
    phase_open: ThreeFlags | None = None
    current_full_scale_A: Positive | None = None
    adc_bits: Annotated[int, Field(ge=1, le=24)] | None = None
    current_gain: Three | None = None
    current_offset_A: Three | None = None
    current_noise_A_rms: NotNegative | None = None
    current_quantise: bool | None = None
    current_stuck: ThreeFlags | None = None
    current_open: ThreeFlags | None = None
    vdc_full_scale_V: Positive | None = None
    vdc_gain: Number | None = None
    vdc_quantise: bool | None = None
    angle_offset_rad: Number | None = None
    angle_h1_rad: Number | None = None
    angle_h1_phase: Number | None = None
    angle_h2_rad: Number | None = None
    angle_h2_phase: Number | None = None
    resolver_pole_pairs: Positive | None = None
    angle_bits: Annotated[int, Field(ge=0, le=24)] | None = None
    angle_delay_s: NotNegative | None = None
    angle_stuck: bool | None = None
    theta_m_rad: Number | None = None

    def values(self) -> dict[str, float]:
        """Names as the simulation has them: arrays end in _a, _b, _c."""
        values: dict[str, float] = {}
        for name, value in self.model_dump(exclude_none=True).items():
            if isinstance(value, tuple):
                values |= {f"{name}_{x}": float(v) for x, v in zip("abc", value, strict=True)}
            else:
                values[name] = float(value)
        return values


class Event(_Strict):
    """At a time, set plant fields ("plant.…") or names of the controller."""

    t: NotNegative
    set: dict[str, Annotated[float, BeforeValidator(_flag)]] = Field(min_length=1)


def _events(value: Any) -> Any:
    if not isinstance(value, list):
        raise ValueError("allowed: tables [[event]]")
    return tuple(value)


class Window(_Strict):
    """What the summary averages; left out: the last 0.3 s."""

    from_s: NotNegative | None = None
    to_s: Positive | None = None


class Scenario(_Strict):
    """One run."""

    motor: str = Field(min_length=1)
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
            if event.t > self.duration_s:
                raise ValueError(f"event.{index}.t = {event.t:g}: after the end, allowed: 0 to duration_s")
            for name in event.set:
                if name in self.profiled():
                    raise ValueError(f"event.{index}.set.{name}: the profile drives it, take one of the two")
        if self.mechanics.mode == "inertia" and len(self.profile.speed_rpm) > 1:
            raise ValueError("profile.speed_rpm: with an inertia only the initial speed can be given")
        first, last = self.averaged()
        if not first < last <= self.duration_s:
            raise ValueError(f"window: {first:g} to {last:g} s, allowed: within 0 to duration_s")
        return self

    def averaged(self) -> tuple[float, float]:
        """Begin and end of the window."""
        last = self.duration_s if self.window.to_s is None else self.window.to_s
        first = max(last - 0.3, 0.0) if self.window.from_s is None else self.window.from_s
        return first, last

    def profiled(self) -> set[str]:
        """Names in the simulation that a profile with more than one point drives."""
        named = {
            "torque_command_Nm": self.profile.torque_Nm,
            "plant.speed_rad_s": self.profile.speed_rpm,
            "plant.vdc_V": self.profile.vdc_V or (),
            "plant.winding_C": self.profile.winding_C,
            "plant.magnet_scale": self.profile.magnet_scale,
            "plant.load_Nm": self.profile.load_Nm,
        }
        return {name for name, points in named.items() if len(points) > 1}


_ALLOWED = {
    "missing": "this field is required",
    "extra_forbidden": "unknown field",
}


def _explain(error: ValidationError) -> str:
    """The first complaint as one line: field, value, what is allowed."""
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"]) or "scenario"
    text = _ALLOWED.get(first["type"], first["msg"].removeprefix("Value error, "))
    if not first["loc"] and first["type"] == "value_error":
        return text
    if first["type"] in _ALLOWED:
        return f"{where}: {text}{_fields(first['loc'])}"
    value = first["input"]
    shown = repr(value) if len(repr(value)) <= 60 else repr(value)[:57] + "..."
    return f"{where} = {shown}: {text[0].lower() + text[1:]}"


def _fields(location: tuple[int | str, ...]) -> str:
    """The fields of the table that a bad key is in."""
    model: Any = Scenario
    for part in location[:-1]:
        if isinstance(part, str):
            model = {"event": Event}.get(part) or model.model_fields[part].annotation
    return f", allowed: {', '.join(model.model_fields)}"


def parse(text: str, name: str) -> Scenario:
    """A scenario from TOML text; `name` is for messages."""
    try:
        return Scenario.model_validate(tomllib.loads(text))
    except ValidationError as error:
        raise FluxtrueError(f"{name}: {_explain(error)}") from error
    except (ValueError, RecursionError) as error:  # tomllib's own error is a ValueError
        raise FluxtrueError(f"{name}: not TOML: {error}") from error


def read(path: Path) -> Scenario:
    """A scenario file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise FluxtrueError(f"{path}: not UTF-8 text") from error
    return parse(text, str(path))
