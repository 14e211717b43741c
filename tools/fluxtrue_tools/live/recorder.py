# SPDX-License-Identifier: Apache-2.0
"""A recording: the frames of the bus, what XCP measures, and the torque of the simulated machine, in one MDF4 file."""

import threading
from datetime import datetime
from pathlib import Path

import can

from fluxtrue_tools.bus.interface import Interface
from fluxtrue_tools.live.measuring import Layout
from fluxtrue_tools.live.stand import TRUTH
from fluxtrue_tools.outputs import atomic
from fluxtrue_tools.vecu.mdf import BusLog, Group


class Recorder:
    """Keeps what arrives from start() to stop(), then writes one file. Any thread."""

    def __init__(self, folder: Path, interface: Interface) -> None:
        self._folder, self._interface = folder, interface
        self._log: BusLog | None = None
        self._truth = Group({TRUTH: "Nm"})
        self._layout: Layout | None = None
        self._measured: list[Group] = []
        self._lock = threading.Lock()

    @property
    def running(self) -> bool:
        """Whether frames are kept."""
        return self._log is not None

    def __call__(self, frame: can.Message) -> None:
        with self._lock:
            if self._log is None:
                return
            self._log(frame)
            if self._layout is not None:
                self._layout.take(frame, self._measured)

    def truth(self, time_s: float, torque_Nm: float) -> None:
        """The torque of the simulated machine at a time of the bus."""
        with self._lock:
            if self._log is not None:
                self._truth.add(time_s, torque_Nm)

    def start(self, layout: Layout | None = None) -> None:
        """Start a new recording; the layout says how to read the frames with XCP measurements."""
        with self._lock:
            self._log, self._truth, self._layout = BusLog(), Group({TRUTH: "Nm"}), layout
            self._measured = layout.groups() if layout is not None else []

    def stop(self) -> Path | None:
        """The file written; None when nothing was recorded."""
        with self._lock:
            log, self._log = self._log, None
            groups = [self._truth, *self._measured]
        if log is None or len(log) == 0:
            return None
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"live-{datetime.now():%Y%m%d-%H%M%S}.mf4"
        with atomic(path) as scratch:
            log.write(scratch, self._interface, groups)
        return path
