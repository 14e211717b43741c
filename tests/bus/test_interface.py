# SPDX-License-Identifier: Apache-2.0
"""The version of the bus interface must increase when a signal changes its name, position, scale or unit.

interface.txt lists the signals of the version in its first line. `python tests/bus/test_interface.py` writes it.
"""

import re
from pathlib import Path

from ecu import ROOT, load_dbc

LICENCE = "# SPDX-License-Identifier: Apache-2.0"
LIST = Path(__file__).with_name("interface.txt")


def declared() -> list[str]:
    """Each signal of the DBC with its place and its scale."""
    lines = []
    for message in load_dbc().messages:
        for s in message.signals:
            sign = "signed" if s.is_signed else "unsigned"
            lines.append(f"0x{message.frame_id:03X} {message.name}.{s.name} {s.start}|{s.length} {sign} {s.byte_order} "
                         f"x {s.scale:g} + {s.offset:g} {s.unit or '-'}")  # fmt: skip
    return sorted(lines)


def test_a_signal_that_changed_has_counted_the_interface_up() -> None:
    _, first, *listed = LIST.read_text(encoding="utf-8").splitlines()
    now = declared()
    assert first == f"version {load_dbc().version}", "the version has changed: write the list anew"
    assert sorted(set(listed) - set(now)) == [], "count up VERSION of the DBC and INTERFACE_VERSION of messages.h"
    assert sorted(set(now) - set(listed)) == [], "a new signal: write the list anew"


def test_firmware_and_dbc_name_one_version() -> None:
    header = (ROOT / "firmware" / "comm" / "messages.h").read_text(encoding="utf-8")
    assert re.findall(r"^#define INTERFACE_VERSION (\d+)U", header, re.MULTILINE) == [load_dbc().version]


if __name__ == "__main__":
    LIST.write_text("\n".join([LICENCE, f"version {load_dbc().version}", *declared()]) + "\n", encoding="utf-8")
