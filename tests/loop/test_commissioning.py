# SPDX-License-Identifier: Apache-2.0
"""The voltage error of the inverter, measured at standstill and compared with the inverter of the plant."""

import math

import pytest

from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

DONE, FAILED, MOVED, STOPPED = 3.0, 4.0, 2.0, 1.0
VDC_V, PWM_HZ = 350.0, 1e4
NOISE = {"current_noise_A_rms": 0.8, "current_offset_A_a": 0.8, "current_offset_A_b": -0.6, "current_gain_c": 1.004,
         "vdc_gain": 1.004, "angle_offset_rad": 0.008}  # fmt: skip
# Dead time of 2 us +-20 %, voltage drop of 1 V +-0.5 V, rotor angle in rad.
PLANTS = [(2.4e-6, 1.5, 0.0), (2.4e-6, 0.5, 0.35), (1.6e-6, 1.5, 0.6), (1.6e-6, 0.5, 0.95), (2.2e-6, 1.0, 2.0)]


def standing(motor: Motor, plant: dict[str, float], angle: float = 0.0) -> Loop:
    """Enabled at standstill, at a rotor angle in rad."""
    loop = Loop(motor.library, motor.plant | {"imposed_speed": 1.0} | plant, motor.flux_map)
    loop.record(("truth.torque_mean_Nm", "fault_word"), 10)
    loop.set("enable", 1.0)
    loop.set("plant.speed_rad_s", angle)
    loop.run_s(1.0)
    loop.set("plant.speed_rad_s", 0.0)
    loop.run_s(0.1)
    return loop


def commission(loop: Loop) -> float:
    """Run the commissioning; the largest torque during it."""
    loop.set("commission", 1.0)
    rows = loop.run_s(2.3)
    assert rows[:, 1].max() == 0.0
    return float(abs(rows[:, 0]).max())


@pytest.mark.parametrize(("dead_time_s", "drop_V", "angle"), PLANTS)
def test_commissioning_reduces_the_voltage_error_to_a_fifth(
    hsm1: Motor, dead_time_s: float, drop_V: float, angle: float
) -> None:
    true_V = VDC_V * dead_time_s * PWM_HZ + drop_V
    with standing(hsm1, NOISE | {"dead_time_s": dead_time_s, "device_drop_V": drop_V}, angle) as loop:
        before_V = loop.get("compensation_V") - true_V
        torque_Nm = commission(loop)
        assert (loop.get("commission"), loop.get("commission_failure")) == (DONE, 0.0)
        after_V = loop.get("compensation_V") - true_V
        print(f"{before_V:+.3f} V before, {after_V:+.3f} V after, {torque_Nm:.2f} Nm")
        assert abs(after_V) <= 0.2 * abs(before_V)
        assert loop.get("commission_r_ohm") == pytest.approx(0.018, rel=0.06)
        # From some amperes on the true curve is constant. The tolerance includes errors of the current sensors.
        for k in range(3, 10):
            assert loop.get(f"inverter_{k}_V") == pytest.approx(true_V, abs=0.15), k
        # Errors of angle and currents leave some current in the q axis. The rated torque is 132 N·m.
        assert torque_Nm <= 2.0


def test_with_a_nominal_inverter_the_compensation_does_not_change(hsm1: Motor) -> None:
    with standing(hsm1, {}) as loop:
        before_V = loop.get("compensation_V")
        commission(loop)
        assert loop.get("commission") == DONE
        assert loop.get("compensation_V") == pytest.approx(before_V, abs=0.05)
        assert loop.get("compensation_knee_A") == pytest.approx(0.78, abs=0.01)


def test_a_second_commissioning_gives_the_same_result(hsm1: Motor) -> None:
    with standing(hsm1, NOISE | {"dead_time_s": 2.4e-6, "device_drop_V": 1.5}, 0.2) as loop:
        commission(loop)
        first_V = loop.get("compensation_V")
        commission(loop)
        assert loop.get("commission") == DONE
        assert loop.get("compensation_V") == pytest.approx(first_V, abs=0.03)


def test_a_turning_rotor_ends_commissioning_and_nothing_changes(hsm1: Motor) -> None:
    with standing(hsm1, {"dead_time_s": 2.4e-6}) as loop:
        before_V = loop.get("compensation_V")
        loop.set("commission", 1.0)
        loop.run_s(0.5)
        loop.set("plant.speed_rad_s", 10.0 * math.tau / 60.0 * 10.0)
        loop.run_s(0.5)
        assert (loop.get("commission"), loop.get("commission_failure")) == (FAILED, MOVED)
        loop.set("plant.speed_rad_s", 0.0)
        loop.run_s(0.5)
        assert loop.get("id_ref_A") == 0.0
        assert loop.get("compensation_V") == before_V


def test_commissioning_does_not_start_while_switching_is_disabled(hsm1: Motor) -> None:
    with Loop(hsm1.library, hsm1.plant | {"imposed_speed": 1.0}, hsm1.flux_map) as loop:
        loop.run_s(0.1)
        loop.set("commission", 1.0)
        loop.run_s(0.1)
        assert (loop.get("commission"), loop.get("commission_failure")) == (FAILED, STOPPED)


def test_it_survives_a_power_cycle(hsm1: Motor) -> None:
    plant = {"dead_time_s": 2.4e-6, "device_drop_V": 1.5}
    with standing(hsm1, plant) as loop:
        commission(loop)
        found = [loop.get(name) for name in ("dead_time_compensation", "compensation_knee_A")]
        loop.set("enable", 0.0)
        loop.run_s(0.2)
        memory = loop.memory()
    with Loop(hsm1.library, hsm1.plant, hsm1.flux_map) as loop:
        loop.remember(memory)
        assert loop.get("memory_recalled") == 1.0
        assert [loop.get(name) for name in ("dead_time_compensation", "compensation_knee_A")] == found


def test_after_commissioning_the_drive_runs_as_before(hsm1: Motor) -> None:
    with standing(hsm1, {"dead_time_s": 2.4e-6, "device_drop_V": 1.5}) as loop:
        commission(loop)
        loop.run(5000, {"plant.speed_rad_s": (0.0, 100.0), "torque_requested_Nm": (0.0, 40.0)})
        rows = loop.run_s(0.5)
        assert rows[:, 1].max() == 0.0
        assert rows[-100:, 0].mean() == pytest.approx(40.0, rel=0.01)
