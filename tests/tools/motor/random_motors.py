# SPDX-License-Identifier: Apache-2.0
"""Random sensible motors: what people build.

Drawn are dc voltage, current, pole pairs, PWM frequency, electrical advance per PWM period, the share of maximum speed
at which the voltage is used up, and the machine's kind; flux and inductances follow from these, because a machine is
wound for its inverter. The ranges of the reactances per unit span the plane of magnet flux and saliency in which W. L.
Soong, T. J. E. Miller, "Field-weakening performance of brushless synchronous AC motor drives", IEE Proc. Electr. Power
Appl. 141 (1994), order surface-magnet, interior-magnet and reluctance machines; they and the range of the resistance
contain the machines of tests/motors whose constants are published (PUBLISHED).
"""

import math
import random
from dataclasses import dataclass
from typing import Any

import numpy as np

from fluxtrue_tools.motor.config import MotorConfig, check_config
from fluxtrue_tools.motor.emit_c import check_numbers
from fluxtrue_tools.motor.flux_model import ConstantModel
from fluxtrue_tools.motor.motor import Motor, resolve

KHZ = (4, 5, 6, 8, 10, 12, 15, 16, 20, 24, 30, 32, 40)
SENSORS_A = (1.5, 2, 3, 5, 7.5, 10, 15, 20, 25, 30, 40, 50, 60, 80, 100, 125, 150, 200, 250, 300, 400, 500, 600, 700,
             800, 900, 1000, 1200, 1500)  # fmt: skip
FULL_SCALE_MIN = 1.35  # of i_max: what motor.toml asks of the current converter
RIPPLE_MAX = 0.5  # of i_max, peak to peak: with more a designer raises the PWM frequency or adds a choke
SPEED_MAX_RPM, SPEED_MIN_RPM = 60000.0, 100.0
ANGLE_MAX = 1.2  # rad of the field per PWM period
REACTANCES = {  # L_d i_max over psi_f, L_q over L_d
    "surface": ((0.08, 1.5), (1.0, 1.1)),
    "interior": ((0.2, 2.0), (1.1, 4.0)),
    "reluctance": ((0.5, 2.0), (2.5, 6.0)),
}
DROP = (0.005, 0.35)  # R i_max over the largest phase voltage
PUBLISHED = ("prius", "ipmsm_2kW", "estun", "anaheim", "teknic", "hub", "racing", "gem")


@dataclass(frozen=True)
class RandomMotor:
    """One motor.toml as dictionaries, and the advance per period for which it was drawn."""

    values: dict[str, dict[str, Any]]
    angle_rad: float


def _log(rng: random.Random, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _torque_top(p: int, psi_f: float, l_d: float, l_q: float, i_max: float) -> float:
    """MTPA at i_max, by trying."""
    angles = (math.pi / 2 * (1.0 + k / 400) for k in range(401))
    return max(1.5 * p * (psi_f + (l_d - l_q) * i_max * math.cos(g)) * i_max * math.sin(g) for g in angles)


def _draw(rng: random.Random) -> RandomMotor | None:
    """None: not a sensible machine."""
    vdc, i_max, p = _log(rng, 12.0, 900.0), _log(rng, 1.0, 1000.0), rng.randint(1, 24)
    pwm_hz, angle = 1000.0 * rng.choice(KHZ), rng.uniform(0.03, ANGLE_MAX)
    omega = angle * pwm_hz
    rpm = omega / p * 60 / (2 * math.pi)
    omega_base = omega / rng.uniform(1.0, 4.0)
    (x_low, x_high), saliency = REACTANCES[kind := rng.choice(list(REACTANCES))]
    x, ratio = _log(rng, x_low, x_high), rng.uniform(*saliency)
    # All the voltage at the base speed with i_max on the q axis.
    psi = 0.9 * vdc / math.sqrt(3.0) / omega_base
    psi_f = psi / math.hypot(1.0, x * ratio)
    l_d = x * psi_f / i_max
    l_q = ratio * l_d
    r = _log(rng, *DROP) * vdc / math.sqrt(3.0) / i_max
    ripple = 0.25 * vdc / math.sqrt(3.0) / (pwm_hz * l_d) / i_max
    if not (SPEED_MIN_RPM <= rpm <= SPEED_MAX_RPM and ripple <= RIPPLE_MAX and 3e-6 <= l_d <= 0.2 and r >= 2e-4):
        return None
    torque = rng.uniform(0.6, 0.97) * _torque_top(p, psi_f, l_d, l_q, i_max)
    run_up_s = _log(rng, 0.03, 5.0)
    full_scale = next((a for a in SENSORS_A if a >= FULL_SCALE_MIN * i_max), FULL_SCALE_MIN * i_max)
    return RandomMotor(
        {
            "machine": {
                "name": f'"{kind}"',
                "pole_pairs": p,
                "r_ohm": float(f"{r:.3g}"),
                "r_temp_coeff_per_K": 0.00393,
                "i_max_A": float(f"{i_max:.4g}"),
                "torque_max_Nm": float(f"{torque:.3g}"),
                "speed_max_rpm": float(f"{0.999 * rpm:.4g}"),
                "inertia_kgm2": float(f"{torque * run_up_s * p / omega:.3g}"),
                "ld_H": float(f"{l_d:.4g}"),
                "lq_H": float(f"{l_q:.4g}"),
                "psi_f_Vs": float(f"{psi_f:.4g}"),
            },
            "inverter": {
                "vdc_V": float(f"{vdc:.3g}"),
                "pwm_hz": pwm_hz,
                "dead_time_s": float(f"{min(rng.uniform(0.3e-6, 3e-6), 0.03 / pwm_hz):.2g}"),
                "current_full_scale_A": full_scale,
                "adc_bits": 12,
                "device_drop_V": float(f"{min(1.5, 0.02 * vdc) * rng.random():.2g}"),
            },
        },
        angle,
    )


def random_motors(count: int, seed: int) -> list[RandomMotor]:
    """The same list for the same seed."""
    rng = random.Random(seed)
    found: list[RandomMotor] = []
    while len(found) < count:
        motor = _draw(rng)
        if motor is not None:
            found.append(motor)
    return found


def made(values: dict[str, dict[str, Any]]) -> Motor:
    """All that motor build refuses for, without the advice that follows a refusal."""
    machine = values["machine"] | {"name": str(values["machine"]["name"]).strip('"')}
    config = MotorConfig.model_validate(values | {"machine": machine})
    check_config(config)
    constants = config.machine.ld_H, config.machine.lq_H, config.machine.psi_f_Vs
    assert None not in constants
    with np.errstate(all="ignore"):
        motor = resolve(config, None, ConstantModel(*constants))  # type: ignore[arg-type]
    check_numbers(motor)
    return motor
