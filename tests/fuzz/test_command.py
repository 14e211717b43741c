# SPDX-License-Identifier: Apache-2.0
"""The command `tools/fluxtrue fuzz`, with few frames. The long run is the test fuzz-bus-campaign."""

import subprocess
import sys


def fuzz(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fluxtrue_tools", "fuzz", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_seed_sends_the_same_frames_again_and_another_one_others() -> None:
    first, again, other = (fuzz("--frames", "100000", "--seed", seed) for seed in ("5", "5", "6"))
    assert (first.returncode, other.returncode) == (0, 0), first.stdout + first.stderr
    assert " accepted, as the oracle says" in first.stdout
    assert first.stdout == again.stdout != other.stdout


def test_bad_input_gets_one_message_and_no_run() -> None:
    for arguments, wanted in (
        (("--frames", "0"), "'--frames': 0 is not in the range"),
        (("--seed", "-1"), "'--seed': -1 is not in the range"),
        (("--build-dir", "/nowhere"), "/nowhere: cannot be read"),
    ):
        done = fuzz(*arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert wanted in done.stderr and len(done.stderr.splitlines()) == 1
