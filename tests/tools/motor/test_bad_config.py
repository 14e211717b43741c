# SPDX-License-Identifier: Apache-2.0
"""motor.toml: every error is reported in one line, and nothing is written."""

import os
from pathlib import Path

import pytest
from conftest import toml

from fluxtrue_tools.cli import run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.motor.motor import load_motor

# change, words that the message must contain
# A motor of 24 V and 2.4 mV·s: keys that are tried for the advice make its flux small against the voltage.
SMALL = {"pole_pairs": 21, "r_ohm": 0.105, "i_max_A": 40.0, "torque_max_Nm": 3.0, "inertia_kgm2": 6e-5,
         "ld_H": 30e-6, "lq_H": 30e-6, "psi_f_Vs": 2.4e-3}  # fmt: skip
SMALL_INVERTER = {"vdc_V": 24.0, "pwm_hz": 40000.0, "dead_time_s": 5e-7, "current_full_scale_A": 60.0}
BAD = [
    (
        {"machine": SMALL | {"speed_max_rpm": 1.0}, "inverter": SMALL_INVERTER},
        ["machine.speed_max_rpm = 1 rpm, allowed: from 6.99 rpm"],
    ),
    (
        {"machine": SMALL | {"speed_max_rpm": 2400.0, "iron_loss_eddy": 500.0}, "inverter": SMALL_INVERTER},
        ["machine.iron_loss_eddy = 500 W/((rad/s)²·(V·s)²), allowed: up to 2.49"],
    ),
    (
        {
            "machine": SMALL
            | {"speed_max_rpm": 12000.0, "psi_f_Vs": 3e-4, "ld_H": 3e-6, "lq_H": 3e-6, "torque_max_Nm": 0.3},
            "inverter": SMALL_INVERTER | {"vdc_V": 60.0},
        },
        ["inverter.vdc_V = 60 V, allowed: up to 36 V", "0.323 mV·s, is so small for vdc_V", "up to 5.02e+04 rad/s"],
    ),
    ({"machine": {"pole_pairs": None}}, ["machine.pole_pairs", "missing", "whole number from 1 to 50"]),
    ({"machine": {"pole_pairs": 0}}, ["machine.pole_pairs = 0", "from 1 to 50"]),
    ({"machine": {"pole_pairs": 2.5}}, ["machine.pole_pairs = 2.5", "whole number"]),
    ({"machine": {"pole_pairs": "true"}}, ["machine.pole_pairs = True", "whole number"]),
    ({"machine": {"pole_pairs": '"4"'}}, ["machine.pole_pairs = '4'", "whole number"]),
    ({"machine": {"r_ohm": 0.0}}, ["machine.r_ohm = 0.0", "from 1e-05"]),
    ({"machine": {"r_ohm": -0.02}}, ["machine.r_ohm = -0.02", "from 1e-05"]),
    ({"machine": {"r_ohm": 1e-320}}, ["machine.r_ohm = 1e-320", "from 1e-05"]),
    ({"machine": {"torque_max_Nm": 1e-9}}, ["machine.torque_max_Nm = 1e-09", "from 1.579", "1 % of the torque"]),
    ({"control": {"flux_bandwidth_rad_s": 1e-9}}, ["control.flux_bandwidth_rad_s = 1e-09", "from 0.1 to 1000"]),
    ({"machine": {"r_ohm": "nan"}}, ["machine.r_ohm = nan", "finite number"]),
    ({"machine": {"speed_max_rpm": "inf"}}, ["machine.speed_max_rpm = inf", "finite number"]),
    ({"machine": {"r_ohm": 5.0}}, ["machine.r_ohm = 5", "30 % of vdc_V"]),
    ({"machine": {"name": '"a */ b"'}}, ["machine.name", "letters, digits"]),
    ({"machine": {"name": '""'}}, ["machine.name", "letters, digits"]),
    ({"machine": {"name": 7}}, ["machine.name = 7"]),
    ({"machine": {"polepairs": 4}}, ["machine.polepairs", "unknown key", "pole_pairs"]),
    ({"machine": {"iron_loss_hysteresis": 1e9}}, ["iron_loss_hysteresis = 1000000000.0 W/(rad/s·(V·s)²)", "10000"]),
    ({"motor": {"x": 1}}, ["motor", "unknown key", "machine, inverter, control"]),
    ({"control": {"observer_m": 5.0}}, ["control.observer_m = 5.0", "from 2 to 4"]),
    ({"control": {"observer_mm": 3.0}}, ["control.observer_mm", "unknown key"]),
    ({"control": {"torque_authority": 1.5}}, ["control.torque_authority = 1.5", "0.9"]),
    ({"machine": {"ld_H": None}}, ["machine.ld_H", "missing", "flux_map"]),
    ({"machine": {"flux_map": '"flux_map.csv"'}}, ["machine.flux_map", "machine.ld_H", "not both"]),
    ({"machine": {"ld_H": None, "lq_H": None, "psi_f_Vs": None}}, ["either flux_map or"]),
    ({"machine": {"speed_max_rpm": 30000.0}}, ["machine.speed_max_rpm = 30000", "1.2", "28640 rpm"]),
    ({"machine": {"torque_max_Nm": 400.0}}, ["machine.torque_max_Nm = 400", "up to 157.9"]),
    ({"inverter": {"current_full_scale_A": 300.0}}, ["inverter.current_full_scale_A = 300", "337.5"]),
    ({"inverter": {"current_full_scale_A": 9000.0}}, ["inverter.current_full_scale_A = 9000", "5000"]),
    ({"inverter": {"adc_bits": 17}}, ["inverter.adc_bits = 17", "8 to 16"]),
    ({"inverter": {"pwm_hz": 100.0}}, ["inverter.pwm_hz = 100.0", "4000 to 40000"]),
    ({"inverter": {"dead_time_s": 15e-6}}, ["inverter.dead_time_s = 1.5e-05", "10 % of the PWM period"]),
    ({"inverter": {"min_pulse_s": 15e-6}}, ["inverter.min_pulse_s = 1.5e-05", "10 % of the PWM period"]),
    ({"inverter": {"v_dc_full_scale_V": 400.0}}, ["inverter.v_dc_full_scale_V = 400", "455"]),
    ({"inverter": {"v_dc_full_scale_V": 3000.0}}, ["v_dc_full_scale_V"]),
    ({"inverter": {"v_dc_offset_V": 27.0}}, ["inverter.v_dc_offset_V = 27 V", "-26.25 to 26.25 V", "5 %"]),
    ({"inverter": {"v_dc_offset_V": -27.0}}, ["inverter.v_dc_offset_V = -27 V", "-26.25 to 26.25 V"]),
    ({"inverter": {"v_dc_offset_V": 300.0}}, ["inverter.v_dc_offset_V = 300", "-200 to 200"]),
    ({"inverter": {"v_dc_offset_V": 10.0, "v_dc_full_scale_V": 460.0}}, ["v_dc_offset_V = 10 V", "up to 5 V"]),
    ({"inverter": {"device_drop_V": 9.0}, "machine": {}}, None),  # 9 V of 350 V: allowed
    ({"machine": {"ld_H": 0.0}}, ["machine.ld_H = 0.0", "above 0 up to 1"]),
    ({"inverter": {"min_pulse_s": -1.0}}, ["inverter.min_pulse_s = -1.0", "from 0 to 2e-05"]),
    ({"machine": {"flux_map": '""'}}, ["machine.flux_map = ''", "1 to 255 printable characters"]),
    ({"machine": {"flux_map": "'maps\\map.csv'"}}, ["machine.flux_map = 'maps", "printable characters without \\"]),
    ({"machine": {"flux_map": '"\\u0000"'}}, ["machine.flux_map = ", "1 to 255 printable characters"]),
    ({"machine": {"r_ohm": "9" * 400}}, ["machine.r_ohm = 999", "...", "from 1e-05 to 100"]),
]


def test_a_byte_order_mark_is_no_error(write):
    path = write() / "motor.toml"
    path.write_text("\ufeff" + path.read_text(encoding="utf-8"), encoding="utf-8")
    assert load_config(path.parent).machine.name == "bench"


def test_a_number_of_thousands_of_digits_is_refused(write):
    with pytest.raises(FluxtrueError, match=r"machine\.pole_pairs = 9+\.\.\., allowed: a whole number from 1 to 50"):
        load_config(write(machine={"pole_pairs": "9" * 5000}))


@pytest.mark.parametrize(("changes", "words"), [case for case in BAD if case[1]])
def test_a_bad_value_is_named_with_file_field_value_and_range(write, changes, words):
    with pytest.raises(FluxtrueError) as error:
        from fluxtrue_tools.motor.emit_c import motor_tables_c

        motor_tables_c(load_motor(write(**changes)))
    text = str(error.value)
    assert "\n" not in text
    for word in words:
        assert word in text, text


def test_values_at_the_edge_of_their_range_are_taken(write):
    load_config(write(inverter={"device_drop_V": 9.0}, control={"observer_m": 4, "dead_time_compensation": 0}))


@pytest.mark.parametrize("section", ["machine", "inverter"])
def test_a_missing_section_is_named(folder, section):
    text = toml({}).split("[inverter]")
    (folder / "motor.toml").write_text(text[0] if section == "inverter" else "[inverter]" + text[1])
    with pytest.raises(FluxtrueError, match=rf"\[{section}\]: section missing"):
        load_config(folder)


def test_a_section_that_is_a_number_is_refused(folder):
    (folder / "motor.toml").write_text("machine = 3\n[inverter]\n" + toml({}).split("[inverter]\n")[1])
    with pytest.raises(FluxtrueError, match="machine = 3, allowed: a section"):
        load_config(folder)


@pytest.mark.parametrize(("content", "words"), [
    (b"[machine\n", "not valid TOML"),
    (b"[machine]\nname = \"a\"\nname = \"b\"\n", "not valid TOML"),
    (b"\xff\xfe\x00", "not UTF-8"),
])  # fmt: skip
def test_a_file_that_is_no_toml_is_refused_in_one_line(folder, content, words):
    (folder / "motor.toml").write_bytes(content)
    with pytest.raises(FluxtrueError, match=words) as error:
        load_config(folder)
    assert "\n" not in str(error.value)


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FluxtrueError, match="nowhere.*no such file"):
        load_config(tmp_path / "nowhere")


def test_a_file_in_place_of_a_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(FluxtrueError, match="not a folder"):
        load_config(tmp_path / "file")


@pytest.mark.parametrize("command", [["check"], ["build", "--out", "OUT"]])
def test_the_command_line_says_it_in_one_line_and_writes_nothing(cli, write, tmp_path, command):
    bad = write(machine={"r_ohm": -1.0})
    out = tmp_path / "out"
    arguments = [str(out) if part == "OUT" else part for part in command]
    result = cli(arguments[0], bad, *arguments[1:])
    assert result.returncode == 2
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1 and result.stderr.startswith("error: ")
    assert str(Path(bad, "motor.toml")) in result.stderr
    assert not out.exists()


def test_a_pipe_in_place_of_the_file_is_refused_without_being_read(tmp_path, capsys):
    """Reading it would wait until something is written to it."""
    os.mkfifo(tmp_path / "motor.toml")
    for command in (["check"], ["build", "--no-report", "--out", str(tmp_path / "out")]):
        assert run(["motor", command[0], str(tmp_path), *command[1:]]) == 2
        assert capsys.readouterr().err == f"error: {tmp_path}/motor.toml: cannot be read (not a file)\n"
    assert [path.name for path in tmp_path.iterdir()] == ["motor.toml"]


def test_the_example_in_the_guide_is_a_valid_motor(folder):
    guide = (Path(__file__).resolve().parents[3] / "docs/howto/bring-your-motor.md").read_text(encoding="utf-8")
    (folder / "motor.toml").write_text(guide.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    assert load_config(folder).machine.name == "my motor"
