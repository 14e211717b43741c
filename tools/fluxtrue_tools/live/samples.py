# SPDX-License-Identifier: Apache-2.0
"""Frames into columns: what the page draws, collected between two sendings."""

from typing import Any, Final

import cantools.database

from fluxtrue_tools.live.last import LastValues

# Signals that are drawn; of all others the page shows the last value.
DRAWN: Final = {
    "INV_Status": ("TorqueEstimated", "TorqueCommanded", "Speed"),
    "INV_Currents": ("Id", "Iq", "IdRef", "IqRef"),
    "INV_Identification": ("PsiF", "Resistance", "PsiQuality", "ResistanceQuality"),
    "INV_DcLink": ("DcVoltage", "DcCurrent"),
}  # fmt: skip
TRUTH: Final = "truth"  # the simulated machine's torque, beside the messages

Columns = dict[str, dict[str, list[float]]]


class Samples(LastValues):
    """Columns of the drawn signals; take() empties them. Any thread."""

    def __init__(self, database: cantools.database.Database) -> None:
        super().__init__(database)
        self._columns: Columns = {}
        self._run = 0  # counted up when the time of the samples begins anew

    def _keep(self, name: str, time_s: float, signals: dict[str, Any]) -> None:
        if name in DRAWN:
            self._append(name, time_s, {signal: float(signals[signal]) for signal in DRAWN[name]})

    def _append(self, name: str, time_s: float, values: dict[str, float]) -> None:
        columns = self._columns.setdefault(name, {"t": []})
        columns["t"].append(time_s)
        for signal, value in values.items():
            columns.setdefault(signal, []).append(value)

    def truth(self, time_s: float, torque_Nm: float) -> None:
        """The torque of the simulated machine at a time of the bus."""
        with self._lock:
            self._append(TRUTH, time_s, {"Torque": torque_Nm})

    def restart(self) -> None:
        """The following samples do not continue the earlier ones: a replay has moved to another time."""
        with self._lock:
            self._columns, self._run = {}, self._run + 1

    def factors(self) -> dict[str, dict[str, float]]:
        """What one count of each signal is, message by message."""
        return {message.name: {signal.name: float(signal.scale) for signal in message.signals}
                for message in self._messages.values()}  # fmt: skip

    def take(self) -> tuple[int, Columns]:
        """The number of the run, and its columns since the last call."""
        with self._lock:
            columns, self._columns = self._columns, {}
            return self._run, columns
