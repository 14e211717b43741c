# SPDX-License-Identifier: Apache-2.0
"""Checks of a campaign before its first case: windows that cannot be reached, and keys without effect."""

from collections.abc import Iterator

from fluxtrue_tools import strict
from fluxtrue_tools.campaign.envelope import NOTHING_WRONG, make_envelope
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.score import ROUNDING_RPM
from fluxtrue_tools.campaign.spec import Campaign
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import effects

Found = tuple[str, str]  # key, why

# Plant fields that every case draws, and the key that sets each range.
DRAWN = {
    "r_ohm_20": "spread.resistance_scale", "lq_scale": "spread.lq_scale", "ld_slope_scale": "spread.ld_slope_scale",
    "cross_saturation_scale": "spread.cross_saturation_scale", "iron_k_h": "spread.iron_loss_scale",
    "iron_k_e": "spread.iron_loss_scale", "device_drop_V": "spread.device_drop_error_V", "vdc_gain": "spread.vdc_gain",
    "current_gain": "spread.current_gain", "current_offset_A": "spread.current_offset_share",
    "current_noise_A_rms": "noise_share", "angle_offset_rad": "spread.angle_offset_deg",
    "angle_h1_rad": "spread.angle_harmonic_deg", "angle_h1_phase": "spread.angle_harmonic_deg",
    "angle_h2_rad": "spread.angle_harmonic_deg", "angle_h2_phase": "spread.angle_harmonic_deg",
    "theta_m_rad": "the case's number",
}  # fmt: skip
HIGH, LOW = ("rms_high", "p99_high"), ("rms_low", "p99_low")


def has_windows(campaign: Campaign, low_rpm: float, high_rpm: float) -> bool:
    """Whether any window can lie above one speed and up to another."""
    bands = campaign.windows.speed_rpm
    single = campaign.windows.low_speed_rpm
    return any(low < high_rpm and high > low_rpm for low, high, _ in bands) or any(
        low_rpm < speed <= high_rpm for speed in single
    )


def _check_part(campaign: Campaign) -> Iterator[Found]:
    check, limits = campaign.check, campaign.check.limits.given()
    if not check.controllers:
        for name in sorted(limits):
            yield f"check.limits.{name}", "check.controllers is empty: nothing is held to a bound"
        return
    crawl = check.crawl_rpm - ROUNDING_RPM
    top = max([high for _, high, _ in campaign.windows.speed_rpm] + list(campaign.windows.low_speed_rpm))
    if not has_windows(campaign, crawl, top):
        yield "check.controllers", f"no window lies from {check.crawl_rpm:g} rpm on: there is nothing to check"
    for names, low, high in ((LOW, crawl, check.band_rpm), (HIGH, check.band_rpm, max(top, check.band_rpm))):
        for name in names:
            if name in limits and not has_windows(campaign, low, high):
                yield f"check.limits.{name}", f"no window lies above {round(low)} up to {high:g} rpm"
    if "low_speed_slack" in limits and not has_windows(campaign, 0.0, crawl):
        yield "check.limits.low_speed_slack", f"no window lies below {check.crawl_rpm:g} rpm"


def _controllers(campaign: Campaign) -> Iterator[Found]:
    if not any(controller.warm_up for controller in campaign.controller):
        for name in sorted(campaign.drive.given()):
            yield f"drive.{name}", "no controller has warm_up = true"
    for index, controller in enumerate(campaign.controller):
        if controller.set.get("identification_mode", 1.0) == 1.0:
            for name in effects.PAPER_GAINS:
                if name in controller.set:
                    yield f"controller.{index}.set.{name}", "it belongs to identification_mode = 0, the paper's"


def _plant(campaign: Campaign) -> Iterator[Found]:
    given = campaign.plant.given()
    for name, by in DRAWN.items():
        if name in given:
            yield f"plant.{name}", f"every case draws it: {by}"
    for key, why in effects.of_plant(campaign.plant):
        if key.removeprefix("plant.") in given:
            yield key, why


def _motor(campaign: Campaign, machine: Machine) -> Iterator[Found]:
    has_map = machine.motor.flux_map is not None
    for name in effects.MAP_INSTEAD if has_map else ():
        if name in campaign.plant.given():
            yield f"plant.{name}", "the motor has a flux map"
    spread, nominal = campaign.spread.given(), campaign.nominal.given()
    if not has_map and "cross_saturation_scale" in spread:
        yield "spread.cross_saturation_scale", "the motor has no flux map"
    if machine.nominal.iron_k_h == machine.nominal.iron_k_e == 0.0 and "iron_loss_scale" in spread:
        yield "spread.iron_loss_scale", "neither the motor nor [nominal] has an iron loss"
    base = machine.motor.plant | campaign.plant.values()
    if base["dead_time_s"] == 0.0 and "dead_time_scale" in spread:
        yield "spread.dead_time_scale", "neither the motor nor [plant] has a dead time"
    for name in sorted(nominal):
        if getattr(machine.nominal, name) != getattr(campaign.nominal, name):
            yield f"nominal.{name}", f"the motor's own data say {getattr(machine.nominal, name):g}"


def _reach(campaign: Campaign, machine: Machine) -> Iterator[str]:
    """Windows that no plant could be driven to."""
    windows, name, top = campaign.windows, machine.motor.name, machine.speed_max_rpm
    speeds = [(f"windows.speed_rpm.{k}.{j}", band[j]) for k, band in enumerate(windows.speed_rpm) for j in (0, 1)]
    speeds += [(f"windows.low_speed_rpm.{k}", speed) for k, speed in enumerate(windows.low_speed_rpm)]
    for key, speed in speeds:
        if speed > top:
            yield f"{key} = {speed:g} rpm, allowed: up to {top:g} rpm (speed_max_rpm of motor {name})"
    envelope = make_envelope(machine, NOTHING_WRONG)
    starts = [(f"windows.speed_rpm.{k}", low) for k, (low, _, _) in enumerate(windows.speed_rpm)]
    starts += [(f"windows.low_speed_rpm.{k}", speed) for k, speed in enumerate(windows.low_speed_rpm)]
    for key, speed in starts:
        if envelope.at(speed) < windows.torque_min_Nm:
            torque_max = strict.down(envelope.at(speed))
            yield (f"windows.torque_min_Nm = {windows.torque_min_Nm:g} N·m, allowed: up to {torque_max:g} N·m "
                   f"(what motor {name} can give at {speed:g} rpm, where {key} begins)")  # fmt: skip


def check(campaign: Campaign, machine: Machine, where: str) -> None:
    """Refuse the first thing that is wrong; `where` is the file."""
    for said in _reach(campaign, machine):
        raise FluxtrueError(f"{where}: {said}")
    for key, why in (*_check_part(campaign), *_controllers(campaign), *_plant(campaign), *_motor(campaign, machine)):
        raise FluxtrueError(f"{where}: {key}: has no effect here: {why}")
