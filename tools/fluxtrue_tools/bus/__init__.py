# SPDX-License-Identifier: Apache-2.0
"""The CAN interface: C code from the one DBC."""

from pathlib import Path
from typing import Final

DBC: Final = Path(__file__).resolve().parents[3] / "firmware" / "comm" / "fluxtrue.dbc"
