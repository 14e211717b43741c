# SPDX-License-Identifier: Apache-2.0
"""The last value of every signal, by the names of the DBC."""

import threading
from collections.abc import Collection
from typing import Any

import can
import cantools.database


class LastValues:
    """A python-can listener that decodes. Any thread."""

    def __init__(self, database: cantools.database.Database, only: Collection[str] = ()) -> None:
        self._messages = {message.frame_id: message for message in database.messages
                          if not only or message.name in only}  # fmt: skip
        self._choices = {(message.name, signal.name): dict(signal.choices or {})
                         for message in self._messages.values() for signal in message.signals}  # fmt: skip
        self._lock = threading.Lock()
        self._last: dict[str, Any] = {}
        self.undecoded = 0
        self.newest_s = 0.0  # the bus's clock: simulated time on a virtual ECU

    def __call__(self, frame: can.Message) -> None:
        message = self._messages.get(frame.arbitration_id)
        if message is None or frame.is_extended_id or frame.is_error_frame:
            return
        try:
            signals = message.decode(bytes(frame.data), decode_choices=False)
        except (ValueError, cantools.database.DecodeError):
            self.undecoded += 1
            return
        assert isinstance(signals, dict)
        self.newest_s = frame.timestamp
        with self._lock:
            self._last[message.name] = signals
            self._keep(message.name, frame.timestamp, signals)

    def _keep(self, name: str, time_s: float, signals: dict[str, Any]) -> None:
        """More than the last value, for a class that keeps it; the lock is held."""

    def message(self, name: str) -> dict[str, Any] | None:
        """The last values of a message; None before its first frame."""
        with self._lock:
            return self._last.get(name)

    def choice(self, message: str, signal: str) -> str:
        """The name of a signal's last value; empty before its first frame."""
        signals = self.message(message)
        return "" if signals is None else str(self._choices[message, signal].get(int(signals[signal]), ""))

    def state(self) -> str:
        """The inverter's state by name; empty before its first frame."""
        return self.choice("INV_Status", "State")

    def last(self) -> dict[str, dict[str, float]]:
        """The last value of every signal, message by message."""
        with self._lock:
            return {name: {key: float(value) for key, value in signals.items()}
                    for name, signals in self._last.items()}  # fmt: skip
