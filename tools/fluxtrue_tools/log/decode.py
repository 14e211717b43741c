# SPDX-License-Identifier: Apache-2.0
"""Bus frames of an MDF4 file into signals, by the DBC that is attached to it, else by the standard one."""

from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from asammdf import MDF

from fluxtrue_tools.bus.interface import CONFIGURATION, Interface, read_interface
from fluxtrue_tools.bus.scales import HASH
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading

FRAMES: Final = "CAN_DataFrame"
FIELDS: Final = frozenset(f"{FRAMES}.{field}" for field in ("ID", "IDE", "DataLength", "DataBytes"))

BESIDE: Final = ("XCP.", "truth.")
"""How the names of signals begin that are not decoded from frames."""


def signals_of(path: Path) -> dict[str, pd.Series]:
    """Every signal by its name Message.Signal, over seconds since the first frame.

    attrs["unit"] and attrs["choices"] of a series are the DBC's. Frames of an inverter that the DBC does not describe
    are an error: their values would have another scale.
    """
    if not path.is_file():
        raise FluxtrueError(f"{path}: no such file")
    with reading(path, "an MDF4 bus log"), MDF(path) as recorded:
        interface, frames = _attached(path, recorded), recorded.get(FRAMES)
        beside = _beside(recorded, frames.timestamps[0] if len(frames.timestamps) else 0.0)
    with reading(path, "an MDF4 bus log"):
        missing = FIELDS - set(frames.samples.dtype.names or ())
        if missing:
            raise FluxtrueError(f"{path}: not an MDF4 bus log (no {min(missing)})")
        found = _decode(frames.samples, frames.timestamps, interface)
    if not found:
        raise FluxtrueError(f"{path}: holds no frame that {interface.name} describes")
    told = found.get(f"{CONFIGURATION}.{HASH}")
    problem = "" if told is None else interface.mismatch({HASH: told.iloc[-1]})
    if problem:
        raise FluxtrueError(f"{path}: {problem}")
    return found | beside


def _beside(recorded: MDF, begin_s: float) -> dict[str, pd.Series]:
    """Signals that are recorded beside the frames: XCP measurements, truth of a simulation."""
    found: dict[str, pd.Series] = {}
    for name, places in recorded.channels_db.items():
        if name.startswith(BESIDE):
            signal = recorded.get(name, *places[0])
            found[name] = values = pd.Series(signal.samples, index=signal.timestamps - begin_s)
            values.attrs = {"unit": signal.unit or "", "choices": {}}
    return found


def _attached(path: Path, recorded: MDF) -> Interface:
    """The DBC that was recorded with the frames: its factors are those of the motor."""
    for index in range(len(recorded.attachments)):
        data, name, _ = recorded.extract_attachment(index)
        if Path(name).suffix.lower() == ".dbc":
            text = data if isinstance(data, str) else data.decode("utf-8")
            return Interface(f"{Path(name).name} in {path.name}", text)
    return read_interface()


def attached_interface(path: Path) -> Interface:
    """The DBC of a recording; the standard one if it is no MDF4 file or has none."""
    try:
        with MDF(path) as recorded:
            return _attached(path, recorded)
    except Exception:  # for other formats the reader raises many kinds of exceptions
        return read_interface()


def _decode(frames: np.ndarray, times: np.ndarray, interface: Interface) -> dict[str, pd.Series]:
    ids, lengths = frames[f"{FRAMES}.ID"], frames[f"{FRAMES}.DataLength"]
    data = np.ascontiguousarray(frames[f"{FRAMES}.DataBytes"][:, :8])
    standard = frames[f"{FRAMES}.IDE"] == 0
    found: dict[str, pd.Series] = {}
    for message in interface.database.messages:
        rows = np.flatnonzero((ids == message.frame_id) & standard & (lengths == message.length))
        if not len(rows):
            continue
        decoded = [message.decode(data[row].tobytes(), decode_choices=False) for row in rows]
        table = pd.DataFrame(decoded, index=times[rows] - times[0])
        for signal in message.signals:
            found[f"{message.name}.{signal.name}"] = values = table[signal.name]
            values.attrs = {"unit": signal.unit or "", "choices": signal.choices or {}}
    return found
