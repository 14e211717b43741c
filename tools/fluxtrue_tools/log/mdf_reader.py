# SPDX-License-Identifier: Apache-2.0
"""Reads an MDF4 bus log with asammdf, in a process of its own: a damaged file can make that reader crash."""

from pathlib import Path
from typing import Final

import numpy as np
from asammdf import MDF

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.reader_process import Arrays

FRAMES: Final = "CAN_DataFrame"
FIELDS: Final = {field: f"{FRAMES}.{field}" for field in ("DataBytes", "DataLength", "ID", "IDE")}
BYTES: Final = 8  # of the data of a frame

BESIDE: Final = ("XCP.", "truth.")
"""How the names of signals begin that are not decoded from frames."""


def read(path: Path) -> Arrays:
    """Frames in the order of their times, the attached DBC, and what was recorded beside the frames.

    time_s, ID, IDE, DataLength and DataBytes (frames x 8) of classical frames; dbc, dbc_name; beside and unit, the
    names and units of further signals, with their arrays beside/k and beside_s/k.
    """
    with MDF(path) as recorded:
        return _frames(recorded) | _dbc(recorded) | _beside(recorded)


def _frames(recorded: MDF) -> Arrays:
    parts: list[Arrays] = []
    for group, content in enumerate(recorded.groups):
        if FRAMES in (channel.name for channel in content.channels):
            signal = recorded.get(FRAMES, group=group)
            missing = set(FIELDS.values()) - set(signal.samples.dtype.names or ())
            if missing:
                raise FluxtrueError(f"no {min(missing)}")
            parts.append({"time_s": signal.timestamps} | {key: signal.samples[name] for key, name in FIELDS.items()})
    if not parts:
        raise FluxtrueError(f"no {FRAMES}")
    for part in parts:
        part["DataBytes"] = _eight_bytes(part["DataBytes"])
    frames = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    order = np.argsort(frames["time_s"], kind="stable")
    order = order[frames["DataLength"][order] <= BYTES]
    return {key: values[order] for key, values in frames.items()}


def _eight_bytes(data: np.ndarray) -> np.ndarray:
    columns = data[:, :BYTES].astype(np.uint8)
    return np.pad(columns, ((0, 0), (0, BYTES - columns.shape[1])))


def _dbc(recorded: MDF) -> Arrays:
    """The DBC that was recorded with the frames: its factors are those of the motor. Nothing if there is none."""
    for index in range(len(recorded.attachments)):
        data, name, _ = recorded.extract_attachment(index)
        if Path(name).suffix.lower() == ".dbc":
            return {"dbc": data if isinstance(data, str) else data.decode("utf-8"), "dbc_name": Path(name).name}
    return {}


def _beside(recorded: MDF) -> Arrays:
    found: Arrays = {"beside": [], "unit": []}
    for name, places in recorded.channels_db.items():
        if name.startswith(BESIDE):
            signal = recorded.get(name, *places[0])
            if signal.samples.dtype.kind not in "biuf":
                raise FluxtrueError(f"{name} is no array of numbers")
            index = len(found["beside"])
            found |= {f"beside/{index}": signal.samples, f"beside_s/{index}": signal.timestamps}
            found["beside"].append(name)
            found["unit"].append(signal.unit or "")
    return found | {key: np.array(found[key], dtype=np.str_) for key in ("beside", "unit")}
