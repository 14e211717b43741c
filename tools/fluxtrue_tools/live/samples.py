# SPDX-License-Identifier: Apache-2.0
"""Frames into columns: what the page draws, collected between two sendings."""

import threading
from typing import Any, Final

import can
import cantools.database

# Signals that are drawn; of all others the page shows the last value.
DRAWN: Final = {
    "INV_Status": ("TorqueEstimated", "TorqueCommanded", "Speed"),
    "INV_Currents": ("Id", "Iq", "IdRef", "IqRef"),
    "INV_Identification": ("PsiF", "Resistance", "PsiQuality", "ResistanceQuality"),
    "INV_DcLink": ("DcVoltage", "DcCurrent"),
}  # fmt: skip


class Samples:
    """A python-can listener that decodes; take() empties it. Any thread."""

    def __init__(self, database: cantools.database.Database) -> None:
        self._messages = {message.frame_id: message for message in database.messages}
        self._lock = threading.Lock()
        self._columns: dict[str, dict[str, list[float]]] = {}
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
            for name in DRAWN.get(message.name, ()):
                columns = self._columns.setdefault(message.name, {})
                columns.setdefault(name, []).append(float(signals[name]))
            if message.name in DRAWN:
                self._columns[message.name].setdefault("t", []).append(frame.timestamp)
            self._last[message.name] = signals

    def factors(self) -> dict[str, dict[str, float]]:
        """What one count of each signal is, message by message."""
        return {message.name: {signal.name: float(signal.scale) for signal in message.signals}
                for message in self._messages.values()}  # fmt: skip

    def message(self, name: str) -> dict[str, Any] | None:
        """The last values of a message; None before its first frame."""
        with self._lock:
            return self._last.get(name)

    def choice(self, message: str, signal: str) -> str:
        """The name of a signal's last value; empty before its first frame."""
        signals = self.message(message)
        if signals is None:
            return ""
        described = next(m for m in self._messages.values() if m.name == message).get_signal_by_name(signal)
        return str((described.choices or {}).get(int(signals[signal]), ""))

    def state(self) -> str:
        """The inverter's state by name; empty before its first frame."""
        return self.choice("INV_Status", "State")

    def take(self) -> dict[str, dict[str, list[float]]]:
        """The columns since the last call."""
        with self._lock:
            columns, self._columns = self._columns, {}
        return columns

    def last(self) -> dict[str, Any]:
        """The last value of every signal, message by message."""
        with self._lock:
            return {name: {key: float(value) for key, value in signals.items()}
                    for name, signals in self._last.items()}  # fmt: skip
