# SPDX-License-Identifier: Apache-2.0
"""Names of the drive's faults, as the DBC has them: bit k of the fault word is value k + 1 of FirstFault."""

from functools import cache

from fluxtrue_tools.bus import DBC

BITS = 32


@cache
def names() -> dict[int, str]:
    """Name by bit."""
    import cantools.database

    message = cantools.database.load_file(DBC).get_message_by_name("INV_Faults")  # type: ignore[union-attr]
    choices = message.get_signal_by_name("FirstFault").choices or {}
    return {int(value) - 1: str(name) for value, name in choices.items() if 1 <= int(value) <= BITS}


def named(word: int) -> list[str]:
    """The faults in a fault word, lowest bit first."""
    return [names().get(bit, f"bit {bit}") for bit in range(BITS) if word >> bit & 1]
