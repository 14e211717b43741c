# SPDX-License-Identifier: Apache-2.0
"""Names and explanations of faults and of refused motor data, as the DBC has them.

Bit k of the fault word is value k + 1 of FirstFault. fluxtrue_tools.bus.words writes these tables and comments from the
firmware's lists.
"""

import re
from functools import cache
from typing import Any, Final

from fluxtrue_tools.bus import DBC

BITS = 32
CONFIG: Final = "config"
"""The fault whose cause is a check of the motor data."""
_EXPLAINED: Final = re.compile(r"(?:Bit )?(\d+) (\w+): (.*?\.)(?= (?:Bit )?\d+ \w+: |$)")


@cache
def _signal(path: str) -> Any:
    import cantools.database

    message, signal = path.split(".")
    database: Any = cantools.database.load_file(DBC)
    return database.get_message_by_name(message).get_signal_by_name(signal)


@cache
def names() -> dict[int, str]:
    """The names of the faults by their bits."""
    choices = _signal("INV_Faults.FirstFault").choices or {}
    return {int(value) - 1: str(name) for value, name in choices.items() if 1 <= int(value) <= BITS}


def named(word: int) -> list[str]:
    """The faults in a fault word, lowest bit first."""
    return [names().get(bit, f"bit {bit}") for bit in range(BITS) if word >> bit & 1]


@cache
def explained(path: str) -> dict[int, tuple[str, str]]:
    """Name and explanation by value or bit of a signal: explained("INV_Faults.DriveFaults")."""
    found = _EXPLAINED.findall(_signal(path).comment or "")
    return {int(value): (name, text) for value, name, text in found}


def refused_data(check: int) -> str:
    """Which check of the motor data failed, in words; empty for none."""
    if check == 0:
        return ""
    name, text = explained("INV_Configuration.MotorCheck").get(check, (f"check {check}", "Not known to these tools."))
    return f"{name}: {text.removesuffix('.')}"
