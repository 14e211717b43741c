# SPDX-License-Identifier: Apache-2.0
"""Keys of a scenario without effect are refused, and only those: a refused key changes no bit, an accepted one does."""

import numpy as np
import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import check, effects
from fluxtrue_tools.sim.library import Loop, LoopError
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.run import simulate
from fluxtrue_tools.sim.scenario import Scenario, parse

HEAD = 'motor = "hsm1"\nduration_s = 0.06\n'
PROFILE = "[profile]\ntorque_Nm = 60\nspeed_rpm = 2500\n"

# The text that is added, the key that the refusal names, a text in which the same key has an effect.
CASES = [
    ("[plant]\nideal_inverter = true\ndead_time_s = 3e-6", "plant.dead_time_s",
     "[plant]\nideal_inverter = false\ndead_time_s = 3e-6"),
    ("[plant]\nideal_inverter = true\ndevice_drop_V = 2", "plant.device_drop_V", "[plant]\ndevice_drop_V = 2"),
    ("[plant]\nideal_inverter = true\nleg_knee_A = 2", "plant.leg_knee_A", "[plant]\nleg_knee_A = 2"),
    ("[plant]\nstribeck_rad_s = 3", "plant.stribeck_rad_s",
     "[plant]\nstribeck_rad_s = 300\nstiction_Nm = 2\n[mechanics]\nmode = 'inertia'"),
    ("[plant]\nvdc_ripple_hz = 300", "plant.vdc_ripple_hz", "[plant]\nvdc_ripple_hz = 300\nvdc_ripple_V = 5"),
    ("[plant]\nvdc_ripple_V = 5", "plant.vdc_ripple_V", "[plant]\nvdc_ripple_hz = 100\nvdc_ripple_V = 5"),
    ("[plant]\nangle_h1_phase = 1", "plant.angle_h1_phase", "[plant]\nangle_h1_phase = 1\nangle_h1_rad = 0.01"),
    ("[plant]\nangle_h2_phase = 1", "plant.angle_h2_phase", "[plant]\nangle_h2_phase = 1\nangle_h2_rad = 0.01"),
    ("[plant]\nresolver_pole_pairs = 3", "plant.resolver_pole_pairs",
     "[plant]\nresolver_pole_pairs = 3\nangle_h2_rad = 0.01"),
    ("[plant]\nangle_length_check = true", "plant.angle_length_check",
     "[plant]\nangle_length_check = true\nresolver_pole_pairs = 3\nangle_sine_stuck = true"),
    ("[plant]\nrotor_C = 90", "plant.rotor_C", "[plant]\nrotor_C = 90\nmagnet_temp_coeff_per_K = -1e-3"),
    ("[plant]\nmagnet_temp_coeff_per_K = -1e-3", "plant.magnet_temp_coeff_per_K",
     "[plant]\nmagnet_temp_coeff_per_K = -1e-3\n[[event]]\nt = 0.03\nset = { 'plant.rotor_C' = 90 }"),
    ("[plant]\nr_temp_coeff_per_K = 0.005", "plant.r_temp_coeff_per_K",
     "winding_C = 90\n[plant]\nr_temp_coeff_per_K = 0.005"),
    ("[plant]\nmagnet_step_keeps_current = true", "plant.magnet_step_keeps_current",
     "magnet_scale = [[0, 1], [0.03, 1], [0.03, 0.9]]\n[plant]\nmagnet_step_keeps_current = true"),
    ("[mechanics]\ninertia_kgm2 = 0.1", "mechanics.inertia_kgm2", "[mechanics]\nmode = 'inertia'\ninertia_kgm2 = 0.1"),
    ("load_Nm = 5", "profile.load_Nm", "load_Nm = 5\n[mechanics]\nmode = 'inertia'"),
    ("vdc_V = [[0, 350], [0.06, 350], [0.07, 300]]", "profile.vdc_V", "vdc_V = [[0, 350], [0.05, 350], [0.07, 300]]"),
    ("[controller]\nflux_bandwidth_rad_s = 90", "controller.flux_bandwidth_rad_s",
     "[controller]\nflux_bandwidth_rad_s = 90\nidentification_mode = 'paper'"),
    ("[controller]\nresistance_bandwidth_rad_s = 90", "controller.resistance_bandwidth_rad_s", None),
    ("[controller]\nobserver_m = 2.5", "controller.observer_m",
     "[controller]\nobserver_m = 2.5\nidentification_mode = 'paper'"),
    ("[controller]\ntrim = 0\nidentification_mode = 'paper'", "controller.trim", None),
    ("[controller]\ntorque_requested_Nm = 20", "controller.torque_requested_Nm", None),
    ("[controller]\nid_ref_A = -20", "controller.id_ref_A", "[controller]\nid_ref_A = -20\ncurrent_mode = 1"),
    ("[controller]\niq_ref_A = 20", "controller.iq_ref_A", "[controller]\niq_ref_A = 20\ncurrent_mode = 1"),
    ("[controller]\npulses_id_low_A = -9", "controller.pulses_id_low_A", None),
    ("[plant]\nangle_spike_every = 12\nangle_spike_samples = 1", "plant.angle_spike_every",
     "[plant]\nangle_spike_every = 12\nangle_spike_samples = 1\nangle_spike_rad = 0.1"),
    ("[plant]\nangle_spike_samples = 1\nangle_spike_rad = 0.1", "plant.angle_spike_samples",
     "[plant]\nangle_spike_every = 12\nangle_spike_samples = 1\nangle_spike_rad = 0.1"),
    ("[plant]\nangle_spike_rad = 0.1\nangle_spike_every = 12", "plant.angle_spike_every",
     "[plant]\nangle_spike_every = 12\nangle_spike_samples = 1\nangle_spike_rad = 0.1"),
    ("[plant]\ncurrent_quantise = false", "plant.current_quantise",
     "[plant]\ncurrent_quantise = false\n[controller]\nkind = 'twin'"),
    ("[plant]\nvdc_quantise = true", "plant.vdc_quantise",
     "[plant]\nvdc_quantise = true\n[controller]\nkind = 'twin'"),
    ("[plant]\nshort_circuit_A = 900", "plant.short_circuit_A", None),
    ("[plant]\ndesaturation_s = 1e-6", "plant.desaturation_s",
     "[plant]\ndesaturation_s = 1e-3\nswitch_shorted_upper = [true, false, false]"),
    ("[plant]\ndesaturation_open = true", "plant.desaturation_open",
     "[plant]\ndesaturation_open = true\nswitch_shorted_upper = [true, false, false]"),
    ("[[event]]\nt = 0.03\nset = { 'plant.theta_m_rad' = 1 }", "event.0.set.plant.theta_m_rad",
     "[plant]\ntheta_m_rad = 1"),
    ("[[event]]\nt = 0.03\nset = { 'plant.seed' = 9 }", "event.0.set.plant.seed", None),
]  # fmt: skip
IDS = [key for _, key, _ in CASES]


def text_of(added: str) -> str:
    return HEAD + PROFILE + added + "\n"


def bits(scenario: Scenario, motor: Motor) -> np.ndarray:
    return simulate(scenario, motor).rows


@pytest.mark.parametrize(("added", "key", "_"), CASES, ids=IDS)
def test_a_key_without_effect_is_refused_by_name(added: str, key: str, _: str | None) -> None:
    with pytest.raises(FluxtrueError, match=rf"^s\.toml: {key}: (has no effect here|.* never approached)") as refusal:
        parse(text_of(added), "s.toml")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(("added", "key", "_"), CASES, ids=IDS)
def test_a_refused_key_would_not_have_changed_a_bit(
    added: str, key: str, _: str | None, hsm1: Motor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(effects, "check", lambda *_: None)
    whole = text_of(added)
    lines = [line for line in whole.splitlines() if not line.startswith(key.rsplit(".", 1)[1])]
    without = parse("\n".join(lines).split("[[event]]")[0], "s.toml")
    assert np.array_equal(bits(parse(whole, "s.toml"), hsm1), bits(without, hsm1))


@pytest.mark.parametrize(("key", "effective"), [(k, e) for _, k, e in CASES if e], ids=[k for _, k, e in CASES if e])
def test_a_key_that_has_an_effect_is_accepted(key: str, effective: str, hsm1: Motor) -> None:
    whole = text_of(effective)
    name = key.rsplit(".", 1)[1]
    lines = [line for line in whole.splitlines() if not line.startswith(name)]
    with_key = bits(parse(whole, "s.toml"), hsm1)
    assert not np.array_equal(with_key, bits(_parsed_without_check("\n".join(lines)), hsm1))


def _parsed_without_check(text: str) -> Scenario:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(effects, "check", lambda *_: None)
        return parse(text, "s.toml")


@pytest.mark.parametrize("name", effects.MAP_INSTEAD)
def test_constants_on_a_machine_with_a_map_are_refused(name: str, hsm1: Motor, paper: Motor) -> None:
    event = f"[[event]]\nt = 0.01\nset = {{ 'plant.{name}' = 1e-3 }}"
    for added, key in ((f"[plant]\n{name} = 1e-3", f"plant.{name}"), (event, f"event.0.set.plant.{name}")):
        with pytest.raises(FluxtrueError, match=f"^s.toml: {key}: has no effect here: the motor has a flux map"):
            simulate(parse(text_of(added), "s.toml"), hsm1, where="s.toml")
    changed = parse(text_of(f"[plant]\n{name} = {1.2 * paper.plant[name]}"), "s.toml")
    assert not np.array_equal(bits(changed, paper), bits(parse(text_of(""), "s.toml"), paper))


def test_a_seed_without_noise_is_refused(hsm1: Motor) -> None:
    with pytest.raises(FluxtrueError, match=r"^s\.toml: seed: has no effect here: plant\.current_noise_A_rms is 0"):
        parse("seed = 7\n" + text_of(""), "s.toml")
    silent = _parsed_without_check("seed = 7\n" + text_of(""))
    assert np.array_equal(bits(silent, hsm1), bits(parse(text_of(""), "s.toml"), hsm1))
    noise = text_of("[plant]\ncurrent_noise_A_rms = 0.5")
    assert not np.array_equal(bits(parse("seed = 7\n" + noise, "s.toml"), hsm1), bits(parse(noise, "s.toml"), hsm1))


def test_a_name_that_the_twin_does_not_have_is_told_from_one_that_does_not_exist(hsm1: Motor) -> None:
    twin = text_of("[controller]\nkind = 'twin'\ntrim = 1")
    with pytest.raises(FluxtrueError, match=r"controller\.trim = 1: the twin has no such name; allowed with"):
        simulate(parse(twin, "s.toml"), hsm1, where="s.toml")


@pytest.mark.parametrize(("added", "said"), [
    ("winding_C = -400", r"profile\.winding_C = -400 °C, allowed: above -234\.453 and up to 1e\+12 °C"),
    ("winding_C = [[0, 20], [0.05, -300]]", r"profile\.winding_C reaches -300 °C at t = 0\.05 s, allowed: above"),
    ("magnet_scale = -0.1", r"profile\.magnet_scale = -0\.1, allowed: 0 to 1e\+12$"),
    ("[plant]\nr_ohm_20 = nan", r"plant\.r_ohm_20 = nan Ω, allowed: a finite number above 0 up to 1e\+12 Ω"),
    ("[plant]\nrotor_C = nan", r"plant\.rotor_C = nan °C, allowed: a finite number from -1e\+12 to 1e\+12 °C"),
])  # fmt: skip
def test_what_no_machine_can_be_is_refused(added: str, said: str, hsm1: Motor) -> None:
    with pytest.raises(FluxtrueError, match=said):
        simulate(parse(text_of(added), "s.toml"), hsm1, where="s.toml")


def test_cross_saturation_of_a_machine_with_constants_is_refused(hsm1: Motor, paper: Motor) -> None:
    scenario = parse(text_of("[plant]\ncross_saturation_scale = 1.5"), "s.toml")
    with pytest.raises(FluxtrueError, match="cross_saturation_scale: has no effect here: the motor has no flux map"):
        simulate(scenario, paper)
    assert not np.array_equal(bits(scenario, hsm1), bits(parse(text_of(""), "s.toml"), hsm1))


def test_every_value_is_checked_before_the_first_period(hsm1: Motor, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise AssertionError("a period was simulated")

    monkeypatch.setattr(Loop, "run", fail)
    late = [
        ("torque_Nm = [[0, 0], [100, 500]]",
         "profile.torque_Nm reaches 500 N·m at t = 100 s, allowed: -132 to 132 N·m"),
        ("vdc_V = [[0, 350], [99, -1]]", "profile.vdc_V reaches -1 V at t = 99 s, allowed: above 0 and up to 1e+12 V"),
        ("[[event]]\nt = 99\nset = { dead_time_compensation = 3 }",
         "event.0.set.dead_time_compensation = 3, allowed: 0, or 0.00133"),
        ("[[event]]\nt = 99\nset = { 'plant.adc_bits' = 30 }",
         "event.0.set.plant.adc_bits = 30, allowed: from 1 and below 25"),
        ("[[event]]\nt = 99\nset = { enabel = 1 }", "event.0.set.enabel = 1: no such name, allowed: enable"),
    ]  # fmt: skip
    for added, message in late:
        text = 'motor = "hsm1"\nduration_s = 100.5\nrecord_every_s = 0.1\n[profile]\n' + added
        with pytest.raises(FluxtrueError) as refusal:
            simulate(parse(text, "s.toml"), hsm1, where="s.toml")
        assert str(refusal.value).startswith(f"s.toml: {message}"), refusal.value


def test_the_range_that_a_message_states_is_the_accepted_range(hsm1: Motor) -> None:
    with Loop(hsm1.library, hsm1.plant, hsm1.flux_map) as loop:
        for name in ("observer_m", "torque_requested_Nm", "plant.dead_time_s", "plant.vdc_V", "inverter_C"):
            found = check.limits(loop, name)
            for edge, taken, outwards in ((found.low, found.takes_low, -1), (found.high, found.takes_high, 1)):
                if not np.isfinite(edge):
                    continue
                assert _takes(loop, name, edge) == taken, (name, edge)
                assert not _takes(loop, name, edge + outwards * 1e-4 * max(abs(edge), 1e-3)), (name, edge)


def _takes(loop: Loop, name: str, value: float) -> bool:
    try:
        loop.set(name, value)
    except LoopError:
        return False
    return True


def test_a_recording_that_would_fill_the_memory_is_refused(hsm1: Motor) -> None:
    text = 'motor = "hsm1"\nduration_s = 36000\nrecord_every_s = 1e-4'
    with pytest.raises(FluxtrueError, match="record_every_s = 0.0001 s: 360000000 rows .*, allowed: from 0.01"):
        simulate(parse(text, "s.toml"), hsm1, where="s.toml")
