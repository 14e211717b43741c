# SPDX-License-Identifier: Apache-2.0
"""fluxtrue emulate as a user calls it: files, messages, exit codes."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from progress import cpu_seconds

from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import ROOT, Parts
from fluxtrue_tools.sim.library import Loop

RUN = 'motor = "hsm1"\nduration_s = 0.3\n[profile]\ntorque_Nm = 40\nspeed_rpm = 1000\n'


def emulate(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fluxtrue_tools", "emulate", *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment, check=False)


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "run.toml"
    path.write_text(RUN)
    return path


def test_a_run_reports_the_torque_and_the_name_of_the_image(parts: Parts, scenario: Path, tmp_path: Path) -> None:
    summary = tmp_path / "run.json"
    done = emulate("--scenario", scenario, "--elf", parts.image, "--json", summary)
    assert done.returncode == 0, done.stderr
    data = json.loads(summary.read_text())
    assert data["controller"] == "emulated fluxtrue.elf"
    assert data["fault_word"] == 0
    assert data["mean"]["true_torque_Nm"] == pytest.approx(40, abs=1)
    assert "times real time" in done.stdout


def test_the_same_run_gives_the_same_bits_and_instructions(parts: Parts) -> None:
    motor = parts.emulated()
    seen = []
    for _ in range(2):
        with Loop(motor.library, motor.plant | {"current_noise_A_rms": 0.5, "seed": 3.0}, motor.flux_map) as loop:
            loop.set("enable", 1)
            loop.set("torque_requested_Nm", 30)
            loop.record(["truth.torque_Nm", "psi_f_Vs", "emulator.instructions"])
            seen.append(loop.run(1000).tobytes())
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (RUN + '[controller]\nkind = "twin"\n', (), "controller.kind = 'twin', allowed: 'firmware'"),
        (RUN.replace("hsm1", "paper"), ("--elf", "IMAGE"), "the image was built for another motor"),
        (RUN, ("--elf", "/nowhere/x.elf"), "/nowhere/x.elf: cannot be read (No such file or directory)"),
        (RUN, ("--elf", "SCENARIO"), "is not a 32-bit little-endian ELF file for Arm"),
        (RUN, ("--elf", sys.executable), "is not a 32-bit little-endian ELF file for Arm"),
        (RUN, ("--elf", "CUT"), "is cut short or damaged"),
        (RUN, ("--elf", "FLASHED"), "takes its commands from the bus, allowed without --serve"),
        ("motor = [", (), "not valid TOML"),
        (RUN, ("--serve", "--port", "0"), "--scenario: has no effect with --serve"),
        (RUN, ("--port", "29536"), "--port: has no effect without --serve"),
        (RUN, ("--fast",), "--realtime/--fast: has no effect without --serve"),
    ],
)
def test_bad_input_is_one_clear_message(
    parts: Parts, scenario: Path, text: str, options: tuple[str, ...], message: str
) -> None:
    scenario.write_text(text)
    cut = scenario.with_name("cut.elf")
    cut.write_bytes(parts.image.read_bytes()[:60000])
    flashed = build.prepare("hsm1", flashed=True) if "FLASHED" in options else parts
    named = {"IMAGE": str(parts.image), "SCENARIO": str(scenario), "CUT": str(cut), "FLASHED": str(flashed.image)}
    done = emulate("--scenario", scenario, *(named.get(option, option) for option in options))
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_an_image_without_a_bus_is_refused_with_serve(parts: Parts) -> None:
    done = emulate("--serve", "--elf", parts.image)
    assert done.returncode == 2
    assert "takes no commands from the bus, allowed with --serve" in done.stderr


@pytest.mark.parametrize("taken", ["--port", "--bench-port"])
def test_a_port_that_is_taken_is_named(parts: Parts, taken: str) -> None:
    free = {"--port": "--bench-port", "--bench-port": "--port"}[taken]
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        done = emulate("--serve", taken, port, free, 0)
    assert done.returncode == 2
    assert done.stderr == f"error: port {port} on 127.0.0.1: Address already in use\n"


@pytest.mark.skipif("FLUXTRUE_REALTIME" not in os.environ, reason="measures this machine: FLUXTRUE_REALTIME=1")
def test_a_core_of_this_machine_emulates_at_least_half_of_real_time(parts: Parts) -> None:
    motor = parts.emulated()
    with Loop(motor.library, motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.0}, motor.flux_map) as loop:
        loop.set("enable", 1)
        loop.set("torque_requested_Nm", 80)
        loop.run(1000)
        begin = cpu_seconds()
        loop.run(20000)
        assert 2.0 / (cpu_seconds() - begin) >= 0.5
