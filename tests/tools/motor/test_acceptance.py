# SPDX-License-Identifier: Apache-2.0
"""Every sensible motor is accepted as it is, and its numbers keep their range.

FLUXTRUE_MOTORS=1000 draws a thousand motors in place of 125."""

import math
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import toml
from random_motors import DROP, PUBLISHED, REACTANCES, made, random_motors

from fluxtrue_tools.bus.scales import carriers, standard
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bus import needs
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.motor.flux_tables import OBSERVER_M_MAX
from fluxtrue_tools.motor.motor import Motor, load_motor

SEED, PART, ACCEPTED = 12, 125, 0.99
PARTS = max(int(os.environ.get("FLUXTRUE_MOTORS", PART)) // PART, 1)
COUNTS = carriers(standard())
TESTED = Path(__file__).resolve().parents[2] / "motors"
Write = Callable[..., Path]


def assert_in_range(motor: Motor) -> None:
    """What the firmware's checks and formats ask of the numbers."""
    b, config, tables = motor.bases, motor.config, motor.tables
    turn = b.omega_rad_s * b.period_s
    assert b.omega_rad_s >= 1.02 * config.omega_max_rad_s * (1 - 1e-12)
    assert turn < math.pi / 2
    assert turn * b.periods_per_step < 8 * 2 * math.pi
    # What the observer multiplies is the machine's, whatever g_shift splits it into.
    pole = 4.0 * config.machine.r_ohm / b.resistance_ohm * 2.0**tables.g_shift
    assert 0 < OBSERVER_M_MAX * pole < 1
    g = tables.stored["g"] / 2.0**15 * 2.0**tables.g_shift
    wanted = b.period_s / 2 * (1 / tables.l_dd_H + 1 / tables.l_qq_H) * b.resistance_ohm
    assert np.all((np.abs(g / wanted - 1.0) < 0.01) | ((tables.stored["g"] == 2**15 - 1) & (g < wanted)))
    assert tables.stored["g"].min() > 100
    # What its bus asks of the DBC: resolution of the rated value, reserve above the largest one.
    for name, need in needs(config, motor.derived).items():
        factor, counts = float(motor.bus.factors[name]), COUNTS[name].counts
        assert factor <= 1e-3 * need.rated * (1 + 1e-9), name
        assert factor * counts >= 1.2 * need.largest * (1 - 1e-9), name


@pytest.mark.parametrize("part", range(PARTS))
def test_of_random_sensible_motors_99_percent_are_accepted(part: int) -> None:
    """Each part must keep the share."""
    reasons: Counter[str] = Counter()
    angles = []
    for drawn in random_motors(PARTS * PART, SEED)[part::PARTS]:
        try:
            assert_in_range(made(drawn.values))
            angles.append(drawn.angle_rad)
        except FluxtrueError as error:
            reasons[str(error)] += 1
    assert sum(reasons.values()) <= (1 - ACCEPTED) * PART, reasons.most_common(10)
    assert sum(angle > 0.6 for angle in angles) > 0.3 * PART  # the fast ones are among them
    assert max(angles) > 1.15


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_machines_lie_in_the_ranges_that_are_drawn_from(name: str) -> None:
    config = load_config(TESTED / name)
    machine = config.machine
    assert machine.ld_H is not None and machine.lq_H is not None and machine.psi_f_Vs is not None
    x, ratio = machine.ld_H * machine.i_max_A / machine.psi_f_Vs, machine.lq_H / machine.ld_H
    assert any(low <= x <= high and a <= ratio <= b for (low, high), (a, b) in REACTANCES.values()), (x, ratio)
    drop = machine.r_ohm * machine.i_max_A / (config.inverter.vdc_V / math.sqrt(3.0))
    assert DROP[0] <= drop <= DROP[1]


def test_some_of_them_as_files_are_what_the_tool_accepts(tmp_path: Path) -> None:
    for k, drawn in enumerate(random_motors(10, SEED + 1)):
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / "motor.toml").write_text(toml(drawn.values), encoding="utf-8")
        assert load_motor(folder).config.machine.pole_pairs == drawn.values["machine"]["pole_pairs"]


def test_what_turns_too_far_is_refused_with_the_speed_that_is_accepted(write: Write) -> None:
    said = r"speed_max_rpm = 30000 turns 1\.26 .* allowed: up to 1\.2 \(here 28640 rpm"
    with pytest.raises(FluxtrueError, match=said):
        load_motor(write(machine={"speed_max_rpm": 30000.0}))
    load_motor(write(machine={"speed_max_rpm": 28640.0, "torque_max_Nm": 100.0}))


def test_at_5_kHz_the_measured_machine_needs_a_shift() -> None:
    motor = load_motor(TESTED / "hsm1_5kHz")
    assert motor.tables.g_shift == 1
    assert motor.bases.omega_rad_s == pytest.approx(1.25 * motor.config.omega_max_rad_s, rel=1e-12)
    assert load_motor(TESTED / "hsm1_20kHz").tables.g_shift == 0


def test_a_resistance_too_large_for_its_format_shifts_the_other_way(write: Write) -> None:
    """12 V, 60 A, 60 mΩ: 30 % of V_dc; R_0 is 0.27 of Z_b, 16 R_0 4.3."""
    machine = {"r_ohm": 0.06, "i_max_A": 60.0, "torque_max_Nm": 1.0, "speed_max_rpm": 2000.0, "ld_H": 60e-6,
               "lq_H": 60e-6, "psi_f_Vs": 6e-3}  # fmt: skip
    motor = load_motor(write(machine=machine, inverter={"vdc_V": 12.0, "pwm_hz": 20000.0, "dead_time_s": 5e-7,
                                                        "current_full_scale_A": 81.0}))  # fmt: skip
    assert motor.tables.g_shift < 0
    assert_in_range(motor)
