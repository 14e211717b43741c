# SPDX-License-Identifier: Apache-2.0
"""No monitor reports a perfect drive with a cold or hot winding, from standstill to top speed, with full torque."""

import math
import tomllib
from pathlib import Path

import pytest

from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import load

ROOT = Path(__file__).resolve().parents[2]
MOTORS = ROOT / "tests" / "motors"
SHARES = (0.0, 0.02, 0.1, 0.3, 0.6, 1.0)  # of top speed
SLOW = 0.1  # of top speed: up to here every machine has the voltage for all its torque
FULL = 0.97  # of the requested torque
MACHINES = ("hsm1", "prius", "leaf", "pmasynrm", "pmsyrm", "ebike", "spm_12V", "compressor", "servo", "truck",
            "saturated", "linear", "gem")  # fmt: skip
TRIP_C, DERATE_C = 180.0, 155.0  # where motor.toml gives none
NOISE = 0.002  # of the current converter's full scale, as in the campaigns


def windings(folder: Path) -> dict[float, bool]:
    """Coldest, normal, the hottest with full torque, and just below the fault; whether there is full torque."""
    thermal = tomllib.loads((folder / "motor.toml").read_text(encoding="utf-8")).get("thermal", {})
    hottest, last = thermal.get("winding_derate_C", DERATE_C) - 1.0, thermal.get("winding_trip_C", TRIP_C) - 2.0
    return {-40.0: True, 20.0: True, hottest: True, last: False}


@pytest.mark.parametrize("name", MACHINES)
def test_a_perfect_drive_with_any_winding_trips_at_no_speed(name: str) -> None:
    folder = ROOT / "firmware" / "motors" / name if name == "hsm1" else MOTORS / name
    motor = load(str(folder) if name != "hsm1" else name)
    top, most = motor.speed_max_rpm * 2.0 * math.pi / 60.0, 0.999 * motor.torque_max_Nm
    noise_A = NOISE * motor.plant["current_full_scale_A"]
    for winding_C, is_full in windings(folder).items():
        plant = {"imposed_speed": 1.0, "winding_C": winding_C, "current_noise_A_rms": noise_A}
        with Loop(motor.library, motor.plant | plant, motor.flux_map) as loop:
            loop.set("enable", 1.0)
            loop.record(("fault_word", "truth.torque_Nm"))
            speed = 0.0
            for share in SHARES:
                loop.set("torque_requested_Nm", 0.0)
                loop.run(round(0.5 / loop.period_s), {"plant.speed_rad_s": (speed, share * top)})
                speed = share * top
                for torque in (most, -most):
                    loop.set("torque_requested_Nm", torque)
                    rows = loop.run(round(0.15 / loop.period_s))
                    assert rows[:, 0].max() == 0.0, (winding_C, share, torque)
                    answer = rows[-100:, 1].mean() / torque
                    least = FULL if is_full and share <= SLOW else 0.05 if winding_C < 210.0 else 0.0
                    assert answer > least, (winding_C, share, torque)
