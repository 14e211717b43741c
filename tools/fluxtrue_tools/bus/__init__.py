# SPDX-License-Identifier: Apache-2.0
"""The CAN interface: C code from the one DBC, which the wheel of the tools carries beside this file."""

from pathlib import Path
from typing import Final

from fluxtrue_tools.version import in_checkout

_COMM: Final = Path(__file__).resolve().parents[3] / "firmware" / "comm"
DBC: Final = (_COMM if in_checkout() else Path(__file__).parent) / "fluxtrue.dbc"
