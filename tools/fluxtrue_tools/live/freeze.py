# SPDX-License-Identifier: Apache-2.0
"""The freeze frame: what the ECU stored of the last steps before the first fault. See docs/howto/xcp.md."""

import struct
from typing import Any, Final

from fluxtrue_tools.a2l.elf import Description, Value
from fluxtrue_tools.live.xcp import Xcp

PREFIX: Final = "freeze_"
FORMATS: Final = {"U8": "B", "U16": "H", "U32": "I", "S16": "h", "F32": "f"}


def _values(xcp: Xcp, value: Value, factor: float) -> list[float]:
    """A value, or all of an array."""
    layout = struct.Struct(f"<{max(value.count, 1)}{FORMATS[value.type]}")
    return [raw * factor for raw in layout.unpack(xcp.read(value.address, layout.size))]


def frame(xcp: Xcp, description: Description) -> dict[str, Any]:
    """Signals over the time before the fault, oldest first; {"frozen": False} without a fault."""
    stored = {value.name.removeprefix(PREFIX): value for value in description.frozen}
    factors = {base.name: base.factor for base in description.bases}
    if not _values(xcp, stored["frozen"], 1.0)[0]:
        return {"frozen": False}
    single = {name: _values(xcp, value, 1.0)[0] for name, value in stored.items() if value.count == 0}
    oldest = int(single["oldest"])
    signals = {}
    for name, value in stored.items():
        if value.count:
            ring = _values(xcp, value, factors.get(value.base, 1.0))
            signals[name] = ring[oldest:] + ring[:oldest]
    samples = len(next(iter(signals.values())))
    return {"frozen": True, "values": single, "signals": signals,
            "t_ms": [1e3 * description.step_s * (k + 1 - samples) for k in range(samples)]}  # fmt: skip
