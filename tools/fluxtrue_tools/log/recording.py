# SPDX-License-Identifier: Apache-2.0
"""A recorded drive (MDF4): its frames, the DBC that is attached to it, and the signals beside the frames."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fluxtrue_tools.bus.interface import Interface, read_interface
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.reader_process import arrays_from

READER: Final = "fluxtrue_tools.log.mdf_reader"  # not imported here: it loads asammdf


@dataclass(frozen=True)
class Beside:
    """A signal that is not decoded from frames."""

    time_s: np.ndarray
    values: np.ndarray
    unit: str


@dataclass(frozen=True)
class Recording:
    """Classical frames in the order of their times. Times are seconds since the start of the recording."""

    time_s: np.ndarray
    ids: np.ndarray
    extended: np.ndarray
    lengths: np.ndarray
    data: np.ndarray  # frames x 8
    interface: Interface  # the attached one, else the standard one
    beside: dict[str, Beside]


def read_recording(path: Path, named: str = "") -> Recording:
    """The whole file; what is wrong with it is one message that begins with `named` or with the path."""
    name = named or str(path)
    if not path.is_file():
        raise FluxtrueError(f"{name}: no such file")
    try:
        found = arrays_from(READER, path)
    except ValueError as error:
        raise FluxtrueError(f"{name}: not an MDF4 bus log ({error})") from None
    if "dbc" in found:
        interface = Interface(f"{found['dbc_name']} in {path.name}", str(found["dbc"]))
        with reading(interface.name, "a DBC"):
            interface.database  # noqa: B018, reads it
    else:
        interface = read_interface()
    names = zip(found["beside"].tolist(), found["unit"].tolist(), strict=True)
    beside = {key: Beside(found[f"beside_s/{k}"], found[f"beside/{k}"], unit) for k, (key, unit) in enumerate(names)}
    return Recording(found["time_s"], found["ID"], found["IDE"] != 0, found["DataLength"], found["DataBytes"],
                     interface, beside)  # fmt: skip
