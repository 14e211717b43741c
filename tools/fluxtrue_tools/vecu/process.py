# SPDX-License-Identifier: Apache-2.0
"""The virtual ECU as a child process."""

import os
import re
import subprocess
from pathlib import Path
from types import TracebackType

from fluxtrue_tools.errors import FluxtrueError

HOST = "127.0.0.1"
_GREETING = re.compile(r"fluxtrue-vecu motor=(\S+) mode=(\S+) can=(\d+) bench=(\d+)")
STOP_S = 10.0


class VirtualEcu:
    """Starts the virtual ECU on free ports, gives their numbers, and stops it."""

    def __init__(self, program: Path, fast: bool = True, seed: int = 1, nvm: Path | None = None,
                 machine: Path | None = None, environment: dict[str, str] | None = None) -> None:  # fmt: skip
        command = [str(program), "--fast" if fast else "--realtime", "--port", "0", "--bench-port", "0",
                   "--seed", str(seed)]  # fmt: skip
        command += ["--nvm", str(nvm)] if nvm is not None else []
        command += ["--machine", str(machine)] if machine is not None else []
        try:
            self._process = subprocess.Popen(
                command, stdout=subprocess.PIPE, text=True, env=os.environ | (environment or {})
            )
        except OSError as error:
            raise FluxtrueError(f"virtual ECU {program}: {error.strerror}") from error
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        found = _GREETING.match(line)
        if found is None:
            self._process.kill()
            raise FluxtrueError(f"virtual ECU {program}: said '{line.strip()}', wanted its ports")
        self.motor, self.can_port, self.bench_port = found[1], int(found[3]), int(found[4])

    def stop(self) -> int:
        """End it as a user does; the result is its exit code."""
        self._process.terminate()
        try:
            return self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def __enter__(self) -> "VirtualEcu":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
