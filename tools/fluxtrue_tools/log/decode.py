# SPDX-License-Identifier: Apache-2.0
"""Bus frames of an MDF4 file into signals, by the DBC that is attached to it, else by the standard one."""

from pathlib import Path

import numpy as np
import pandas as pd

from fluxtrue_tools.bus.interface import CONFIGURATION
from fluxtrue_tools.bus.scales import HASH
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.log.recording import Recording, read_recording


def signals_of(path: Path) -> dict[str, pd.Series]:
    """Every signal by its name Message.Signal, over seconds since the first frame.

    attrs["unit"] and attrs["choices"] of a series are the DBC's. Frames of an inverter that the DBC does not describe
    are an error: their values would have another scale.
    """
    recording = read_recording(path)
    interface = recording.interface
    with reading(path, "an MDF4 bus log"):
        found = _decode(recording)
    if not found:
        raise FluxtrueError(f"{path}: holds no frame that {interface.name} describes")
    told = found.get(f"{CONFIGURATION}.{HASH}")
    problem = "" if told is None else interface.mismatch({HASH: told.iloc[-1]})
    if problem:
        raise FluxtrueError(f"{path}: {problem}")
    return found | _beside(recording)


def _beside(recording: Recording) -> dict[str, pd.Series]:
    """XCP measurements and the truth of a simulation, over the same time."""
    begin_s = recording.time_s[0] if len(recording.time_s) else 0.0
    found: dict[str, pd.Series] = {}
    for name, signal in recording.beside.items():
        found[name] = values = pd.Series(signal.values, index=signal.time_s - begin_s)
        values.attrs = {"unit": signal.unit, "choices": {}}
    return found


def _decode(recording: Recording) -> dict[str, pd.Series]:
    found: dict[str, pd.Series] = {}
    for message in recording.interface.database.messages:
        is_it = (recording.ids == message.frame_id) & ~recording.extended & (recording.lengths == message.length)
        rows = np.flatnonzero(is_it)
        if not len(rows):
            continue
        decoded = [message.decode(recording.data[row].tobytes(), decode_choices=False) for row in rows]
        table = pd.DataFrame(decoded, index=recording.time_s[rows] - recording.time_s[0])
        for signal in message.signals:
            found[f"{message.name}.{signal.name}"] = values = table[signal.name]
            values.attrs = {"unit": signal.unit or "", "choices": signal.choices or {}}
    return found
