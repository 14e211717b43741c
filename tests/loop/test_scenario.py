# SPDX-License-Identifier: Apache-2.0
"""Scenario files: accepted and refused values, messages, the effect of profiles and events."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.build import locate
from fluxtrue_tools.sim.cli import table
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.output import summary
from fluxtrue_tools.sim.run import check_finite, simulate, value_at
from fluxtrue_tools.sim.scenario import Plant, Profile, Scenario, parse

HUGE = "1" + "0" * 399
HEAD = 'motor = "hsm1"\nduration_s = 0.05\n'
MOVING = "[profile]\ntorque_Nm = 50\nspeed_rpm = 1500\n"
ELSEWHERE = {  # plant fields that a scenario gives in another section, or that only the motor gives
    "pole_pairs", "pwm_hz", "winding_C", "magnet_scale", "vdc_V", "imposed_speed", "speed_rad_s",
    "inertia_kgm2", "load_Nm", "viscous_Nms", "seed",
    # The dc link, its contactor and the board's safe state, which an ECU controls: in a scenario the battery is always
    # connected.
    "dc_link_F", "precharge_s", "discharge_s", "dc_load_ohm", "avalanche_V", "vdc_start_V", "vdc_least_V",
    "precharge_open", "discharge_open", "contactor_open", "hardware_safe_V",
    # A state of the bridge that no drive chose: the reference of the fault campaign.
    "imposed_bridge",
}  # fmt: skip


def test_every_deviation_of_the_plant_can_be_given(hsm1: Motor) -> None:
    inside = {
        re.sub(r"_[abc]$", "", name.removeprefix("plant."))
        for name in lib.plant_names(hsm1.library)
        if name.startswith("plant.")
    }
    assert set(Plant.model_fields) == inside - ELSEWHERE


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "motor: missing, wanted"),
        ('motor = "hsm1"', "duration_s: missing, wanted"),
        ('motor = ""\nduration_s = 1', "motor = ''"),
        ("motor = 3\nduration_s = 1", "motor = 3"),
        ('motor = "hsm1"\nduration_s = 0', "duration_s = 0"),
        ('motor = "hsm1"\nduration_s = nan', "duration_s = nan"),
        ('motor = "hsm1"\nduration_s = inf', "duration_s = inf"),
        ('motor = "hsm1"\nduration_s = "1"', "duration_s = '1'"),
        ('motor = "hsm1"\nduration_s = true', "duration_s = True"),
        ('motor = "hsm1"\nduration_s = 1e9', "duration_s = 1000000000.0"),
        (
            'motor = "hsm1"\nduration_s = 1e300',
            "duration_s = 1e+300 s, allowed: a finite number above 0 up to 36000 s",
        ),
        (HEAD + "[plant]\ndead_time_s = inf", "plant.dead_time_s = inf s, allowed: a finite number from 0 to 1e+12 s"),
        (HEAD + "[plant]\nangle_spike_every = " + HUGE, ", allowed: a whole number from 0 to 1e+09"),
        (HEAD + "seed = -1", "seed = -1"),
        (HEAD + "seed = 1.5", "seed = 1.5"),
        (HEAD + "sped = 3", "sped: unknown key, allowed: motor, expect_fault, duration_s"),
        (HEAD + "[plant]\nnoise = 1", "plant.noise: unknown key, allowed: r_ohm_20"),
        (HEAD + "[plant]\nr_ohm_20 = -1", "plant.r_ohm_20 = -1"),
        (HEAD + "[plant]\nsubsteps = 5", "plant.substeps = 5"),
        (HEAD + "[plant]\nideal_inverter = 1", "plant.ideal_inverter = 1"),
        (HEAD + "[plant]\ncurrent_gain = [1, 1]", "plant.current_gain"),
        (HEAD + '[controller]\nkind = "double"', "controller.kind = 'double'"),
        (HEAD + '[controller]\nobserver_m = "3"', "controller.observer_m = '3'"),
        (HEAD + "[profile]\ntorque_Nm = [[0, 1], [1]]", "profile.torque_Nm.1 = [1], allowed: [t, value]"),
        (HEAD + "[profile]\ntorque_Nm = { t = 0 }", "profile.torque_Nm = {'t': 0}: allowed: a number, or a list of"),
        (HEAD + "[profile]\ntorque_Nm = inf", "profile.torque_Nm = inf N·m, allowed: a finite number"),
        (HEAD + "[profile]\ntorque_share = 1e300", "profile.torque_share = 1e+300, allowed: -1 to 1 (of the motor's"),
        (HEAD + "[profile]\ntorque_share = " + HUGE, "profile.torque_share = 1.8e+308 or beyond, allowed: -1 to 1"),
        (HEAD + "[profile]\ntorque_Nm = []", "allowed: a number, or a list of [t, value]"),
        (
            HEAD + "[profile]\ntorque_Nm = [[1, 0], [0, 1]]",
            "torque_Nm.1 = [0, 1], allowed: times must not go backwards, from 1 s",
        ),
        (
            HEAD + "[profile]\ntorque_Nm = [[-1, 0], [0, 1]]",
            "torque_Nm.0 = [-1, 0], allowed: a time that is not negative",
        ),
        (HEAD + "[profile]\ntorque_Nm = [[0, nan]]", "profile.torque_Nm.0 = [0, nan], allowed: [t, value], two finite"),
        (HEAD + "[profile]\ntorque_Nm = [[0, 1], [0, 2], [0, 3]]", "torque_Nm.2 = [0, 3], allowed: at most two points"),
        (HEAD + "[mechanics]\nmode = 'free'", "mechanics.mode = 'free'"),
        (HEAD + "[mechanics]\nmode = 'inertia'\n[profile]\nspeed_rpm = [[0, 0], [1, 1]]", "initial speed"),
        (
            HEAD + "[[event]]\nt = 1\nset = { enable = false }",
            "event.0.t = 1 s: after the end, allowed: from 0 up to and without duration_s = 0.05 s",
        ),
        (HEAD + "[[event]]\nt = 0", "event.0.set: missing, wanted"),
        (HEAD + "[[event]]\nt = 0\nset = {}", "event.0.set"),
        (HEAD + "[event]\nt = 0\nset = { enable = true }", "allowed: tables [[event]]"),
        (HEAD + "[plant]\nsubsteps = 100000", "plant.substeps = 100000"),
        (HEAD + "[controller]\n'plant.r_ohm_20' = 1", "plant.r_ohm_20 is not the controller's"),
        (HEAD + "[[event]]\nt = 0\nset = { enable = 'no' }", "event.0.set.enable = 'no'"),
        (HEAD + "[[event]]\nt = 0\nsets = { enable = 1 }", "event.0.sets: unknown key, allowed: t, set"),
        ('motor = "hsm1"\nduration = 1', "duration: unknown key, allowed: motor, expect_fault, duration_s"),
        (HEAD + "[[event]]\nt = 0\nset = { enable = 0.5 }", "event.0.set.enable = 0.5, allowed: true or false"),
        (HEAD + "[[event]]\nt = 0\nset = { 'plant.adc_bits' = 9.5 }", "plant.adc_bits = 9.5, allowed: a whole number"),
        (HEAD + "[[event]]\nt = 0\nset = { 'plant.phase_open_b' = 2 }", "plant.phase_open_b = 2, allowed: true or"),
        (
            HEAD + "[window]\nfrom_s = 0.04\nto_s = 0.03",
            "window: from_s = 0.04 s, to_s = 0.03 s, allowed: from_s below to_s",
        ),
        (
            HEAD + "[window]\nto_s = 1",
            "window: from_s = 0.7 s, to_s = 1 s, allowed: from_s below to_s, to_s up to duration_s = 0.05 s",
        ),
        (
            HEAD + "[profile]\nmagnet_scale = [[0, 1], [1, 0.9]]\n[[event]]\nt = 0\nset = { 'plant.magnet_scale' = 1 }",
            "the profile drives it",
        ),
        ("motor = ", "not valid TOML"),
        (HEAD + "seed = " + "9" * 5000, "..., allowed: a whole number from 0 up to below 9.0072e+15"),
        (HEAD + "seed = " + "9_" * 5000, "not valid TOML"),
    ],
)
def test_a_bad_scenario_is_refused_in_one_line_that_names_file_and_field(text: str, message: str) -> None:
    with pytest.raises(FluxtrueError) as refusal:
        parse(text, "bad.toml")
    line = str(refusal.value)
    assert line.startswith("bad.toml: ")
    assert message in line
    assert "\n" not in line and len(line) < 1200


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[controller]\nobserver_n = 3", "controller.observer_n = 3: no such name, allowed: observer_m"),
        ("[controller]\nidentification_mode = 'paper'\nobserver_m = 30", "controller.observer_m = 30, allowed: 2 to 4"),
        ("[controller]\npsi_f_Vs = 0.07", "controller.psi_f_Vs = 0.07 V·s: read only"),
        ("[profile]\ntorque_Nm = 1e6", "profile.torque_Nm = 1000000.0 N·m, allowed: -132 to 132 N·m"),
        (
            "[profile]\ntorque_Nm = [[0, 0], [0.04, 1e6]]",
            "profile.torque_Nm reaches 1e+06 N·m at t = 0.04 s, allowed: -132 to 132 N·m",
        ),
        ("[plant]\ndead_time_s = 1", "plant.dead_time_s = 1 s, allowed: from 0 and below 5e-05 s"),
        (
            "[[event]]\nt = 0.01\nset = { 'plant.vdc' = 3 }",
            "event.0.set.plant.vdc = 3: no such name, allowed: plant.vdc_V",
        ),
        (
            "[[event]]\nt = 0.01\nset = { 'plant.vdc_V' = -3 }",
            "event.0.set.plant.vdc_V = -3 V, allowed: above 0 and up to 1e+12 V",
        ),
        ("[plant]\ndead_time_s = 1e300", "plant.dead_time_s = 1e+300 s, allowed: from 0 and below 5e-05 s"),
        (
            "[plant]\ndead_time_s = " + HUGE,
            "plant.dead_time_s = 1.8e+308 s or beyond, allowed: from 0 and below 5e-05 s",
        ),
        ("[plant]\nr_ohm_20 = 1e300", "plant.r_ohm_20 = 1e+300 Ω, allowed: 0 to 1e+12 Ω"),
        ("[plant]\ncurrent_gain = [1, 1e300, 1]", "plant.current_gain_b = 1e+300, allowed: -1e+12 to 1e+12"),
        ("[plant]\nseries_d_V = -" + HUGE, "plant.series_d_V = -1.8e+308 V or beyond, allowed: -1e+12 to 1e+12 V"),
        ("[[event]]\nt = 0\nset = { observer_m = 1e300 }", "event.0.set.observer_m = 1e+300, allowed: 2 to 4"),
        ("[profile]\ntorque_Nm = 1e300", "profile.torque_Nm = 1e+300 N·m, allowed: -132 to 132 N·m"),
        ("[profile]\ntorque_Nm = " + HUGE, "profile.torque_Nm = 1.8e+308 N·m or beyond, allowed: -132 to 132 N·m"),
        ("[profile]\ntorque_Nm = [[0, " + HUGE + "]]", "profile.torque_Nm = 1.8e+308 N·m or beyond, allowed: -132 to"),
        ("[profile]\nspeed_share = 1e300", "profile.speed_share = 1e+304 rpm, allowed: up to 100000 rpm"),
    ],
)
def test_what_only_the_library_can_check_is_refused_in_one_line_too(hsm1: Motor, text: str, message: str) -> None:
    with pytest.raises(FluxtrueError) as refusal:
        simulate(parse(HEAD + text, "bad.toml"), hsm1, where="bad.toml")
    line = str(refusal.value)
    assert line.startswith("bad.toml: ")
    assert message in line


def test_a_profile_is_linear_between_points_and_jumps_between_equal_times() -> None:
    points = ((0.5, 1.0), (1.0, 3.0), (1.0, 7.0), (2.0, 5.0))
    expected = {
        (0.0, True): 1.0, (0.5, False): 1.0, (0.75, True): 2.0, (1.0, False): 3.0,
        (1.0, True): 7.0, (1.5, False): 6.0, (2.0, False): 5.0, (2.0, True): 5.0, (9.0, True): 5.0,
    }  # fmt: skip
    for (now, after), value in expected.items():
        assert value_at(points, now, after) == pytest.approx(value), (now, after)


def test_profiles_reach_plant_and_controller(hsm1: Motor) -> None:
    scenario = Scenario.model_validate(
        {
            "motor": "hsm1",
            "duration_s": 0.4,
            "profile": {
                "torque_Nm": [[0, 0], [0.1, 20], [0.1, 40]],
                "speed_rpm": [[0, 0], [0.2, 1000]],
                "vdc_V": [[0, 350], [0.4, 300]],
                "winding_C": [[0, 20], [0.4, 120]],
                "magnet_scale": [[0, 1.0], [0.2, 1.0], [0.2, 0.9]],
            },
        }
    )
    run = simulate(scenario, hsm1)
    assert len(run.rows) == 400
    now = run["time_s"]
    assert np.allclose(now, 1e-3 * np.arange(1, 401), atol=1e-9)
    # A row is the mean of ten periods: the tolerance is the change of half a row.
    assert np.allclose(run["true_speed_rpm"], np.minimum(now / 0.2, 1.0) * 1000.0, atol=5.0)
    assert np.allclose(run["true_vdc_V"], 350.0 - 125.0 * now, atol=0.2)
    assert run["true_r_ohm"][-1] == pytest.approx(0.018 * (1 + 0.00393 * 100.0), rel=2e-3)
    flux = run["true_psi_f_Vs"]
    assert flux[-1] / flux[0] == pytest.approx(0.9, rel=1e-6)
    assert np.count_nonzero(np.diff(flux)) == 1
    command = run["torque_requested_Nm"]
    assert command[98] == pytest.approx(20.0 * 0.098 / 0.1, abs=0.25)
    assert set(command[101:]) == {40.0}


def test_events_change_plant_and_controller_at_their_time(hsm1: Motor) -> None:
    scenario = parse(
        'motor = "hsm1"\nduration_s = 0.3\n[profile]\ntorque_Nm = 30\nspeed_rpm = 500\n'
        "[[event]]\nt = 0.2\nset = { enable = false }\n"
        "[[event]]\nt = 0.1\nset = { 'plant.magnet_scale' = 0.9, torque_loop = false }",
        "events.toml",
    )
    run = simulate(scenario, hsm1)
    now, flux = run["time_s"], run["true_psi_f_Vs"]
    assert flux[now < 0.0995].max() == flux[now < 0.0995].min()
    assert flux[now > 0.1015] / flux[0] == pytest.approx(0.9)
    assert run["run_state"][now < 0.1995][-1] == 1.0
    assert run["run_state"][now > 0.2025][0] == 0.0


def test_an_inertia_accelerates_with_the_torque_of_the_machine(hsm1: Motor) -> None:
    run = simulate(
        parse(
            'motor = "hsm1"\nduration_s = 1\n[profile]\ntorque_Nm = 30\nload_Nm = 10\n'
            '[mechanics]\nmode = "inertia"\ninertia_kgm2 = 0.2',
            "inertia.toml",
        ),
        hsm1,
    )
    # The integral of (T - load)/J over the run, with the torque of the plant.
    gained = float(np.sum(run["true_torque_Nm"] - 10.0)) * 1e-3 / 0.2 * 60.0 / math.tau
    assert run["true_speed_rpm"][-1] == pytest.approx(gained, rel=5e-3)
    assert gained > 800.0


def test_the_defaults_are_a_nominal_drive() -> None:
    scenario = parse(HEAD, "plain.toml")
    assert scenario.plant.values() == {}
    assert scenario.profile == Profile()
    assert scenario.averaged() == (0.0, 0.05)
    flags = {"torque_loop": 1.0, "identification": 1.0, "identification_mode": 1.0, "enable": 1.0}
    assert scenario.controller.values() == flags


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('motor = "hsm1"\nduration_s = 1e-9', "record_every_s = 0.001 s: no row in the window"),
        ('motor = "hsm1"\nduration_s = 3e-4', "no row in the window 0 to 0.0003 s"),
        (HEAD + "record_every_s = 1e-9", "record_every_s = 1e-09 s, allowed: from 0.0001 s (a PWM period)"),
        (HEAD + "record_every_s = 9.9e-5", "record_every_s = 9.9e-05 s, allowed: from 0.0001 s (a PWM period)"),
        (HEAD + "record_every_s = 0.06", "record_every_s = 0.06 s: no row"),
        (HEAD + "record_every_s = 1e9", "record_every_s = 1e+09 s: no row"),
        (HEAD + "[window]\nfrom_s = 0.04\nto_s = 0.0402", "no row in the window 0.04 to 0.0402 s"),
        (HEAD + "[window]\nfrom_s = 0.0498\nto_s = 0.05", "no row in the window"),
        # Three pole pairs at 10 kHz: half an electrical turn per period is 100 000 rpm.
        (HEAD + "[profile]\nspeed_rpm = 1e9", "profile.speed_rpm = 1e+09 rpm, allowed: up to 100000 rpm"),
        (HEAD + "[profile]\nspeed_rpm = [[0, 0], [0.1, -1e6]]", "profile.speed_rpm = -1e+06 rpm, allowed"),
        (HEAD + MOVING + "winding_C = 1e9", "the plant or its load is impossible"),
        (HEAD + MOVING + "[plant]\nr_ohm_20 = 1e9", "the plant or its load is impossible"),
    ],
)
def test_what_cannot_be_simulated_or_averaged_is_refused_in_one_line(hsm1: Motor, text: str, message: str) -> None:
    with pytest.raises(FluxtrueError) as refusal:
        simulate(parse(text, "bad.toml"), hsm1, where="bad.toml")
    line = str(refusal.value)
    assert line.startswith("bad.toml: ") and message in line, line


def test_a_row_without_a_number_is_refused_with_its_column() -> None:
    """In the words of the runner, which refuses a flux linkage without a current."""
    rows = np.array([[0.0, 1.0], [1e-4, np.inf]])
    with pytest.raises(FluxtrueError, match=r"left the range of numbers \(i_d_A = inf\): .* an event is impossible$"):
        check_finite(["time_s", "i_d_A"], rows)


@pytest.mark.parametrize(
    "text",
    [
        'motor = "hsm1"\nduration_s = 1e-3',
        'motor = "hsm1"\nduration_s = 1e-4\nrecord_every_s = 1e-4',
        HEAD + "record_every_s = 0.05",
        HEAD + "[window]\nfrom_s = 0.049\nto_s = 0.05",
    ],
)
def test_a_window_of_one_row_has_a_mean(hsm1: Motor, text: str) -> None:
    run = simulate(parse(text, "short.toml"), hsm1)
    assert math.isfinite(run.mean("true_torque_Nm"))


@pytest.mark.parametrize("motor", ["a\x00b", "~no-such-user/x"])
def test_a_motor_that_is_not_a_path_is_refused(motor: str, tmp_path: Path) -> None:
    with pytest.raises(FluxtrueError, match="^motor "):
        locate(motor, tmp_path)


def test_a_mean_over_a_reversal_is_told(paper: Motor) -> None:
    profile = "[profile]\nspeed_rpm = 500\ntorque_Nm = [[0, 20], [0.15, 20], [0.16, -20]]\n"
    head = f'motor = "paper"\nduration_s = 0.2\n{profile}'
    for window, told in (("", True), ("[window]\nfrom_s = 0.05\nto_s = 0.14\n", False)):
        data = summary(simulate(parse(head + window, "s.toml"), paper))
        assert data["window"]["request_reverses"] is told
        assert ("in which the requested torque reverses" in table(data)) is told
