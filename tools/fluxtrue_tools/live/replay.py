# SPDX-License-Identifier: Apache-2.0
"""A recorded drive instead of a bus: the same frames at the same distances in time."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import can

from fluxtrue_tools.errors import FluxtrueError

CHUNK_S = 0.02


def load(path: Path) -> list[can.Message]:
    """All frames of a log."""
    if not path.is_file():
        raise FluxtrueError(f"--replay {path}: no such file")
    try:
        with can.LogReader(path) as reader:
            frames = list(reader)
    except Exception as error:  # every format's reader raises exceptions of its own
        raise FluxtrueError(f"--replay {path}: not a readable log ({error})") from error
    if not frames:
        raise FluxtrueError(f"--replay {path}: holds no frame")
    return frames


class Replay:
    """Plays a log to listeners, again and again."""

    def __init__(self, frames: list[can.Message], listeners: list[Callable[[can.Message], None]],
                 speed: float = 1.0) -> None:  # fmt: skip
        self._frames, self._listeners, self._speed = frames, listeners, speed
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the replay."""
        self._stop.set()
        self._thread.join(1.0)

    def _play(self) -> None:
        origin, length = self._frames[0].timestamp, self._frames[-1].timestamp - self._frames[0].timestamp
        lap = 0
        while not self._stop.is_set():
            begun, index = time.monotonic(), 0
            while index < len(self._frames) and not self._stop.wait(CHUNK_S):
                until = origin + (time.monotonic() - begun) * self._speed
                while index < len(self._frames) and self._frames[index].timestamp <= until:
                    self._tell(self._frames[index], lap * (length + CHUNK_S))
                    index += 1
            lap += 1

    def _tell(self, frame: can.Message, later_s: float) -> None:
        told = can.Message(arbitration_id=frame.arbitration_id, is_extended_id=frame.is_extended_id,
                           data=frame.data, timestamp=frame.timestamp + later_s)  # fmt: skip
        for listener in self._listeners:
            listener(told)
