# SPDX-License-Identifier: Apache-2.0
"""Keys of a scenario that have no effect in their combination: an error, because they were written for a purpose."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from fluxtrue_tools.errors import FluxtrueError

if TYPE_CHECKING:
    from fluxtrue_tools.sim.scenario import Event, Plant, Scenario

Found = tuple[str, str]  # key, why

PAPER_GAINS = ("observer_m", "flux_bandwidth_rad_s", "resistance_bandwidth_rad_s")
ROBUST_ONLY = ("trim",)
TWIN_ONLY = ("current_quantise", "vdc_quantise")
WHOLE_CODES = "the firmware always gets the converter's whole codes"
MAP_INSTEAD = ("ld_H", "lq_H", "psi_f_Vs")
ONLY_WITH_MAP = ("cross_saturation_scale",)
SPIKE = ("angle_spike_every", "angle_spike_samples", "angle_spike_rad")
TRACKS = ("angle_sine_stuck", "angle_cosine_stuck")
OF_A_SHORTED_SWITCH = ("short_circuit_A", "desaturation_s", "desaturation_open")
ONLY_WHILE = {"current_mode": ("id_ref_A", "iq_ref_A"), "pulses": ("pulses_",)}  # beginnings of names
AT_START = {"plant.seed": "seed", "plant.theta_m_rad": "plant.theta_m_rad"}


class _Plant:
    """The values of the plant's fields during a run: those given, and those that events set."""

    def __init__(self, table: "Plant", events: "tuple[Event, ...]" = ()) -> None:
        self.table = table
        self.given = self.table.given()
        self.events = {name for event in events for name in event.set}

    def always(self, name: str, default: Any) -> bool:
        """Whether a field has this value during the whole run."""
        value = getattr(self.table, name)
        return (default if value is None else value) == default and f"plant.{name}" not in self.events

    def is_on(self, name: str) -> bool:
        """Whether a flag is given as true and no event changes it."""
        return bool(getattr(self.table, name)) and f"plant.{name}" not in self.events

    def has_shorted_switch(self) -> bool:
        """Whether a switch is shorted at any time."""
        at_start = (getattr(self.table, f"switch_shorted_{side}") or () for side in ("upper", "lower"))
        return any(map(any, at_start)) or any(name.startswith("plant.switch_shorted_") for name in self.events)


def _points(scenario: "Scenario") -> Iterator[Found]:
    for name in sorted(scenario.profile.given()):
        points = getattr(scenario.profile, name) or ()
        for before, point in pairwise(points):
            if before[0] >= scenario.duration_s:
                yield (f"profile.{name}", f"its point [{point[0]:g}, {point[1]:g}] is never approached: the run ends "
                                          f"at duration_s = {scenario.duration_s:g} s")  # fmt: skip
                break


def _mechanics(scenario: "Scenario", plant: _Plant) -> Iterator[Found]:
    if scenario.mechanics.mode == "imposed" and "plant.imposed_speed" not in plant.events:
        why = "the speed is imposed; allowed with mechanics.mode = 'inertia'"
        if "inertia_kgm2" in scenario.mechanics.given():
            yield "mechanics.inertia_kgm2", why
        if "load_Nm" in scenario.profile.given():
            yield "profile.load_Nm", why


def _inverter(plant: _Plant) -> Iterator[Found]:
    if plant.is_on("ideal_inverter"):
        for name in ("dead_time_s", "device_drop_V", "leg_knee_A"):
            yield f"plant.{name}", "plant.ideal_inverter = true has neither dead time nor device drop"
    if plant.always("vdc_ripple_V", 0.0):
        yield "plant.vdc_ripple_hz", "plant.vdc_ripple_V is 0"
    if plant.always("vdc_ripple_hz", 0.0):
        yield "plant.vdc_ripple_V", "plant.vdc_ripple_hz is 0"
    if not plant.has_shorted_switch():
        for name in OF_A_SHORTED_SWITCH:
            yield f"plant.{name}", "no switch is shorted (plant.switch_shorted_upper, plant.switch_shorted_lower)"


def _sensors(plant: _Plant) -> Iterator[Found]:
    silent = [k for k in (1, 2) if plant.always(f"angle_h{k}_rad", 0.0)]
    for k in silent:
        yield f"plant.angle_h{k}_phase", f"plant.angle_h{k}_rad is 0"
    tracks_move = all(plant.always(name, False) for name in TRACKS)
    if tracks_move:
        yield "plant.angle_length_check", " and ".join(f"plant.{name}" for name in TRACKS) + " are false"
    if len(silent) == 2 and tracks_move:
        yield "plant.resolver_pole_pairs", "plant.angle_h1_rad and plant.angle_h2_rad are 0"
    for zero in (name for name in SPIKE if plant.always(name, 0)):
        for name in SPIKE:
            if name != zero:
                yield f"plant.{name}", f"plant.{zero} is 0"


def _friction(plant: _Plant) -> Iterator[Found]:
    if plant.always("stiction_Nm", 0.0):
        yield "plant.stribeck_rad_s", "plant.stiction_Nm is 0"


def _magnet(plant: _Plant) -> Iterator[Found]:
    if plant.always("magnet_temp_coeff_per_K", 0.0):
        yield "plant.rotor_C", "plant.magnet_temp_coeff_per_K is 0"
    if plant.always("rotor_C", 20.0):
        yield "plant.magnet_temp_coeff_per_K", "plant.rotor_C is 20 °C, where the magnet has its nominal flux"


def of_plant(table: "Plant") -> Iterator[Found]:
    """Fields of a plant that nothing changes later, with the firmware as its controller."""
    yield from _inverter(_Plant(table))
    yield from _magnet(_Plant(table))
    for name in TWIN_ONLY:
        yield f"plant.{name}", WHOLE_CODES


def _machine(scenario: "Scenario", plant: _Plant) -> Iterator[Found]:
    yield from _magnet(plant)
    if {value for _, value in scenario.profile.winding_C} == {20.0} and "plant.winding_C" not in plant.events:
        yield "plant.r_temp_coeff_per_K", "profile.winding_C is 20 °C, where the resistance is r_ohm_20"
    moves = {"plant.magnet_scale", "plant.rotor_C", "plant.magnet_temp_coeff_per_K"} & plant.events
    if len(scenario.profile.magnet_scale) == 1 and not moves:
        yield "plant.magnet_step_keeps_current", "the magnet's flux does not change in this run"


def _controller(scenario: "Scenario", plant: _Plant) -> Iterator[Found]:
    calibration = scenario.controller.__pydantic_extra__ or {}
    mode = scenario.controller.identification_mode
    idle = PAPER_GAINS if mode == "robust" else ROBUST_ONLY
    other = "paper" if mode == "robust" else "robust"
    if "identification_mode" not in plant.events:
        for name in filter(calibration.__contains__, idle):
            yield f"controller.{name}", f"it belongs to controller.identification_mode = '{other}'"
    if "torque_requested_Nm" in calibration:
        yield "controller.torque_requested_Nm", f"{scenario.profile.key('torque_Nm')} requests the torque"
    if scenario.controller.kind == "firmware":
        for name in TWIN_ONLY:
            if name in plant.given or f"plant.{name}" in plant.events:
                yield f"plant.{name}", f"{WHOLE_CODES}; allowed with controller.kind = 'twin'"
    for switch, beginnings in ONLY_WHILE.items():
        if not calibration.get(switch) and switch not in plant.events:
            for name in (name for name in calibration if name.startswith(beginnings)):
                yield f"controller.{name}", f"controller.{switch} is 0"


def _events(scenario: "Scenario", plant: _Plant) -> Iterator[Found]:
    for index, event in enumerate(scenario.event):
        for name in event.set:
            if name in AT_START:
                yield f"event.{index}.set.{name}", f"it is taken at the start only; allowed: {AT_START[name]}"


def _found(scenario: "Scenario") -> Iterator[Found]:
    plant = _Plant(scenario.plant, scenario.event)
    yield from _points(scenario)
    yield from _mechanics(scenario, plant)
    yield from _controller(scenario, plant)
    if "seed" in scenario.given() and plant.always("current_noise_A_rms", 0.0):
        yield "seed", "plant.current_noise_A_rms is 0, and only this noise is random"
    yield from _events(scenario, plant)
    for key, why in (*_inverter(plant), *_sensors(plant), *_friction(plant), *_machine(scenario, plant)):
        if key.removeprefix("plant.") in plant.given:
            yield key, why


def check(scenario: "Scenario", name: str) -> None:
    """Refuse the first key that has no effect whatever the motor; `name` is the file."""
    for key, why in _found(scenario):
        raise FluxtrueError(f"{name}: {key}: has no effect here: {why}")


def for_motor(scenario: "Scenario", has_map: bool) -> str | None:
    """The first key that has no effect with this motor, and why."""
    plant = _Plant(scenario.plant, scenario.event)
    names = MAP_INSTEAD if has_map else ONLY_WITH_MAP
    why = "the motor has a flux map" if has_map else "the motor has no flux map"
    for name in names:
        if name in plant.given:
            return f"plant.{name}: has no effect here: {why}"
    for index, event in enumerate(scenario.event):
        for name in event.set:
            if name.removeprefix("plant.") in names and name.startswith("plant."):
                return f"event.{index}.set.{name}: has no effect here: {why}"
    return None
