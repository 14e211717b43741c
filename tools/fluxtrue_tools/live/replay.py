# SPDX-License-Identifier: Apache-2.0
"""A recorded drive instead of a bus: the same frames at the same distances in time, from any moment on."""

import threading
import time
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import can
from asammdf import MDF

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import TRUTH

CHUNK_S: Final = 0.02
BEFORE_S: Final = 20.0  # what the page draws: a jump fills it


@dataclass(frozen=True)
class Recording:
    """Frames, and the torque of the simulated machine if there was one; times since the first frame."""

    times_s: list[float]
    frames: list[can.Message]
    truth_s: list[float]
    truth_Nm: list[float]

    @property
    def length_s(self) -> float:
        """The time from the first to the last frame."""
        return self.times_s[-1]


def load(path: Path) -> Recording:
    """Everything in a log that a page can show."""
    if not path.is_file():
        raise FluxtrueError(f"--replay {path}: no such file")
    with reading(f"--replay {path}", "a readable log"), can.LogReader(path) as reader:
        frames = list(reader)
    if not frames:
        raise FluxtrueError(f"--replay {path}: holds no frame")
    begin_s = frames[0].timestamp
    return Recording([frame.timestamp - begin_s for frame in frames], frames, *_truth(path, begin_s))


def _truth(path: Path, begin_s: float) -> tuple[list[float], list[float]]:
    """Times and values of the true torque; none in a log of another format or of a bench."""
    try:
        with MDF(path) as recorded:
            signal, origin_s = recorded.get(TRUTH), recorded.header.start_time.timestamp()
    except Exception:  # for other formats the reader raises many kinds of exceptions
        return [], []
    return [float(t) + origin_s - begin_s for t in signal.timestamps], [float(value) for value in signal.samples]


class Replay:
    """Plays a recording to the samples, again and again. Any thread."""

    def __init__(self, recording: Recording, samples: Samples) -> None:
        self._recording, self._samples = recording, samples
        self._lock = threading.Lock()
        self._position_s = 0.0
        self._frame = self._true = 0  # the next ones
        self.paused = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        self._thread.start()

    def state(self) -> dict[str, float | bool]:
        """Where it is."""
        return {"position_s": self._position_s, "length_s": self._recording.length_s, "paused": self.paused}

    def seek(self, position_s: float) -> None:
        """Continue at another time; what lies shortly before it is drawn at once."""
        with self._lock:
            self._position_s = min(max(position_s, 0.0), self._recording.length_s)
            begin_s = self._position_s - BEFORE_S
            self._frame = bisect_left(self._recording.times_s, begin_s)
            self._true = bisect_left(self._recording.truth_s, begin_s)
            self._samples.restart()
            self._advance(0.0)

    def close(self) -> None:
        """Stop the replay."""
        self._stop.set()
        self._thread.join(1.0)

    def _play(self) -> None:
        before_s = time.monotonic()
        while not self._stop.wait(CHUNK_S):
            passed_s, before_s = time.monotonic() - before_s, time.monotonic()
            if self.paused:
                continue
            if self._position_s >= self._recording.length_s:
                self.seek(0.0)
            with self._lock:
                self._advance(passed_s)

    def _advance(self, seconds: float) -> None:
        recording = self._recording
        self._position_s = min(self._position_s + seconds, recording.length_s)
        while self._true < len(recording.truth_s) and recording.truth_s[self._true] <= self._position_s:
            self._samples.truth(recording.truth_s[self._true], recording.truth_Nm[self._true])
            self._true += 1
        while self._frame < len(recording.frames) and recording.times_s[self._frame] <= self._position_s:
            frame = recording.frames[self._frame]
            self._samples(can.Message(arbitration_id=frame.arbitration_id, is_extended_id=frame.is_extended_id,
                                      data=frame.data, timestamp=recording.times_s[self._frame]))  # fmt: skip
            self._frame += 1
