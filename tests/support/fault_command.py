# SPDX-License-Identifier: Apache-2.0
"""`fluxtrue faults` as a user starts it, for the tests of the fault campaigns."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def faults(campaign: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """The finished process with what it has printed."""
    command = [sys.executable, "-m", "fluxtrue_tools", "faults", str(campaign), *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
