# SPDX-License-Identifier: Apache-2.0
"""The programs of docs/howto/sil, as a reader would run them."""

import os
import re
import subprocess
import sys

from sil import BUILD, ROOT, library_path


def check_what_if(output: str) -> None:
    """Requested torque at the shaft, and the same torque again from the same state."""
    head, *torques, last = output.splitlines()
    assert re.fullmatch(r"firmware \d+\.\d+\.\d+, ABI 2, motor paper, period 100 us", head)
    assert last == "The repetition is the same to the last bit."
    pairs = [tuple(map(float, re.findall(r"(-?[\d.]+) N", line))) for line in torques]
    assert [requested for requested, _ in pairs] == [40.0, -40.0, 80.0, 40.0]
    assert all(abs(made - requested) < 0.01 * abs(requested) for requested, made in pairs)
    assert pairs[0] == pairs[3]


def test_the_c_program_continues_one_state_several_times() -> None:
    done = subprocess.run([BUILD / "tests" / "sil" / "what_if"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    check_what_if(done.stdout)


def test_the_python_program_finds_the_open_sensor_of_a_recording() -> None:
    done = subprocess.run([sys.executable, ROOT / "docs" / "howto" / "sil" / "replay.py"], capture_output=True,
                          text=True, check=False,
                          env=os.environ | {"FLUXTRUE_SIL": str(library_path("hsm1"))})  # fmt: skip
    assert done.returncode == 0, done.stderr
    head, i_d, i_q, speed, *found = done.stdout.splitlines()
    assert head == "motor hsm1, 10000 periods of 100 us"
    assert abs(float(i_d.removeprefix("id_A "))) < 1.0
    assert abs(float(i_q.removeprefix("iq_A ")) - 80.0) < 1.0
    assert abs(float(speed.removeprefix("speed_rpm ")) - 1000.0) < 2.0
    assert len(found) == 1 and re.fullmatch(r"current_sum after [\d.]+ ms: .*\.", found[0])
