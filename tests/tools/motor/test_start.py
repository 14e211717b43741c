# SPDX-License-Identifier: Apache-2.0
"""fluxtrue motor start: a folder from a nameplate."""

import tomllib
from pathlib import Path

import pytest

from fluxtrue_tools.cli import run
from fluxtrue_tools.motor.start import guess
from fluxtrue_tools.sim.build import ROOT

UNKNOWN = ["--i-max", "250", "--vdc", "350", "--pwm", "10", "--pole-pairs", "4", "--speed-max", "9000"]
SMALL = ["--i-max", "50", "--vdc", "48", "--pwm", "20", "--pole-pairs", "4", "--speed-max", "3000"]


@pytest.mark.parametrize(("name", "nameplate"), [("unknown", UNKNOWN), ("unknown_48V", SMALL)])
def test_the_folders_of_the_tests_are_what_the_command_makes(name: str, nameplate: list[str], tmp_path: Path) -> None:
    assert run(["motor", "start", *nameplate, "--out", str(tmp_path / name)]) == 0
    made = (tmp_path / name / "motor.toml").read_text(encoding="utf-8")
    kept = (ROOT / "tests" / "motors" / name / "motor.toml").read_text(encoding="utf-8")
    assert kept == "# SPDX-License-Identifier: Apache-2.0\n" + made


def test_the_gains_follow_from_a_tenth_of_the_guessed_inductance() -> None:
    found = guess(250.0, 350.0, 1e4, 4, 9000.0)
    assert found["ld_H"] == found["lq_H"] == pytest.approx(0.1 * found["psi_f_Vs"] / 250.0, rel=1e-3)
    back_emf_V = found["psi_f_Vs"] * 4 * 9000.0 / 3.0 * 0.10472
    assert back_emf_V == pytest.approx(350.0 / 3.0**0.5, rel=1e-3)


def test_a_speed_that_is_given_is_kept_and_not_called_a_guess(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["motor", "start", *UNKNOWN[:-1], "8765.4", "--out", str(tmp_path / "m")]) == 0
    assert "speed_max_rpm" not in capsys.readouterr().out
    text = (tmp_path / "m" / "motor.toml").read_text(encoding="utf-8")
    assert "\nspeed_max_rpm = 8765.4\n" in text
    assert "\ntorque_max_Nm = " in text and text.count("# guessed") == 4
    assert run(["motor", "start", *UNKNOWN[:-2], "--out", str(tmp_path / "m")]) == 0
    assert "speed_max_rpm = 5000" in capsys.readouterr().out


def test_without_a_speed_one_is_assumed(tmp_path: Path) -> None:
    assert run(["motor", "start", *UNKNOWN[:-2], "--out", str(tmp_path / "m")]) == 0
    data = tomllib.loads((tmp_path / "m" / "motor.toml").read_text(encoding="utf-8"))
    assert data["machine"]["speed_max_rpm"] == 5000.0


def test_what_cannot_be_built_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["motor", "start", *UNKNOWN, "--full-scale", "100", "--out", str(tmp_path / "m")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: nameplate: inverter.current_full_scale_A = 100 A, allowed: from ")
    assert str(tmp_path) not in said, "a folder that is gone"
    assert list(tmp_path.iterdir()) == []


def test_a_guess_that_is_refused_is_said_to_be_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At 3 rpm the magnet that balances 2000 V is so large that even a tenth of its inductance is 368 H."""
    slow = ["--i-max", "3", "--vdc", "2000", "--pwm", "4", "--pole-pairs", "1", "--speed-max", "3"]
    assert run(["motor", "start", *slow, "--out", str(tmp_path / "m")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: nameplate: machine.ld_H = 367.6 H, allowed: ") and "guessed from --i-max" in said
    fast = [*UNKNOWN[:-1], "200000"]
    assert run(["motor", "start", *fast, "--out", str(tmp_path / "m")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: nameplate: machine.speed_max_rpm = ") and "guessed" not in said
    assert list(tmp_path.iterdir()) == []


def test_guesses_replace_guesses_but_no_other_motor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m" / "motor.toml"
    assert run(["motor", "start", *UNKNOWN, "--out", str(tmp_path / "m")]) == 0
    first = path.read_text(encoding="utf-8")
    assert run(["motor", "start", *UNKNOWN[:-2], "--out", str(tmp_path / "m")]) == 0
    assert path.read_text(encoding="utf-8") != first
    measured = (ROOT / "firmware" / "motors" / "hsm1" / "motor.toml").read_text(encoding="utf-8")
    path.write_text(measured, encoding="utf-8")
    capsys.readouterr()
    assert run(["motor", "start", *UNKNOWN, "--out", str(tmp_path / "m")]) == 2
    assert "allowed: another folder" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8") == measured
