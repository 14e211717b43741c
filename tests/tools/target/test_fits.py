# SPDX-License-Identifier: Apache-2.0
"""Which machines a port can carry."""

import json
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner
from load_table import SUM, load_rows, sensor_rows

from fluxtrue_tools.cli import main
from fluxtrue_tools.emulate.build import FLASHED
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.target import fits

ROOT = Path(__file__).resolve().parents[3]
PORT = ROOT / "hal" / "s32k144"
# The most cycles of a period's interrupts, a task, a received command, while driving and while reacting to a fault.
COSTS = {"10 kHz work": (1000, 1100), "1 kHz task": (20000, 15000), "CAN ISR": (300, 300)}
# What sensors add that are measured with the cheap identification alone.
ADDED = {"one": {"10 kHz work": (10, 200), "1 kHz task": (0, 0), "CAN ISR": (0, 0)},
         "less": {"10 kHz work": (-500, -500), "1 kHz task": (-1, 5000), "CAN ISR": (-1, -1)}}  # fmt: skip
LAWS = {"usual": {"cycles": [1, 1, 100]}, "turning": {"cycles": [1, 1, 350]}}
SLOW = {"pole_pairs": 3, "speed_max_rpm": 1000.0}


@pytest.fixture
def checked(tmp_path):
    """fits.check() for a PWM frequency, a dead time and a clock of the core, with the known costs above."""

    def _checked(pwm_hz, dead_time_s=1e-6, core_Hz=112e6, machine=SLOW, angle="encoder"):
        folder = tmp_path / "aport"
        folder.mkdir(exist_ok=True)
        motor, measured, budget = tmp_path / "motor.json", tmp_path / "performance.json", folder / "budget.toml"
        motor.write_text(json.dumps({"machine": machine, "inverter": {"pwm_hz": pwm_hz, "dead_time_s": dead_time_s}}))
        measured.write_text(json.dumps(_measured()))
        pwm = "\n".join(f"{key} = {value}" for key, value in _port()["pwm"].items())
        budget.write_text(f"core_Hz = {core_Hz}\nflash_bytes = 1\nram_bytes = 1\nbusy_share_max = 0.75\n[pwm]\n{pwm}\n")
        return fits.check(motor, budget, measured, angle)

    return _checked


def _rows(costs):
    return {name: {"cycles_at_most": {"driving": a, "reacting": b}} for name, (a, b) in costs.items()}


def _measured():
    """The encoder's cheap and dear identification; of the sensors the cheap one, of one of them both."""
    cheap = dict.fromkeys(COSTS, (1, 1))
    sensors = {name: {"runs": {"a": _rows({row: (1 + a, 1 + b) for row, (a, b) in added.items()})}}
               for name, added in ADDED.items()}  # fmt: skip
    sensors["both"] = {"runs": {"a": _rows(cheap), "b": _rows(COSTS | {"10 kHz work": (1000, 1500)})}}
    drives = {"a": {"runs": _rows(cheap)}, "b": {"runs": _rows(COSTS)}}
    return {"drives": drives, "sensors": sensors, "kernels": {"laws": LAWS}}


def _port():
    return tomllib.loads((PORT / "budget.toml").read_text(encoding="utf-8"))


def test_the_share_is_periods_tasks_and_commands_of_the_dearer_identification(checked):
    # 40e3 * 1000 + 1000 * 20000 + 100 * 300 of 112e6: 53.6 %; while reacting 40e3 * 1100 + 1000 * 15000 + ...: 52.7 %
    assert checked(40e3) == ("busy for at most 54 % of the time at inverter.pwm_hz = 40000 with the angle sensor "
                             "encoder, without wait states")  # fmt: skip
    # 60e3 * 1100 + 1000 * 15000 + 100 * 300 of 140e6 while reacting: 57.9 %; while driving 57.2 %
    assert "58 %" in checked(60e3, core_Hz=140e6)
    # 4.5 kHz: five periods a step, 900 steps a second: 4.5e6 + 18e6 + 0.03e6: 20.1 %
    assert "20 %" in checked(4.5e3)


def test_a_field_that_turns_far_pays_for_its_law(checked):
    """0.35 rad per period are 13,369 rpm with ten pole pairs at 40 kHz: beyond, 40e3 * 250 more of 112e6, 8.9 %."""
    assert "54 %" in checked(40e3, machine={"pole_pairs": 10, "speed_max_rpm": 13300.0})
    assert "63 %" in checked(40e3, machine={"pole_pairs": 10, "speed_max_rpm": 13400.0})


def test_a_processor_that_would_be_busy_too_long_is_named_with_the_bound(checked):
    # (0.75 * 70e6 - 20.03e6)/1000 = 32.47 kHz
    checked(32e3, core_Hz=70e6)
    with pytest.raises(FluxtrueError) as refused:
        checked(33e3, core_Hz=70e6)
    assert str(refused.value) == (
        "the processor of the aport would be busy for 76 % of the time at inverter.pwm_hz = 33000 with the angle "
        "sensor encoder, allowed: up to 75 %"
    )


def test_a_sensor_costs_what_was_measured_with_it(checked):
    # 40e3 * 1500 + 1000 * 15000 + 100 * 300 of 112e6 while reacting
    assert "67 %" in checked(40e3, angle="both")


def test_an_identification_that_was_not_measured_with_a_sensor_is_estimated(checked):
    # 200 cycles more in either state: 40e3 * 1200 + 1000 * 20000 + 100 * 300 of 112e6 while driving
    assert "61 %" in checked(40e3, angle="one")
    # nothing is taken away, the task's 5000 come on top: 40e3 * 1000 + 1000 * 25000 + 100 * 300 of 112e6
    assert "58 %" in checked(40e3, angle="less")


def test_an_unknown_sensor_is_refused_with_those_that_were_measured(checked):
    with pytest.raises(FluxtrueError) as refused:
        checked(10e3, angle="quadrature")
    assert str(refused.value) == "--angle quadrature, allowed: encoder, one, less, both"


@pytest.mark.parametrize(("pwm_hz", "dead_time_s", "most"), [(40e3, 3.2e-6, "3.125e-06"), (40e3, 0.0, "3.125e-06"),
                                                             (2e3, 40e-6, "3.654e-05")])  # fmt: skip
def test_a_dead_time_that_the_timer_cannot_keep_is_refused_with_what_it_can(checked, pwm_hz, dead_time_s, most):
    with pytest.raises(FluxtrueError, match=rf"inverter.dead_time_s = {dead_time_s:g}, allowed on the aport at "
                                            rf"inverter.pwm_hz = {pwm_hz:g}: more than 0, up to {most}"):  # fmt: skip
        checked(pwm_hz, dead_time_s)


def test_an_eighth_of_the_period_is_allowed(checked):
    assert checked(40e3, 3.125e-6)


def test_a_period_beyond_the_timer_is_refused(checked):
    with pytest.raises(FluxtrueError, match=r"inverter.pwm_hz = 1700, allowed on the aport: from 1709"):
        checked(1.7e3)


def test_the_limits_are_those_of_the_port_s_timer():
    source = (PORT / "pwm.c").read_text(encoding="utf-8")
    pwm = _port()["pwm"]
    assert int(re.search(r"#define PERIOD_MAX (\d+)U", source)[1]) == pwm["period_ticks_max"]
    assert 4 * int(re.search(r"#define DEAD_TIME_MAX (\d+)U", source)[1]) == pwm["dead_time_ticks_max"]
    assert f"dead_time_ticks <= config->period_ticks / {1 / pwm['dead_time_share_max']:g}U" in source
    assert pwm["timer_Hz"] == _port()["core_Hz"]


@pytest.mark.parametrize("pwm_hz", [4e3, 5e3, 8e3, 10e3, 16e3, 20e3, 40e3])
def test_the_s32k144_carries_every_frequency_that_a_motor_may_have(tmp_path, pwm_hz):
    """With the measured costs of the encoder."""
    motor = tmp_path / "motor.json"
    motor.write_text(json.dumps({"machine": SLOW, "inverter": {"pwm_hz": pwm_hz, "dead_time_s": 2e-6}}))
    assert "busy for at most" in fits.check(motor, PORT / "budget.toml")


@cache
def _hsm1(khz):
    """hsm1 at this frequency."""
    name = "hsm1" if khz == 10 else f"hsm1_{khz:g}kHz"
    config = load_motor(ROOT / ("firmware" if khz == 10 else "tests") / "motors" / name).config
    return fits.Built.model_validate({
        "machine": {"pole_pairs": config.machine.pole_pairs, "speed_max_rpm": config.machine.speed_max_rpm},
        "inverter": {"pwm_hz": config.inverter.pwm_hz, "dead_time_s": config.inverter.dead_time_s},
    })  # fmt: skip


def _costs():
    return json.loads(fits.MEASURED.read_text(encoding="utf-8"))


def _busy_share(built, angle="encoder", measured=None):
    """By the committed costs, or by others."""
    return fits.busy_share(built, _port()["core_Hz"], measured or _costs(), angle)


def test_the_readme_of_the_port_states_the_sums_of_the_largest_times():
    """The loads beside them are compared by tests/target/s32k144/test_frequencies.py."""
    stated = {khz: cells[SUM] for khz, cells in load_rows().items()}
    assert list(stated) == [5, 8, 10, 16, 20, 40]
    assert stated == {khz: f"{100 * _busy_share(_hsm1(khz)):.1f} %" for khz in stated}


def _sensors_row(angle):
    """The cells of an angle sensor's row: the sums, and the highest whole number of kilohertz that is built."""
    share_max, cells = _port()["busy_share_max"], []
    for khz in (10, 20, 40):
        share = _busy_share(_hsm1(khz), angle)
        cells.append(f"{100 * share:.1f} %" + (", refused" if share > share_max else ""))
    built = _hsm1(40).model_copy(deep=True)
    for khz in range(40, 3, -1):
        built.inverter.pwm_hz = 1e3 * khz
        if _busy_share(built, angle) <= share_max:
            return (*cells, f"{khz} kHz")
    raise AssertionError(f"{angle}: not even 4 kHz")


def test_the_readme_of_the_port_states_the_sums_of_every_sensor():
    stated = {cells[0].strip("`"): cells[1:] for cells in sensor_rows()}
    angles = {"quadrature" if angle == "encoder" else angle: angle for angle in FLASHED}
    assert stated == {name: _sensors_row(angle) for name, angle in angles.items()}
    built = [name for name, cells in stated.items() if "refused" not in cells[2]]
    assert built == ["quadrature", "resolver"], "the sentence below"


def test_the_estimate_of_what_is_not_measured_is_near_what_is_measured_of_the_resolver():
    measured, without = _costs(), _costs()
    assert sorted(measured["sensors"]["resolver"]["runs"]) == ["paper", "robust"]
    del without["sensors"]["resolver"]["runs"]["paper"]
    for khz in (20, 40):
        found, estimated = (_busy_share(_hsm1(khz), "resolver", costs) for costs in (measured, without))
        assert found == pytest.approx(estimated, abs=0.001)
        assert found > _busy_share(_hsm1(khz), measured=measured) + 0.002, "the sensor adds more than this tolerance"


@pytest.mark.parametrize("angle", ["as5047", "sincos", "windings"])
def test_the_estimate_of_what_is_not_measured_decides_at_20_and_40_khz(angle):
    measured, robust = _costs(), _costs()
    del robust["drives"]["paper"]
    assert list(measured["sensors"][angle]["runs"]) == ["robust"]
    decides = [_busy_share(_hsm1(khz), angle, robust) < _busy_share(_hsm1(khz), angle) for khz in (10, 20, 40)]
    assert decides == [False, True, True], "as the README says"


@pytest.mark.parametrize("angle", ["as5047", "sincos", "windings"])
def test_at_40_khz_every_sensor_but_encoder_and_resolver_is_refused_and_accepted_at_37(tmp_path, angle):
    motor = tmp_path / "motor.json"

    def invoked(pwm_hz):
        motor.write_text(json.dumps({"machine": SLOW, "inverter": {"pwm_hz": pwm_hz, "dead_time_s": 2e-6}}))
        options = ["--budget", str(PORT / "budget.toml"), "--angle", angle]
        return CliRunner().invoke(main, ["target", "fits", str(motor), *options])

    refused = invoked(40e3)
    assert isinstance(refused.exception, FluxtrueError)
    assert re.fullmatch(rf"the processor of the s32k144 would be busy for \d+ % of the time at inverter.pwm_hz = 40000 "
                        rf"with the angle sensor {angle}, allowed: up to 75 %", str(refused.exception))  # fmt: skip
    done = invoked(37e3)
    assert done.exit_code == 0
    assert done.output.endswith(f"at inverter.pwm_hz = 37000 with the angle sensor {angle}, without wait states\n")


def test_on_the_command_line_a_refusal_is_one_message(tmp_path):
    motor = tmp_path / "motor.json"
    motor.write_text(json.dumps({"machine": SLOW, "inverter": {"pwm_hz": 40e3, "dead_time_s": 4e-6}}))
    done = CliRunner().invoke(main, ["target", "fits", str(motor), "--budget", str(PORT / "budget.toml")])
    assert isinstance(done.exception, FluxtrueError)
    assert "allowed on the s32k144 at inverter.pwm_hz = 40000" in str(done.exception)
