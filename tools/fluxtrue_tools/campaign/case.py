# SPDX-License-Identifier: Apache-2.0
"""One case: one plant, one drive and the same windows for every controller. The result is a table of numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fluxtrue_tools.campaign import bound
from fluxtrue_tools.campaign.drive import Profile, make_profile
from fluxtrue_tools.campaign.envelope import make_envelope
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.sample import Sample, draws, sample
from fluxtrue_tools.campaign.spec import Campaign, Controller
from fluxtrue_tools.campaign.tour import CHANNELS, Tour, Trace, run_row, window_row
from fluxtrue_tools.campaign.windows import Window, plan
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.check import complaint
from fluxtrue_tools.sim.library import Loop, LoopError


@dataclass(frozen=True)
class Plan:
    """Everything that is decided before the first period is simulated."""

    sample: Sample
    profile: Profile
    windows: list[Window]


def make_plan(campaign: Campaign, machine: Machine, case: int) -> Plan:
    """The case's plant, drive and windows."""
    streams = draws(campaign.seed, case)
    drawn = sample(campaign, machine, streams)
    envelope = make_envelope(machine, drawn.factors)
    profile = make_profile(campaign.drive, envelope, streams.drive)
    return Plan(drawn, profile, plan(campaign.windows, envelope, streams.windows))


def _loop(machine: Machine, plan: Plan, controller: Controller) -> Loop:
    """The case's plant with one controller, switching enabled."""
    loop = Loop(machine.motor.library, plan.sample.plant, machine.motor.flux_map)
    for name, value in controller.set.items():
        loop.set(name, value)
    loop.set("enable", 1.0)
    return loop


def run_controller(campaign: Campaign, machine: Machine, plan: Plan, controller: Controller) -> Trace:
    """Warm-up and windows of one controller."""
    with _loop(machine, plan, controller) as loop:
        tour = Tour(loop, campaign.windows, campaign.check.count_nonzero)
        if controller.warm_up:
            tour.warm_up(plan.profile)
        tour.measure(plan.windows)
    return tour.trace


def _controller_rows(campaign: Campaign, machine: Machine, plan: Plan, controller: Controller,
                     trace: Trace) -> list[dict[str, Any]]:  # fmt: skip
    whole = run_row(trace, campaign.check.count_nonzero)
    share = campaign.check.oscillation_share
    rows = [
        window_row(window, trace.columns, rows, machine.rated_Nm, share)
        for window, rows in zip(plan.windows, trace.windows, strict=True)
    ]
    limits = bound.of_case(campaign, machine, plan.sample, trace) if controller.warm_up else [np.nan] * len(rows)
    return [
        {"controller": controller.name, "window": k} | row | {"bound_percent": float(limit)} | whole
        for k, (row, limit) in enumerate(zip(rows, limits, strict=True))
    ]


def run_case(campaign: Campaign, machine: Machine, case: int,
             keep: Callable[[str, Trace], None] | None = None) -> list[dict[str, Any]]:  # fmt: skip
    """All controllers that run in a case, a row per window; the same numbers wherever and whenever it runs."""
    plan = make_plan(campaign, machine, case)
    if not plan.windows:
        return []  # this plant cannot reach the smallest torque at any speed
    truth = {f"plant_{name}": value for name, value in plan.sample.factors.items()}
    rows = []
    for controller in campaign.controller:
        if not controller.runs_in(case):
            continue
        trace = run_controller(campaign, machine, plan, controller)
        if keep is not None:
            keep(controller.name, trace)
        rows += [{"case": case} | row | truth for row in _controller_rows(campaign, machine, plan, controller, trace)]
    return rows


def check_names(campaign: Campaign, machine: Machine, where: str) -> None:
    """Refuse what the plant or the firmware would refuse, before the first case."""
    plan = make_plan(campaign, machine, 0)
    for index, controller in enumerate(campaign.controller):
        try:
            with _loop(machine, plan, controller) as loop:
                recorded = [*CHANNELS, *campaign.check.count_nonzero]
                loop.record(recorded)
        except LoopError as error:
            key = error.name if error.name.startswith("plant.") else f"controller.{index}.set.{error.name}"
            key = f"check.count_nonzero: {error.name!r}" if error.name in campaign.check.count_nonzero else key
            raise FluxtrueError(f"{where}: {complaint(error, key, machine.motor)}") from error
