# SPDX-License-Identifier: Apache-2.0
"""One random plant. What a case draws depends on the campaign's seed and the case's number, on nothing else."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.spec import Campaign, Spread

Range = tuple[float, float]


@dataclass(frozen=True)
class Draws:
    """Independent random streams of one case: adding a draw to one leaves the others as they are."""

    plant: np.random.Generator
    drive: np.random.Generator
    windows: np.random.Generator
    noise_seed: int


def draws(seed: int, case: int) -> Draws:
    """The streams of a case, independent of process and order."""
    streams = np.random.SeedSequence(seed, spawn_key=(case,)).spawn(4)
    generators = [np.random.default_rng(stream) for stream in streams[:3]]
    # The plant takes its seed through a double.
    return Draws(*generators, noise_seed=int(streams[3].generate_state(1, np.uint64)[0]) >> 11)


@dataclass(frozen=True)
class Sample:
    """The truth of one case, as factors and errors (for the table) and as the plant's parameters."""

    factors: dict[str, float]
    plant: dict[str, float]


def _factors(spread: Spread, rng: np.random.Generator) -> dict[str, float]:
    """Uniform draws, always in this order."""

    def uniform(limits: Range) -> float:
        return float(rng.uniform(*limits))

    once = ("lq_scale", "ld_slope_scale", "cross_saturation_scale", "magnet_scale", "resistance_scale",
            "winding_error_C", "dead_time_scale", "device_drop_error_V", "vdc_gain", "angle_offset_deg",
            "iron_loss_scale")  # fmt: skip
    factors = {name: uniform(getattr(spread, name)) for name in once}
    for phase in "abc":
        factors[f"current_gain_{phase}"] = uniform(spread.current_gain)
        factors[f"current_offset_share_{phase}"] = uniform(spread.current_offset_share)
    for order in (1, 2):
        factors[f"angle_h{order}_deg"] = uniform(spread.angle_harmonic_deg)
        factors[f"angle_h{order}_phase"] = uniform((0.0, 2.0 * math.pi))
    factors["theta_m_rad"] = uniform((0.0, 2.0 * math.pi))
    return factors


def _winding(factors: dict[str, float], machine: Machine) -> dict[str, float]:
    """The true resistance follows from the true temperature, of which the plant's sensor reports a wrong value.

    The plant derives R from the temperature it reports, so R at 20 C takes the difference up.
    """
    per_K = machine.r_temp_coeff_per_K
    true_C = 20.0 + ((factors["resistance_scale"] - 1.0) / per_K if per_K > 0.0 else 0.0)
    told_C = true_C + factors["winding_error_C"]
    r_ohm = machine.motor.r_ohm * factors["resistance_scale"]
    return {"winding_C": told_C, "r_ohm_20": r_ohm / (1.0 + per_K * (told_C - 20.0))}


def sample(campaign: Campaign, machine: Machine, case: Draws) -> Sample:
    """Draw a plant."""
    f = _factors(campaign.spread, case.plant)
    base = machine.motor.plant | campaign.plant.values()
    full_scale_A = base["current_full_scale_A"]
    drawn = _winding(f, machine) | {
        "lq_scale": f["lq_scale"],
        "ld_slope_scale": f["ld_slope_scale"],
        "cross_saturation_scale": f["cross_saturation_scale"],
        "magnet_scale": f["magnet_scale"],
        "dead_time_s": base["dead_time_s"] * f["dead_time_scale"],
        "device_drop_V": machine.nominal.device_drop_V + f["device_drop_error_V"],
        "vdc_gain": f["vdc_gain"],
        "angle_offset_rad": math.radians(f["angle_offset_deg"]),
        "iron_k_h": machine.nominal.iron_k_h * f["iron_loss_scale"],
        "iron_k_e": machine.nominal.iron_k_e * f["iron_loss_scale"],
        "current_noise_A_rms": campaign.noise_share * full_scale_A,
        "theta_m_rad": f["theta_m_rad"],
        "imposed_speed": 1.0,
        "speed_rad_s": 0.0,
        "inertia_kgm2": machine.motor.inertia_kgm2,
        "seed": float(case.noise_seed),
    }
    for phase in "abc":
        drawn[f"current_gain_{phase}"] = f[f"current_gain_{phase}"]
        drawn[f"current_offset_A_{phase}"] = full_scale_A * f[f"current_offset_share_{phase}"]
    for order in (1, 2):
        drawn[f"angle_h{order}_rad"] = math.radians(f[f"angle_h{order}_deg"])
        drawn[f"angle_h{order}_phase"] = f[f"angle_h{order}_phase"]
    return Sample(f, base | drawn)
