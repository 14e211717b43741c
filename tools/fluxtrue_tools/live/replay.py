# SPDX-License-Identifier: Apache-2.0
"""A recorded drive instead of a bus: the same frames at the same distances in time, from any moment on."""

import threading
import time
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import can
import numpy as np

from fluxtrue_tools import light_can
from fluxtrue_tools.bus.interface import Interface, read_interface
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import TRUTH
from fluxtrue_tools.log.recording import Beside, Recording, read_recording

CHUNK_S: Final = 0.02
BEFORE_S: Final = 20.0  # what the page draws: a jump fills it
MDF4: Final = ".mf4"
NOTHING: Final = Beside(np.zeros(0), np.zeros(0), "")


@dataclass(frozen=True)
class Drive:
    """Frames, and the torque of the simulated machine if there was one; times since the first frame."""

    times_s: list[float]
    frames: list[can.Message]
    truth_s: list[float]
    truth_Nm: list[float]
    interface: Interface

    @property
    def length_s(self) -> float:
        """The time from the first to the last frame."""
        return self.times_s[-1]


def load(path: Path) -> Drive:
    """Everything in a log that a page can show: an MDF4 file, or another format of python-can."""
    name = f"--replay {path}"
    if not path.is_file():
        raise FluxtrueError(f"{name}: no such file")
    if path.suffix.lower() == MDF4:
        return _of_recording(read_recording(path, name), name)
    if MDF4 in (suffix.lower() for suffix in path.suffixes):
        light_can.with_mdf()  # python-can's own reader, for a compressed file
    with reading(name, "a readable log"), can.LogReader(path) as reader:
        frames = list(reader)
    return _drive(frames, name, read_interface())


def _drive(frames: list[can.Message], name: str, interface: Interface, truth: Beside = NOTHING) -> Drive:
    if not frames:
        raise FluxtrueError(f"{name}: holds no frame")
    begin_s = frames[0].timestamp
    times_s = [frame.timestamp - begin_s for frame in frames]
    return Drive(times_s, frames, (truth.time_s - begin_s).tolist(), truth.values.astype(float).tolist(), interface)


def _of_recording(recording: Recording, name: str) -> Drive:
    each = zip(recording.time_s.tolist(), recording.ids.tolist(), recording.extended.tolist(),
               recording.lengths.tolist(), recording.data, strict=True)  # fmt: skip
    with reading(name, "a readable log"):
        frames = [can.Message(timestamp=time_s, arbitration_id=number, is_extended_id=extended,
                              data=data[:length].tobytes(), check=True)
                  for time_s, number, extended, length, data in each]  # fmt: skip
    return _drive(frames, name, recording.interface, recording.beside.get(TRUTH, NOTHING))


class Replay:
    """Plays a recording to the samples, again and again. Any thread."""

    def __init__(self, recording: Drive, samples: Samples) -> None:
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
