# SPDX-License-Identifier: Apache-2.0
"""Bus frames of an MDF4 file into signals, by the project's DBC."""

from pathlib import Path
from typing import Final

import cantools.database
import numpy as np
import pandas as pd
from asammdf import MDF

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.errors import FluxtrueError

FRAMES: Final = "CAN_DataFrame"
FIELDS: Final = frozenset(f"{FRAMES}.{field}" for field in ("ID", "IDE", "DataLength", "DataBytes"))


def signals_of(path: Path) -> dict[str, pd.Series]:
    """Every signal by its name Message.Signal, over seconds since the first frame.

    attrs["unit"] and attrs["choices"] of a series are the DBC's.
    """
    if not path.is_file():
        raise FluxtrueError(f"{path}: no such file")
    try:
        with MDF(path) as recorded:
            frames = recorded.get(FRAMES)
    except Exception as error:  # for a bad file the reader raises many kinds of exceptions
        raise FluxtrueError(f"{path}: not an MDF4 bus log ({error})") from error
    missing = FIELDS - set(frames.samples.dtype.names or ())
    if missing:
        raise FluxtrueError(f"{path}: not an MDF4 bus log (no {min(missing)})")
    found = _decode(frames.samples, frames.timestamps)
    if not found:
        raise FluxtrueError(f"{path}: holds no frame that {DBC.name} describes")
    return found


def _decode(frames: np.ndarray, times: np.ndarray) -> dict[str, pd.Series]:
    ids, lengths = frames[f"{FRAMES}.ID"], frames[f"{FRAMES}.DataLength"]
    data = np.ascontiguousarray(frames[f"{FRAMES}.DataBytes"][:, :8])
    standard = frames[f"{FRAMES}.IDE"] == 0
    found: dict[str, pd.Series] = {}
    for message in cantools.database.load_file(DBC).messages:
        rows = np.flatnonzero((ids == message.frame_id) & standard & (lengths == message.length))
        if not len(rows):
            continue
        decoded = [message.decode(data[row].tobytes(), decode_choices=False) for row in rows]
        table = pd.DataFrame(decoded, index=times[rows] - times[0])
        for signal in message.signals:
            found[f"{message.name}.{signal.name}"] = values = table[signal.name]
            values.attrs = {"unit": signal.unit or "", "choices": signal.choices or {}}
    return found
